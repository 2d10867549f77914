//! Words of a private dialect in identifiers, tests included.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::str::FromStr as _;

use proc_macro2::{TokenStream, TokenTree};

use crate::source::root;

/// A word that no identifier contains, and what is written in its place. `reckon` also covers the words that begin with it.
pub(crate) const RETIRED: &[(&str, &str)] = &[
    ("told", "what it is: reported, message, output, expected"),
    ("tell", "report, describe, send or distinguish"),
    ("tells", "reports, determines or distinguishes"),
    ("telling", "reporting"),
    ("stands", "is, is_at or at_rest"),
    ("stood", "was, or stopped"),
    ("standing", "status or pose"),
    ("reckon", "count, compute or use"),
    ("survey", "context of candidates"),
    ("passport", "dataset summary"),
    ("posture", "link frames or configuration"),
    ("stance", "state of the arm"),
    ("complaint", "error or message"),
    ("camps", "clusters"),
    ("drawl", "delay of replies"),
    ("knob", "DH parameter"),
    ("dice", "rng"),
    ("contender", "fitted candidate"),
    ("contenders", "fitted candidates"),
    ("strangers", "unlisted mechanisms"),
    ("nameless", "unnamed"),
    ("grave", "severity"),
    ("outlook", "predictions, or evidence at known ratios"),
];

/// Identifiers that still contain a retired word, as `file: identifier`. This list may only shrink.
pub(crate) const STILL: &[&str] = &[];

/// The folders below the root that hold Rust sources.
const FOLDERS: [&str; 5] = ["core", "plugins", "tui", "tests", "xtask"];

/// Where an identifier contains a retired word, as `file: identifier`.
pub(crate) fn found() -> Vec<String> {
    let mut paths = Vec::new();
    FOLDERS.iter().for_each(|folder| collect(&root().join(folder), &mut paths));
    let mut found = Vec::new();
    for path in paths {
        let text = fs::read_to_string(&path).unwrap();
        let stream =
            TokenStream::from_str(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        let mut identifiers = BTreeSet::new();
        gather(stream, &mut identifiers);
        let shown = path.strip_prefix(root()).unwrap_or(&path).display().to_string();
        let wrong = identifiers.into_iter().filter(|identifier| retired_in(identifier).is_some());
        found.extend(wrong.map(|identifier| format!("{shown}: {identifier}")));
    }
    found
}

/// The retired word of an identifier in snake case or camel case, and what is written in its place. Dead reckoning is the term of navigation.
pub(crate) fn retired_in(identifier: &str) -> Option<(&'static str, &'static str)> {
    let words = words_of(identifier);
    let is_retired = |at: usize, retired: &str| match retired {
        "reckon" => words[at].starts_with(retired) && (at == 0 || words[at - 1] != "dead"),
        _ => words[at] == retired,
    };
    RETIRED.iter().copied().find(|(retired, _)| (0..words.len()).any(|at| is_retired(at, retired)))
}

/// The words of an identifier in lower case.
fn words_of(identifier: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut after_small = false;
    for letter in identifier.chars() {
        if letter == '_' || (letter.is_uppercase() && after_small) {
            words.push(String::new());
        }
        if letter != '_'
            && let Some(word) = words.last_mut()
        {
            word.extend(letter.to_lowercase());
        }
        after_small = letter.is_lowercase() || letter.is_ascii_digit();
    }
    words
}

fn gather(stream: TokenStream, identifiers: &mut BTreeSet<String>) {
    for tree in stream {
        match tree {
            TokenTree::Group(group) => gather(group.stream(), identifiers),
            TokenTree::Ident(identifier) => drop(identifiers.insert(identifier.to_string())),
            TokenTree::Punct(_) | TokenTree::Literal(_) => {}
        }
    }
}

/// Rust files below a folder.
fn collect(folder: &Path, paths: &mut Vec<PathBuf>) {
    if folder.ends_with("target") {
        return;
    }
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            collect(&path, paths);
        } else if path.extension().is_some_and(|ending| ending == "rs") {
            paths.push(path);
        }
    }
}
