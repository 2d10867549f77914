//! The driver and the emulated controller are two readings of the same facts. If they shared code or text, one misunderstanding would be both's,
//! and every test of the one against the other would pass.

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

/// The long lines of code and comment, without what the standard library words, and without their tests: a test may well say the same of both.
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
    lines
        .filter(|line| line.len() >= LONG && !line.starts_with("use ") && !line.starts_with("fn fmt("))
        .collect()
}

/// A driver's folder and crate, and the folder of the controller it drives.
const DRIVERS: [(&str, &str, &str); 5] = [
    ("dobot", "plumb_dobot", "dobot"),
    ("feetech", "plumb_feetech", "feetech"),
    ("puma", "plumb_puma", "val2"),
    ("teachmover", "plumb_teachmover", "teachmover"),
    ("universal-robots", "plumb_universal_robots", "universal_robots"),
];

fn plugins() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../plugins")
}

#[test]
fn drivers_and_emulators_share_no_text() {
    // What the emulators have in common is part of each.
    let emulators = plugins().join("simulated/src/emulate");
    for (driver, ..) in DRIVERS {
        let shared: Vec<String> = long_lines(&plugins().join(driver).join("src"))
            .intersection(&long_lines(&emulators))
            .cloned()
            .collect();
        assert!(shared.is_empty(), "{driver}: {shared:#?}");
    }
}

#[test]
fn neither_names_the_other_where_it_is_built() {
    for (driver, library, controller) in DRIVERS {
        assert!(plugins().join("simulated/src/emulate").join(controller).is_dir());
        for (folder, other) in [
            (plugins().join(driver).join("src"), "plumb_simulated"),
            (plugins().join("simulated/src"), library),
        ] {
            for file in sources(&folder) {
                let text = std::fs::read_to_string(&file).unwrap();
                assert!(!text.contains(other), "{} names {other}", file.display());
            }
        }
    }
}
