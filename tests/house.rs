//! How the house is kept: no file over 600 lines, no function over 60, no import circle inside a crate, no retired word before a user or in an identifier.
//!
//! Counted over tokens, so that comments and strings do not count as code. What is under `#[cfg(test)]` is left out, and so are tests, examples and benches.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

#[path = "house/circles.rs"]
mod circles;
#[path = "house/identifiers.rs"]
mod identifiers;
#[path = "house/source.rs"]
mod source;
#[path = "house/words.rs"]
mod words;

use std::collections::BTreeSet;

use source::{Source, sources};

/// Lines of a file at most.
const FILE_LINES: usize = 600;

/// Lines of a function at most, from `fn` to its closing brace.
const FUNCTION_LINES: usize = 60;

/// Files that are still too long. This list may only shrink.
const LONG_FILES: &[&str] = &[];

/// Functions that are still too long, as `file name`. This list may only shrink.
const LONG_FUNCTIONS: &[&str] = &[];

/// Files that still import one another in a circle, a line a circle. This list may only shrink.
const CIRCLES: &[&[&str]] = &[];

/// What offends without being listed, and what is listed without offending.
fn compare(found: &BTreeSet<String>, listed: &[&str]) -> String {
    let known: BTreeSet<String> = listed.iter().map(|one| (*one).to_owned()).collect();
    let new = found.difference(&known).map(|one| format!("  too long: {one}\n"));
    let mended = known.difference(found).map(|one| format!("  mended, take it off the list: {one}\n"));
    new.chain(mended).collect()
}

#[test]
fn no_file_is_longer_than_600_lines() {
    let long: BTreeSet<String> =
        sources().iter().filter(|file| file.lines() > FILE_LINES).map(|file| file.path.clone()).collect();
    let wrong = compare(&long, LONG_FILES);
    assert!(wrong.is_empty(), "\n{wrong}");
}

#[test]
fn no_function_is_longer_than_60_lines() {
    let functions = |file: &Source| -> Vec<String> {
        let long = file.functions().into_iter().filter(|(_, lines)| *lines > FUNCTION_LINES);
        long.map(|(name, _)| format!("{} {name}", file.path)).collect()
    };
    let long: BTreeSet<String> = sources().iter().flat_map(functions).collect();
    let wrong = compare(&long, LONG_FUNCTIONS);
    assert!(wrong.is_empty(), "\n{wrong}");
}

#[test]
fn no_files_of_a_crate_import_one_another_in_a_circle() {
    let found = circles::circles();
    let within =
        |circle: &BTreeSet<String>, known: &[&str]| circle.iter().all(|file| known.contains(&file.as_str()));
    let new: Vec<_> =
        found.iter().filter(|circle| !CIRCLES.iter().any(|known| within(circle, known))).collect();
    assert!(new.is_empty(), "files that import one another in a circle: {new:#?}");
    let mended: Vec<_> =
        CIRCLES.iter().filter(|known| !found.iter().any(|circle| within(circle, known))).collect();
    assert!(mended.is_empty(), "no circle any more, take it off the list: {mended:#?}");
}

#[test]
fn no_user_is_shown_a_retired_word() {
    let found: BTreeSet<String> = words::found(&sources()).into_iter().collect();
    let known: BTreeSet<String> = words::STILL.iter().map(|one| (*one).to_owned()).collect();
    let instead = |one: &str| {
        let word = one.rsplit(": ").next().unwrap_or_default();
        words::RETIRED.iter().find(|(retired, _)| *retired == word).map_or("", |(_, instead)| instead)
    };
    let new = found.difference(&known).map(|one| format!("  {one}; write: {}\n", instead(one)));
    check_against_list(new, &known, &found);
}

#[test]
fn no_identifier_contains_a_retired_word() {
    let found: BTreeSet<String> = identifiers::found().into_iter().collect();
    let known: BTreeSet<String> = identifiers::STILL.iter().map(|one| (*one).to_owned()).collect();
    let instead = |one: &str| {
        let identifier = one.rsplit(": ").next().unwrap_or_default();
        identifiers::retired_in(identifier).map_or("", |(_, instead)| instead)
    };
    let new = found.difference(&known).map(|one| format!("  {one}; write: {}\n", instead(one)));
    check_against_list(new, &known, &found);
}

#[test]
fn an_identifier_is_read_word_by_word() {
    let word = |identifier: &str| identifiers::retired_in(identifier).map(|(word, _)| word);
    assert_eq!(word("is_told_once"), Some("told"));
    assert_eq!(word("CardStanding"), Some("standing"));
    assert_eq!(word("TELLS_FROM"), Some("tells"));
    assert_eq!(word("reckoned_from"), Some("reckon"));
    assert_eq!(word("dead_reckoning"), None, "the term of navigation");
    assert_eq!(word("understands_intellect"), None);
}

/// Fails with what is wrong and not listed, and with what is listed and wrong no more.
fn check_against_list(new: impl Iterator<Item = String>, known: &BTreeSet<String>, found: &BTreeSet<String>) {
    let mended = known.difference(found).map(|one| format!("  mended, take it off the list: {one}\n"));
    let wrong: String = new.chain(mended).collect();
    assert!(wrong.is_empty(), "\n{wrong}");
}
