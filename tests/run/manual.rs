//! The commands of the manual work as they are printed: a stranger types them, not us.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use crate::lab::{Lab, skipped};

/// The root of the repository.
fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Every page that a reader of the manual is led to for running cells.
const PAGES: [&str; 5] = [
    "README.md",
    "workcells/README.md",
    "workcells/teachmover/README.md",
    "workcells/puma/README.md",
    "workcells/light-stripe/README.md",
];

/// Cells that wait for people and for devices on this computer's ports: their plan is shown, and it ends with 4 (needs an operator).
const NEEDS_AN_OPERATOR: [&str; 2] = ["cell-hardware.yaml", "cell-taught.yaml"];

/// The arguments of each `plumb run workcells/...` that a page prints, in a block or within a sentence.
fn commands(page: &str) -> Vec<Vec<String>> {
    let text = fs::read_to_string(root().join(page)).unwrap();
    text.match_indices("plumb run workcells/").map(|(at, _)| arguments(&text[at..])).collect()
}

/// What is between `plumb` and the end of the command: a back quote, a comment, or the end of the line.
fn arguments(text: &str) -> Vec<String> {
    let end = text.find(['`', '#', '\n']).unwrap_or(text.len());
    let words = text[..end].split_whitespace().skip(1);
    words.map(|word| word.trim_end_matches(['.', ',', ';', ')', ':']).to_owned()).collect()
}

#[test]
fn every_cell_and_procedure_that_the_manual_runs_is_there() {
    let mut seen = BTreeSet::new();
    for page in PAGES {
        for mut command in commands(page) {
            // A word in capitals means what the reader chooses; the tables of procedures are held by the test below.
            if command
                .iter()
                .any(|word| word.chars().all(|letter| letter.is_ascii_uppercase() || letter == '|'))
            {
                continue;
            }
            let cell = command[1].strip_prefix("workcells/").unwrap().to_owned();
            let (folder, file) = cell.split_once('/').unwrap();
            command[1] = file.to_owned();
            command.retain(|word| word != "--json" && word != "--dry-run");
            if let Some(at) = command.iter().position(|word| word == "--answers") {
                command.drain(at..at + 2);
            }
            command.push("--dry-run".to_owned());
            if !seen.insert((folder.to_owned(), command.clone())) {
                continue;
            }
            let lab = Lab::of(folder);
            let plan = lab.plumb(&command.iter().map(String::as_str).collect::<Vec<_>>());
            let allowed: &[i32] = if command.iter().any(|word| NEEDS_AN_OPERATOR.contains(&word.as_str())) {
                &[0, 4]
            } else {
                &[0]
            };
            assert!(allowed.contains(&plan.code()), "{page}: plumb {}\n{}", command.join(" "), plan.all());
        }
    }
    assert!(seen.len() > 5, "the manual's commands are found: {seen:?}");
}

/// The page of the TeachMover promises `plumb run workcells/teachmover/cell.yaml PROCEDURE` for each row of its table, unless the row names another cell.
#[test]
fn every_procedure_in_the_teachmovers_table_runs_in_the_cell_it_names() {
    let text = fs::read_to_string(root().join("workcells/teachmover/README.md")).unwrap();
    let section = text.split_once("## Procedures").map(|(_, rest)| rest).unwrap();
    let section = section.split("\n## ").next().unwrap();
    let rows: Vec<&str> = section.lines().filter(|line| line.starts_with("| `")).collect();
    assert!(rows.len() > 8, "{section}");
    let lab = Lab::new();
    for row in rows {
        let procedure = row.split('`').nth(1).unwrap();
        let cell = row.split_once("(`cell").and_then(|(_, rest)| rest.split('`').next()).unwrap_or(".yaml");
        let cell = format!("cell{cell}");
        let plan = lab.plumb(&["run", &cell, procedure, "--dry-run"]);
        let allowed: &[i32] = if NEEDS_AN_OPERATOR.contains(&cell.as_str()) { &[0, 4] } else { &[0] };
        assert!(allowed.contains(&plan.code()), "{procedure} in {cell}: {}", plan.all());
    }
}

/// Words as a shell splits them; single quotes alone.
fn words(line: &str) -> Vec<String> {
    let (mut words, mut quoted) = (vec![String::new()], false);
    for letter in line.chars() {
        match (letter, quoted, words.last_mut()) {
            ('\'', _, _) => quoted = !quoted,
            (' ', false, _) => words.push(String::new()),
            (letter, _, Some(word)) => word.push(letter),
            (_, _, None) => {}
        }
    }
    words
}

#[test]
fn every_command_and_service_of_many_cells_can_be_started_as_it_is() {
    let text = fs::read_to_string(root().join("workcells/many-cells.md")).unwrap();
    let typed = text.lines().filter_map(|line| line.strip_prefix("$ plumb "));
    let services = text.lines().filter_map(|line| line.strip_prefix("ExecStart=/usr/bin/plumb "));
    let lines: Vec<&str> = typed.chain(services).collect();
    assert!(lines.len() > 15, "{lines:?}");
    for line in lines {
        let line = format!("plumb {}", line.trim_end_matches(" &"));
        if let Err(error) = plumb::command().try_get_matches_from(words(&line)) {
            panic!("{line}\n{error}");
        }
    }
}

/// The units as systemd itself reads them, where it is installed.
#[test]
fn the_units_of_many_cells_are_sound() {
    let text = fs::read_to_string(root().join("workcells/many-cells.md")).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let mut units = Vec::new();
    for block in text.split("```ini\n").skip(1) {
        let unit = block.split("```").next().unwrap();
        let name = unit.lines().next().unwrap().rsplit('/').next().unwrap();
        // systemd looks whether the program is there: on this computer it may be elsewhere.
        fs::write(folder.path().join(name), unit.replace("/usr/bin/plumb", "/usr/bin/env plumb")).unwrap();
        units.push(folder.path().join(name));
    }
    assert_eq!(units.len(), 3);
    let verified = std::process::Command::new("systemd-analyze")
        .args(["verify", "--user"])
        .args(&units)
        .env("XDG_RUNTIME_DIR", folder.path())
        .output();
    let Ok(verified) = verified else {
        skipped("systemd is not installed");
        return;
    };
    let output = String::from_utf8_lossy(&verified.stderr).into_owned();
    let about_units: Vec<&str> = output.lines().filter(|line| line.contains("plumb-")).collect();
    assert_eq!(about_units, Vec::<&str>::new(), "{output}");
}
