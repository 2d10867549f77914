//! The source files of the repository as tokens with their lines.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::str::FromStr as _;

use proc_macro2::{Delimiter, TokenStream, TokenTree};

/// A token: an identifier, a punctuation mark, a bracket, or a literal (whose text is left out), and its line from 1.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Token {
    pub(crate) text: String,
    pub(crate) line: usize,
}

/// A source file without what is under `#[cfg(test)]`.
#[derive(Debug)]
pub(crate) struct Source {
    /// From the root of the repository.
    pub(crate) path: String,
    pub(crate) tokens: Vec<Token>,
    all_lines: usize,
    test_lines: BTreeSet<usize>,
}

/// The root of the repository.
pub(crate) fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").canonicalize().unwrap()
}

/// The folders below the root that hold crates; `tests/studies` among the crates, the rest of `tests` not.
const FOLDERS: [&str; 5] = ["core", "plugins", "tui", "tests/studies", "xtask"];

/// Every source file of the product and the studies.
pub(crate) fn sources() -> Vec<Source> {
    let mut paths = Vec::new();
    FOLDERS.iter().for_each(|folder| collect(&root().join(folder), &mut paths));
    let sources = paths.iter().map(|path| Source::read(path));
    sources.filter(|source| !source.is_test()).collect()
}

fn collect(folder: &Path, paths: &mut Vec<PathBuf>) {
    const LEFT_OUT: [&str; 4] = ["target", "tests", "examples", "benches"];
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if path.is_dir() && !LEFT_OUT.contains(&name.as_str()) {
            collect(&path, paths);
        } else if path.extension().is_some_and(|ending| ending == "rs") {
            paths.push(path);
        }
    }
}

impl Source {
    /// Reads a file.
    pub(crate) fn read(path: &Path) -> Self {
        let text = fs::read_to_string(path).unwrap();
        let stream =
            TokenStream::from_str(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        let (mut tokens, mut test_lines) = (Vec::new(), BTreeSet::new());
        flatten(stream, &mut tokens, &mut test_lines);
        let path = path.strip_prefix(root()).unwrap_or(path).display().to_string();
        Self { path, tokens, all_lines: text.lines().count(), test_lines }
    }

    /// Its lines without those of its tests.
    pub(crate) fn lines(&self) -> usize {
        self.all_lines - self.test_lines.len()
    }

    /// A file of tests alone.
    fn is_test(&self) -> bool {
        let name = self.path.rsplit('/').next().unwrap_or_default();
        let of_tests = ["tests.rs", "test.rs", "testing.rs"].contains(&name);
        of_tests || name.ends_with("_test.rs") || name.ends_with("_tests.rs") || self.tokens.is_empty()
    }

    /// Its functions with a body: name and lines, from `fn` to the closing brace.
    pub(crate) fn functions(&self) -> Vec<(String, usize)> {
        let mut found = Vec::new();
        for (at, token) in self.tokens.iter().enumerate() {
            let Some(name) = self.tokens.get(at + 1).filter(|_| token.text == "fn") else { continue };
            // Not a name: the type of a function, as in `fn(f64) -> f64`.
            if name.text == "(" {
                continue;
            }
            if let Some(end) = self.end_of_body(at + 2) {
                found.push((name.text.clone(), end + 1 - token.line));
            }
        }
        found
    }

    /// The line of the brace that closes the body; none of a function without one.
    fn end_of_body(&self, from: usize) -> Option<usize> {
        let mut depth = 0_usize;
        let mut in_body = false;
        for token in self.tokens.get(from..)? {
            match token.text.as_str() {
                ";" if depth == 0 => return None,
                "(" | "[" => depth += 1,
                "{" => {
                    in_body |= depth == 0;
                    depth += 1;
                }
                ")" | "]" | "}" => depth = depth.checked_sub(1)?,
                _ => {}
            }
            if in_body && depth == 0 {
                return Some(token.line);
            }
        }
        None
    }
}

/// The tokens of a stream one after the other, without items under `#[cfg(test)]`, whose lines are collected.
fn flatten(stream: TokenStream, tokens: &mut Vec<Token>, test_lines: &mut BTreeSet<usize>) {
    let mut trees = stream.into_iter().peekable();
    while let Some(tree) = trees.next() {
        let line = tree.span().start().line;
        if let (TokenTree::Punct(mark), Some(TokenTree::Group(attribute))) = (&tree, trees.peek())
            && mark.as_char() == '#'
            && is_cfg_test(&attribute.stream())
        {
            // The item ends with its body or with a semicolon.
            let mut last = line;
            for tree in trees.by_ref() {
                last = tree.span().end().line;
                let ends = match &tree {
                    TokenTree::Group(group) => group.delimiter() == Delimiter::Brace,
                    TokenTree::Punct(mark) => mark.as_char() == ';',
                    _ => false,
                };
                if ends {
                    break;
                }
            }
            test_lines.extend(line..=last);
            continue;
        }
        let token = |text: String, line: usize| Token { text, line };
        match tree {
            TokenTree::Group(group) => {
                let (open, close) = match group.delimiter() {
                    Delimiter::Parenthesis => ("(", ")"),
                    Delimiter::Bracket => ("[", "]"),
                    Delimiter::Brace => ("{", "}"),
                    Delimiter::None => ("", ""),
                };
                tokens.push(token(open.to_owned(), line));
                flatten(group.stream(), tokens, test_lines);
                tokens.push(token(close.to_owned(), group.span_close().end().line));
            }
            TokenTree::Ident(word) => tokens.push(token(word.to_string(), line)),
            TokenTree::Punct(mark) => tokens.push(token(mark.as_char().to_string(), line)),
            TokenTree::Literal(literal) => {
                // The text of a string counts for `#[path = "..."]` alone.
                tokens.push(token(literal.to_string(), line));
            }
        }
    }
}

/// Whether an attribute is `cfg(test)` or `cfg(all(test, ..))`.
fn is_cfg_test(attribute: &TokenStream) -> bool {
    let text: String = attribute.to_string().split_whitespace().collect();
    text.starts_with("cfg(test") || text.starts_with("cfg(all(test")
}
