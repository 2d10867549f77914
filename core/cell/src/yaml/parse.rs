//! From text to tree, within limits.

use std::path::Path;

use serde_yaml::options::DuplicateKeyPolicy;
use serde_yaml::{Error, Options};

use super::{FileProblems, Key, Node, NodeValue, Place, Problem, Problems};

/// Larger files are not written by hand.
const MOST_BYTES: usize = 1 << 20;
/// Values of all kinds in one file.
const MOST_NODES: usize = 20_000;
/// Characters of a key.
const LONGEST_KEY: usize = 200;
/// Lists and maps inside each other.
const MOST_DEPTH: usize = 40;

/// Reads a YAML text into a tree. Keys given twice are put among `problems` and reading goes on; text that is no YAML, or beyond the
/// limits, ends it.
///
/// # Errors
/// [`FileProblems`] with the one mistake that ended the reading.
pub fn parse(file: &Path, text: &str, problems: &Problems) -> Result<Node, FileProblems> {
    let fail =
        |problem| FileProblems { file: file.to_owned(), text: text.to_owned(), problems: vec![problem] };
    if text.len() > MOST_BYTES {
        let message = format!("the file has {} bytes", text.len());
        return Err(FileProblems::whole_file(file, message, format!("at most {MOST_BYTES} are read")));
    }
    let mut policy = DuplicateKeyPolicy::Error;
    loop {
        match serde_yaml::from_str_with_options::<Node>(text, options(policy)) {
            Ok(node) if node.value == NodeValue::Null => {
                return Err(FileProblems::whole_file(
                    file,
                    "the file is empty",
                    "see workcells/ for files to begin with",
                ));
            }
            Ok(node) => {
                return match longest_key(&node) {
                    Some(key) if key.name.chars().count() > LONGEST_KEY => {
                        let message = "this key is longer than any name".to_owned();
                        let help = Some(format!("keys have at most {LONGEST_KEY} characters"));
                        Err(fail(Problem { place: Some(key.place), message, help }))
                    }
                    _ => Ok(node),
                };
            }
            Err(error) => match (error.without_snippet(), policy) {
                (Error::DuplicateMappingKey { .. }, DuplicateKeyPolicy::Error) => {
                    problems.push(describe(&error, text));
                    policy = DuplicateKeyPolicy::FirstWins;
                }
                _ => return Err(fail(describe(&error, text))),
            },
        }
    }
}

/// The longest key of a tree.
fn longest_key(node: &Node) -> Option<&Key> {
    let within: Vec<&Key> = match &node.value {
        NodeValue::List(items) => items.iter().filter_map(longest_key).collect(),
        NodeValue::Map(entries) => {
            entries.iter().flat_map(|(key, node)| std::iter::once(key).chain(longest_key(node))).collect()
        }
        _ => Vec::new(),
    };
    within.into_iter().max_by_key(|key| key.name.len())
}

fn options(duplicate_keys: DuplicateKeyPolicy) -> Options {
    serde_yaml::options! {
        budget: serde_yaml::budget! {
            max_nodes: MOST_NODES,
            max_events: 4 * MOST_NODES,
            max_depth: MOST_DEPTH,
            max_documents: 1,
            max_aliases: 1000,
        },
        duplicate_keys: duplicate_keys,
        strict_booleans: true,
        with_snippet: false,
    }
}

fn describe(error: &Error, text: &str) -> Problem {
    let error = error.without_snippet();
    let place = error.location().filter(|at| at.line() > 0).map(|at| {
        let number = |value: u64| usize::try_from(value).unwrap_or(usize::MAX);
        Place { line: number(at.line()), column: number(at.column()), length: number(at.span().len()) }
    });
    let too_much = || {
        let help = format!(
            "at most {MOST_NODES} values, {MOST_DEPTH} levels deep, in one document, aliases counted in full"
        );
        ("this is more than a file may hold".to_owned(), help)
    };
    let (message, help) = match error {
        Error::DuplicateMappingKey { key, .. } => {
            let name = key.clone().unwrap_or_default();
            (format!("the key `{name}` is given twice in one map"), "keep one of the two".to_owned())
        }
        Error::Budget { .. } => too_much(),
        Error::MultipleDocuments { .. } => {
            ("a second document begins here".to_owned(), "one document a file".to_owned())
        }
        other => match clean(&other.to_string()) {
            message if message.starts_with("budget breached") => too_much(),
            message => (message, String::new()),
        },
    };
    let place = place.map(|place| within(place, text));
    Problem { place, message, help: Some(help).filter(|help| !help.is_empty()) }
}

/// The parser's message without the place it adds at the end.
fn clean(message: &str) -> String {
    let first = message.lines().next().unwrap_or_default();
    first.split(" at line ").next().unwrap_or(first).to_owned()
}

/// The end of the text is shown at the end of its last line.
fn within(place: Place, text: &str) -> Place {
    let lines = text.lines().count().max(1);
    if place.line <= lines {
        return place;
    }
    let column = text.lines().last().map_or(1, |line| line.chars().count() + 1);
    Place { line: lines, column, length: 1 }
}
