//! Bad files, each with the message it gives beside it: `bad/NAME.yaml` and `bad/NAME.txt`.
//!
//! A case is named after what it replaces: `cell-...`, `procedure-...`, `answers-...`; the other files are those of `bad/good`.
//! To accept new messages, run with `ACCEPT=1` and read what changed.

#![expect(clippy::expect_used, reason = "a failed expectation is how a test fails")]

use std::fs;
use std::path::{Path, PathBuf};

use plumb_cell::expression::Calculator;
use plumb_cell::{check_file, kind_of_file};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/bad")
}

/// What checking says of the cell in which `case` replaces one file.
fn message_of(case: &Path) -> String {
    let cell_folder = tempfile::tempdir().expect("a directory");
    for good in fs::read_dir(folder().join("good")).expect("the good files") {
        let good = good.expect("a good file").path();
        fs::copy(&good, cell_folder.path().join(good.file_name().expect("a name"))).expect("copied");
    }
    let name = case.file_stem().and_then(|name| name.to_str()).expect("a name");
    let role = name.split('-').next().unwrap_or(name);
    let stand_in = cell_folder.path().join(format!("{role}.yaml"));
    fs::copy(case, &stand_in).expect("copied");
    let checked_file = if role == "unknown" { stand_in } else { cell_folder.path().join("cell.yaml") };
    let calculator = Calculator::new();
    let result = kind_of_file(&checked_file)
        .map_err(|problems| vec![problems])
        .and_then(|kind| check_file(&checked_file, kind, &calculator));
    let text = match result {
        Ok(checked) => format!("{} is in order\n", checked.what),
        Err(problems) => problems.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"),
    };
    text.replace(&format!("{}/", cell_folder.path().display()), "")
}

#[test]
fn every_bad_file_gives_the_message_beside_it() {
    let mut cases: Vec<PathBuf> = fs::read_dir(folder())
        .expect("the cases")
        .map(|entry| entry.expect("a case").path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "yaml"))
        .collect();
    cases.sort();
    assert!(cases.len() > 10, "the cases are there");
    let mut wrong = Vec::new();
    for case in &cases {
        let found = message_of(case);
        let expected_file = case.with_extension("txt");
        if std::env::var_os("ACCEPT").is_some() {
            fs::write(&expected_file, &found).expect("written");
        }
        let expected = fs::read_to_string(&expected_file).unwrap_or_default();
        if found != expected {
            wrong.push(format!("--- {}\nexpected:\n{expected}\nfound:\n{found}", case.display()));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn the_files_beside_the_cases_are_good() {
    assert_eq!(message_of(&folder().join("good/answers.yaml")), "cell `example` is in order\n");
}

#[test]
fn the_cells_that_come_with_the_program_are_in_order() {
    let workcells = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../workcells");
    let calculator = Calculator::new();
    for cell in [
        "teachmover/cell.yaml",
        "teachmover/cell-backlash.yaml",
        "teachmover/cell-paper.yaml",
        "teachmover/cell-serial.yaml",
        "teachmover/cell-hardware.yaml",
        "teachmover/cell-taught.yaml",
        "puma/cell.yaml",
        "puma/cell-serial.yaml",
    ] {
        let file = workcells.join(cell);
        let result =
            kind_of_file(&file).map_err(|p| vec![p]).and_then(|kind| check_file(&file, kind, &calculator));
        let message =
            result.err().map(|problems| problems.iter().map(ToString::to_string).collect::<String>());
        assert_eq!(message, None);
    }
}
