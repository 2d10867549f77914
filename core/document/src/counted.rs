//! A number before its noun or verb, as English has it: `1 run`, `2 runs`; for messages of all crates.

use std::fmt::Display;

/// The count with the word for one, or for several and none.
pub fn counted<N: Display + PartialEq + From<u8>>(count: N, one: &str, several: &str) -> String {
    let word = if count == N::from(1) { one } else { several };
    format!("{count} {word}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_has_a_word_of_its_own() {
        assert_eq!(counted(0_i64, "run", "runs"), "0 runs");
        assert_eq!(counted(1_usize, "run", "runs"), "1 run");
        assert_eq!(counted(2_u64, "waits", "wait"), "2 wait");
    }
}
