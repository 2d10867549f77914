//! One procedure file, two ways to the same arm: the simulated robot, and the serial driver with an emulated controller.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

use serde_json::Value;

/// Half-steps for a degree of the joints that an initialization finds.
const HALF_STEPS_PER_DEGREE: [(&str, f64); 3] =
    [("waist", 7072.0 / 360.0), ("shoulder", 7072.0 / 360.0), ("elbow", 4158.0 / 360.0)];

/// Copies the folder of a user's cells, so that the test has cells of its own.
fn copy_cells(to: &Path) {
    let from = Path::new(env!("CARGO_MANIFEST_DIR")).join("../workcells/teachmover");
    let mut folders = vec![(from, to.to_owned())];
    while let Some((from, to)) = folders.pop() {
        std::fs::create_dir_all(&to).unwrap();
        for entry in std::fs::read_dir(from).unwrap() {
            let entry = entry.unwrap().path();
            let copy = to.join(entry.file_name().unwrap());
            if entry.is_dir() {
                folders.push((entry, copy));
            } else {
                std::fs::copy(&entry, &copy).unwrap();
            }
        }
    }
}

/// Runs the initialization of a cell and gives the zeros it put in force, deg.
fn zeros_found(cells: &Path, cell: &str) -> BTreeMap<String, f64> {
    let output = Command::new(env!("CARGO_BIN_EXE_plumb"))
        .args(["run", cell, "--headless", "--json", "--record", &format!("{cell}.record")])
        .current_dir(cells)
        .output()
        .unwrap();
    let printed = String::from_utf8_lossy(&output.stderr);
    let events = String::from_utf8_lossy(&output.stdout);
    assert_eq!(output.status.code(), Some(0), "{cell}: {printed}\n{}", last_lines(&events));
    let events = events.lines().map(|line| serde_json::from_str::<Value>(line).unwrap());
    let applied = events.filter(|event| event["event"] == "correction_applied");
    let zero = |event: Value| {
        let correction = &event["correction"];
        Some((correction["place"].as_str()?.to_owned(), correction["new"].as_f64()?))
    };
    applied.filter_map(zero).collect()
}

fn last_lines(text: &str) -> String {
    let lines: Vec<&str> = text.lines().rev().take(5).collect();
    lines.into_iter().rev().collect::<Vec<_>>().join("\n")
}

#[test]
fn the_serial_driver_finds_the_zeros_that_the_simulated_robot_finds() {
    let folder = tempfile::tempdir().unwrap();
    copy_cells(folder.path());
    let simulated = zeros_found(folder.path(), "cell.yaml");
    let serial = zeros_found(folder.path(), "cell-serial.yaml");
    for (joint, half_steps_per_degree) in HALF_STEPS_PER_DEGREE {
        let apart = (simulated[joint] - serial[joint]).abs() * half_steps_per_degree;
        assert!(apart <= 1.0, "{joint}: {} and {} deg", simulated[joint], serial[joint]);
    }
}
