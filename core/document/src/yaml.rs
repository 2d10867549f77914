//! What the YAML library complains of, in words a user can act on.

use serde_yaml::Error;

/// The line and column (from 1) of a mistake, where it has a place.
#[must_use]
pub fn place(error: &Error) -> Option<(u64, u64)> {
    let error = error.without_snippet();
    error.location().filter(|at| at.line() > 0).map(|at| (at.line(), at.column()))
}

/// What is wrong and where, in one line: `line 3, column 5: the key `a` stands twice; keep one of them`.
#[must_use]
pub fn in_words(error: &Error) -> String {
    let reason = reason(error);
    match place(error) {
        Some((line, column)) => format!("line {line}, column {column}: {reason}"),
        None => reason,
    }
}

/// What is wrong, without its place.
#[must_use]
pub fn reason(error: &Error) -> String {
    match error.without_snippet() {
        Error::DuplicateMappingKey { key: Some(key), .. } => {
            format!("the key `{key}` stands twice; keep one of them")
        }
        Error::Budget { .. } => TOO_MUCH.to_owned(),
        Error::MultipleDocuments { .. } => {
            "a second document begins here; write one document a file".to_owned()
        }
        other => match plain(&other.to_string()) {
            words if words.starts_with("budget breached") || words.contains("recursion limit") => {
                TOO_MUCH.to_owned()
            }
            words => words,
        },
    }
}

/// Aliases of aliases, or lists in lists without end.
const TOO_MUCH: &str =
    "this is more than a file may hold: too many values, too deep inside each other, or aliases of aliases";

/// The library's own words, without the place it adds at the end and without advice for programmers.
fn plain(message: &str) -> String {
    let first = message.lines().next().unwrap_or_default();
    if first.contains("tabs disallowed") {
        return "there is a tab; write spaces".to_owned();
    }
    let first = first.split_once(": line ").map_or(first, |(reason, _)| reason);
    let first = first.split(" at line ").next().unwrap_or(first);
    let first = first.split(", set DuplicateKeyPolicy").next().unwrap_or(first);
    first.trim_start_matches("error: ").to_owned()
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;

    fn said(text: &str) -> String {
        let read: Result<BTreeMap<String, Vec<f64>>, _> = serde_yaml::from_str(text);
        in_words(&read.expect_err("it is wrong"))
    }

    #[test]
    fn no_word_of_the_library_comes_through() {
        assert_eq!(said("a: []\na: []\n"), "line 2, column 1: the key `a` stands twice; keep one of them");
        assert!(said(&format!("a: {}", "[".repeat(100_000))).contains("more than a file may hold"));
        assert!(said("a: [1, x]\n").starts_with("line 1, column 8: "), "{}", said("a: [1, x]\n"));
    }
}
