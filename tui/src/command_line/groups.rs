//! The first page of help: the commands under what a person wants to do.

use std::fmt::Write as _;

/// A task, and the commands for it in the order in which they are met.
const GROUPS: [(&str, &[&str]); 7] = [
    ("Operate", &["init", "run", "queue", "watch", "answer", "target", "check", "doctor"]),
    ("Look back", &["history", "show", "certificate", "note", "record"]),
    ("Many cells", &["serve", "ship", "fleet", "alert"]),
    ("Model lab", &["model", "report"]),
    ("Scans", &["stripe"]),
    ("Practise", &["trial", "emulate", "wire", "study"]),
    ("Extend", &["plugins", "streams", "schema", "completions", "man", "help"]),
];

/// Columns of the narrowest terminal that is looked after.
const WIDTH: usize = 80;

/// Columns before a command's sentence.
const INDENT: usize = 15;

/// The groups as text. A command without a group, which a test refuses, is at the end.
pub(super) fn overview(command: &clap::Command) -> String {
    let mut text = String::new();
    for (task, names) in GROUPS {
        let _ = writeln!(text, "{task}:");
        for name in names {
            text.push_str(&entry(name, &sentence(command, name)));
        }
        text.push('\n');
    }
    text
}

/// The first sentence of what a command says of itself.
fn sentence(command: &clap::Command, name: &str) -> String {
    if name == "help" {
        return "Print this page, or the help of a command".to_owned();
    }
    let about = command.find_subcommand(name).and_then(clap::Command::get_about).map(ToString::to_string);
    let about = about.unwrap_or_default();
    about.split(". ").next().unwrap_or_default().trim_end_matches('.').to_owned()
}

/// A command and its sentence, wrapped.
fn entry(name: &str, sentence: &str) -> String {
    let mut text = format!("  {name:<width$}", width = INDENT - 2);
    let mut column = INDENT;
    for word in sentence.split_whitespace() {
        let length = word.chars().count();
        if column > INDENT && column + 1 + length > WIDTH {
            let _ = write!(text, "\n{:INDENT$}", "");
            column = INDENT;
        }
        if column > INDENT {
            text.push(' ');
            column += 1;
        }
        text.push_str(word);
        column += length;
    }
    text.push('\n');
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_sentence_goes_on_below_its_beginning() {
        let text = entry("run", &"word ".repeat(30));
        let lines: Vec<&str> = text.lines().collect();
        assert!(lines.len() > 1 && lines.iter().all(|line| line.chars().count() <= WIDTH), "{text}");
        assert!(lines[1].starts_with(&" ".repeat(INDENT)) && !lines[1].ends_with(' '), "{text}");
    }
}
