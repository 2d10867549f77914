//! Bad files of every kind, each with the message that `plumb check` gives beside it: `bad_files/KIND/SLIP.yaml` and `.txt`.
//!
//! The same slip put into each of the nine kinds gives one mistake in one style: file, line, column, the line with the word underlined, and what
//! would be right. To accept new messages, run with `ACCEPT=1` and read what changed.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

const KINDS: [&str; 9] =
    ["cell", "procedure", "answers", "model", "world", "rig", "scene", "manifest", "study"];

const SLIPS: [&str; 7] =
    ["unknown-key", "wrong-type", "missing-key", "duplicate-key", "wrong-unit", "out-of-range", "not-yaml"];

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/bad_files")
}

/// The exit code of `plumb check FILE` in a folder, and what it prints of mistakes.
fn check(folder: &Path, file: &str) -> (Option<i32>, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_plumb"));
    let done = command.args(["check", file]).current_dir(folder).env("NO_COLOR", "1").output().unwrap();
    (done.status.code(), String::from_utf8_lossy(&done.stderr).trim_end().to_owned() + "\n")
}

fn cases() -> Vec<PathBuf> {
    let mut cases: Vec<PathBuf> = KINDS
        .iter()
        .chain(&["any"])
        .flat_map(|kind| fs::read_dir(folder().join(kind)).unwrap())
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "yaml"))
        .filter(|path| path.file_stem().is_some_and(|name| name != "good"))
        .collect();
    cases.sort();
    cases
}

#[test]
fn every_bad_file_gives_the_message_beside_it() {
    let mut wrong = Vec::new();
    for case in cases() {
        let file = case.file_name().unwrap().to_str().unwrap();
        let (code, found) = check(case.parent().unwrap(), file);
        let expected_file = case.with_extension("txt");
        if std::env::var_os("ACCEPT").is_some() {
            fs::write(&expected_file, &found).unwrap();
        }
        let expected = fs::read_to_string(&expected_file).unwrap_or_default();
        if found != expected || code != Some(2) {
            wrong.push(format!("--- {}\nexpected:\n{expected}\nfound:\n{found}", case.display()));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// How many mistakes a message lists, each with its line and a mark under the word.
fn mistakes(file: &str, message: &str) -> usize {
    let lines: Vec<&str> = message.lines().collect();
    let heads = lines.iter().enumerate().filter(|(_, line)| line.starts_with(file));
    heads
        .map(|(index, head)| {
            let position = head.strip_prefix(&format!("{file}:")).unwrap_or_default();
            let mut numbers = position.splitn(3, ':');
            let mut number = || numbers.next().is_some_and(|number| number.parse::<usize>().is_ok());
            assert!(number() && number(), "no line and column: {head}");
            assert!(lines.get(index + 1).is_some_and(|line| line.contains(" | ")), "no line: {message}");
            assert!(lines.get(index + 2).is_some_and(|line| line.ends_with('^')), "no mark: {message}");
        })
        .count()
}

#[test]
fn one_slip_is_one_mistake_in_the_same_style_whatever_the_kind() {
    for kind in KINDS {
        for (slip, count) in SLIPS.map(|slip| (slip, 1)).into_iter().chain([("three-slips", 3)]) {
            let message = fs::read_to_string(folder().join(kind).join(format!("{slip}.txt"))).unwrap();
            assert_eq!(mistakes(&format!("{slip}.yaml"), &message), count, "{kind} {slip}: {message}");
        }
        let unknown = fs::read_to_string(folder().join(kind).join("unknown-key.txt")).unwrap();
        assert!(unknown.contains("unknown key `") && unknown.contains("did you mean `"), "{unknown}");
    }
}

#[test]
fn the_files_the_slips_were_put_into_are_good() {
    // A cell is checked with its plugins, and a study's cell is not here: those that are shipped are checked elsewhere.
    for kind in KINDS.iter().filter(|kind| **kind != "cell") {
        let (code, output) = check(&folder().join(kind), "good.yaml");
        assert_eq!(code, Some(0), "{kind}: {output}");
    }
}

#[test]
fn a_file_too_large_is_refused_before_it_is_read() {
    let directory = tempfile::tempdir().unwrap();
    for kind in KINDS {
        let good = fs::read_to_string(folder().join(kind).join("good.yaml")).unwrap();
        fs::write(directory.path().join("large.yaml"), good + &"# on and on\n".repeat(300_000)).unwrap();
        let (code, output) = check(directory.path(), "large.yaml");
        assert_eq!(code, Some(2), "{output}");
        assert!(output.starts_with("large.yaml: it has 3.") && output.contains("at most 3 MiB"), "{output}");
    }
}
