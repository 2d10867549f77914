//! What a process is called, for people.

use std::fs;

/// The most of a command line that is shown, in characters.
const LONGEST: usize = 80;

/// A process by its number and its command line: `process 4711 (plumb host arm of teachmover)`. 0 is the system itself.
pub fn process_name(process: u32) -> String {
    if process == 0 {
        return "the system".to_owned();
    }
    let line = fs::read(format!("/proc/{process}/cmdline")).unwrap_or_default();
    let words: Vec<String> = line
        .split(|byte| *byte == 0)
        .filter(|word| !word.is_empty())
        .map(|word| String::from_utf8_lossy(word).chars().filter(|letter| !letter.is_control()).collect())
        .collect();
    let line: String = words.join(" ").chars().take(LONGEST).collect();
    if line.is_empty() { format!("process {process}") } else { format!("process {process} ({line})") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_process_is_named_with_its_command_line() {
        let own = process_name(std::process::id());
        assert!(own.starts_with(&format!("process {} (", std::process::id())), "{own}");
        assert!(own.chars().count() < LONGEST + 30, "{own}");
        assert_eq!(process_name(0), "the system");
        assert_eq!(process_name(u32::MAX), format!("process {}", u32::MAX), "one that has gone");
    }
}
