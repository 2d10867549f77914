//! From text to tree, within limits.

use std::path::Path;

use serde_yaml::options::DuplicateKeyPolicy;
use serde_yaml::{Error, Options};

use crate::{FileProblems, Key, Node, NodeValue, Problem, Problems, Span};

/// Larger files are not written by hand; those that a program writes (a sealed world) have fewer values, not fewer bytes.
const MOST_BYTES: usize = 3 << 20;
/// Values of all kinds in one file.
const MOST_NODES: usize = 20_000;
/// Characters of a key.
const LONGEST_KEY: usize = 200;
/// Lists and maps inside each other.
const MOST_DEPTH: usize = 40;
/// Keys given twice in one file that are reported.
const MOST_DUPLICATES: usize = 50;
/// Is in the text in place of a key that was given twice: no key that a person types begins with it.
const MASK: char = '\u{e000}';

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
    let mut root = read_masking_duplicates(text, problems).map_err(|error| fail(describe(&error, text)))?;
    if root.value == NodeValue::Null {
        return Err(FileProblems::whole_file(
            file,
            "the file is empty",
            "see workcells/ for files to begin with",
        ));
    }
    if let Some(key) = longest_key(&root).filter(|key| key.name.chars().count() > LONGEST_KEY) {
        let message = "this key is longer than any name".to_owned();
        let help = Some(format!("keys have at most {LONGEST_KEY} characters"));
        return Err(fail(Problem { span: Some(key.span), message, help }));
    }
    let lines: Vec<&str> = text.lines().collect();
    keep_written(&mut root, &lines);
    Ok(root)
}

/// Reads the tree; a key that its map holds already is reported, and left out with its value.
fn read_masking_duplicates(text: &str, problems: &Problems) -> Result<Node, Error> {
    let mut masked: Option<String> = None;
    for _ in 0..MOST_DUPLICATES {
        let error = match read(masked.as_deref().unwrap_or(text), DuplicateKeyPolicy::Error) {
            Ok(mut root) => {
                if masked.is_some() {
                    drop_masked(&mut root);
                }
                return Ok(root);
            }
            Err(error) => error,
        };
        let Error::DuplicateMappingKey { .. } = error.without_snippet() else { return Err(error) };
        let problem = describe(&error, text);
        let span = problem.span;
        problems.push(problem);
        match span.and_then(|span| mask(masked.as_deref().unwrap_or(text), span)) {
            Some(text) => masked = Some(text),
            None => break,
        }
    }
    let mut root = read(masked.as_deref().unwrap_or(text), DuplicateKeyPolicy::FirstWins)?;
    drop_masked(&mut root);
    Ok(root)
}

fn read(text: &str, duplicate_keys: DuplicateKeyPolicy) -> Result<Node, Error> {
    let options: Options = serde_yaml::options! {
        budget: serde_yaml::budget! {
            max_nodes: MOST_NODES,
            max_events: 4 * MOST_NODES,
            max_depth: MOST_DEPTH,
            // One more than is read, so that the second is reported as what it is.
            max_documents: 2,
            max_aliases: 1000,
        },
        duplicate_keys: duplicate_keys,
        strict_booleans: true,
        with_snippet: false,
    };
    serde_yaml::from_str_with_options(text, options)
}

/// The text with the key at `span` replaced by one of the same length that no map holds; None where that is not possible.
fn mask(text: &str, span: Span) -> Option<String> {
    let mut lines: Vec<String> = text.split('\n').map(str::to_owned).collect();
    let line = lines.get_mut(span.line.checked_sub(1)?)?;
    let mut letters: Vec<char> = line.chars().collect();
    let key = letters.get_mut(span.column.checked_sub(1)?..span.column - 1 + span.length)?;
    let (first, rest) = key.split_first_mut()?;
    *first = MASK;
    // Another letter for each line and column, so that no two masks in one map are the same key twice.
    let number = span.line * 131 + span.column;
    match rest.first_mut() {
        Some(second) => *second = char::from_u32(0xe001 + u32::try_from(number % 6000).ok()?)?,
        None => *first = char::from_u32(0xe000 + u32::try_from(number % 6000).ok()?)?,
    }
    rest.iter_mut().skip(1).for_each(|letter| *letter = MASK);
    *line = letters.into_iter().collect();
    Some(lines.join("\n"))
}

fn is_masked(key: &Key) -> bool {
    key.name.chars().next().is_some_and(|first| ('\u{e000}'..='\u{f8ff}').contains(&first))
}

fn drop_masked(node: &mut Node) {
    match &mut node.value {
        NodeValue::List(items) => items.iter_mut().for_each(drop_masked),
        NodeValue::Map(entries) => {
            entries.retain(|(key, _)| !is_masked(key));
            entries.iter_mut().for_each(|(_, node)| drop_masked(node));
        }
        _ => {}
    }
}

/// Keeps numbers, `true` and `false` as they were typed.
fn keep_written(node: &mut Node, lines: &[&str]) {
    match &mut node.value {
        NodeValue::List(items) => items.iter_mut().for_each(|item| keep_written(item, lines)),
        NodeValue::Map(entries) => entries.iter_mut().for_each(|(_, node)| keep_written(node, lines)),
        NodeValue::Number(_) | NodeValue::Bool(_) => node.written = written(node.span, lines),
        NodeValue::Null | NodeValue::Text(_) => {}
    }
}

fn written(span: Span, lines: &[&str]) -> Option<Box<str>> {
    let line = lines.get(span.line.checked_sub(1)?)?;
    let typed: String = line.chars().skip(span.column.checked_sub(1)?).take(span.length).collect();
    let typed = typed.trim();
    // An alias refers to a value that was typed elsewhere.
    (!typed.is_empty() && !typed.starts_with(['*', '&', '!'])).then(|| typed.into())
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

fn describe(error: &Error, text: &str) -> Problem {
    let error = error.without_snippet();
    let span = error.location().filter(|at| at.line() > 0).map(|at| {
        let number = |value: u64| usize::try_from(value).unwrap_or(usize::MAX);
        Span { line: number(at.line()), column: number(at.column()), length: number(at.span().len()) }
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
            message if message.starts_with("budget breached") || message.contains("recursion limit") => {
                too_much()
            }
            message if message.contains("tabs disallowed") || message.contains("found a tab") => {
                ("there is a tab".to_owned(), "write spaces".to_owned())
            }
            message if message.starts_with("non-finite float") => {
                ("this is not a finite number".to_owned(), "write a number".to_owned())
            }
            message => (message, String::new()),
        },
    };
    let span = span.map(|span| within(span, text));
    Problem { span, message, help: Some(help).filter(|help| !help.is_empty()) }
}

/// The parser's message without the position it adds at the end and without advice for programmers.
fn clean(message: &str) -> String {
    let first = message.lines().next().unwrap_or_default();
    let first = first.split_once(": line ").map_or(first, |(reason, _)| reason);
    let first = first.split(" at line ").next().unwrap_or(first);
    let first = first.split(", set DuplicateKeyPolicy").next().unwrap_or(first);
    first.trim_start_matches("error: ").to_owned()
}

/// The end of the text is shown at the end of its last line.
fn within(span: Span, text: &str) -> Span {
    let lines = text.lines().count().max(1);
    if span.line <= lines {
        return span;
    }
    let column = text.lines().last().map_or(1, |line| line.chars().count() + 1);
    Span { line: lines, column, length: 1 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> (Result<Node, FileProblems>, String) {
        let problems = Problems::default();
        let root = parse(Path::new("f.yaml"), text, &problems);
        let shown = problems.into_result(Path::new("f.yaml"), text).err();
        (root, shown.map(|shown| shown.to_string()).unwrap_or_default())
    }

    #[test]
    fn every_key_that_is_given_twice_is_reported_and_the_first_counts() {
        let (root, shown) = read("a: 1\nb: 2\na: 3\n\"b\": 4\na: 5\nc: {d: 1, d: 2}\n");
        let root = root.expect("a tree");
        assert_eq!(root.to_json(), serde_json::json!({"a": 1, "b": 2, "c": {"d": 1}}));
        for expected in
            ["f.yaml:3:1: the key `a` is given twice", "f.yaml:4:1: the key `b`", "f.yaml:5:1", "f.yaml:6:11"]
        {
            assert!(shown.contains(expected), "{expected}: {shown}");
        }
    }

    #[test]
    fn text_that_is_no_yaml_says_where_in_words_of_the_file() {
        for (text, message) in [
            ("a: [1, 2\nb: 3\n", "f.yaml:"),
            ("a: 1\n\tb: 2\n", "there is a tab"),
            ("a: 1\n---\nb: 2\n", "a second document begins here"),
            ("", "the file is empty"),
            ("# nothing\n", "the file is empty"),
        ] {
            let shown = read(text).0.expect_err("no tree").to_string();
            assert!(shown.contains(message), "{shown}");
            for word in ["Policy", "Options", "udget", "breached", "error:"] {
                assert!(!shown.contains(word), "{shown}");
            }
        }
    }

    #[test]
    fn what_is_too_much_says_the_limits() {
        let deep = format!("a: {}", "[".repeat(100_000));
        let wide = format!("a: [{}]", "1,".repeat(30_000));
        let long = format!("{}: 1", "k".repeat(300));
        for (text, message) in
            [(deep, "40 levels deep"), (wide, "at most 20000 values"), (long, "at most 200 characters")]
        {
            let shown = read(&text).0.expect_err("too much").to_string();
            assert!(shown.contains(message), "{shown}");
        }
    }

    #[test]
    fn numbers_keep_how_they_were_typed() {
        let (root, _) = read("seed: 18446744073709551615\nversion: 0.10\n");
        let NodeValue::Map(entries) = root.expect("a tree").value else { unreachable!("a map") };
        let written: Vec<_> = entries.iter().map(|(_, node)| node.written.as_deref()).collect();
        assert_eq!(written, [Some("18446744073709551615"), Some("0.10")]);
    }
}
