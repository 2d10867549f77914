//! The driver and the emulated controller are two readings of the same facts. If they shared code or text, one misunderstanding would be both's,
//! and every test of the one against the other would pass.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Lines shorter than this are alike by chance: closing braces, short signatures.
const LONG: usize = 45;

fn sources(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(sources(&path));
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
    found
}

/// The long lines of code and comment, without their tests: a test may well say the same of both.
fn long_lines(folder: &Path) -> BTreeSet<String> {
    let files = sources(folder);
    assert!(files.len() > 5, "{} holds too little to compare", folder.display());
    let lines = files.iter().flat_map(|file| {
        let text = std::fs::read_to_string(file).unwrap();
        let code: Vec<String> = text
            .lines()
            .take_while(|line| *line != "#[cfg(test)]")
            .map(|line| line.trim().to_owned())
            .collect();
        code
    });
    lines.filter(|line| line.len() >= LONG && !line.starts_with("use ")).collect()
}

#[test]
fn driver_and_emulator_share_no_text() {
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let driver = long_lines(&crates.join("puma/src"));
    let emulator = long_lines(&crates.join("simulated/src/emulate/val2"));
    let shared: Vec<&String> = driver.intersection(&emulator).collect();
    assert!(shared.is_empty(), "{shared:#?}");
}

#[test]
fn neither_names_the_other_where_it_is_built() {
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    for (folder, other) in [("puma/src", "plumb_simulated"), ("simulated/src", "plumb_puma")] {
        for file in sources(&crates.join(folder)) {
            let text = std::fs::read_to_string(&file).unwrap();
            assert!(!text.contains(other), "{} names {other}", file.display());
        }
    }
}
