//! Trials in the TeachMover's cell: something is hidden in its world; runs of the cell measure it with the sensor in the hand alone, the lab says what it is,
//! and the hand then comes where the model sends it.

use std::fs;
use std::path::PathBuf;
use std::process::{Command, Stdio};

use serde_json::Value;
use tempfile::TempDir;

/// Further from the floor than this factor no true error may stay.
const OF_THE_FLOOR: f64 = 1.3;

/// A cell with something hidden in it.
struct Trial {
    place: TempDir,
}

impl Trial {
    fn new(fault: &str, seed: u64) -> Self {
        let trial = Self { place: tempfile::tempdir().unwrap() };
        let (seed, cell) = (seed.to_string(), trial.path("cell"));
        let cell = cell.to_str().unwrap();
        trial.plumb(&["trial", "new", "--cell", "teachmover", "--fault", fault, "--seed", &seed, "-o", cell]);
        trial.run("find-zeros", &[]);
        trial
    }

    fn path(&self, name: &str) -> PathBuf {
        self.place.path().join(name)
    }

    fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_plumb"));
        command.args(arguments).current_dir(self.place.path()).stdin(Stdio::null());
        command.env("XDG_STATE_HOME", self.path("state")).env("NO_COLOR", "1");
        command
    }

    fn plumb(&self, arguments: &[&str]) -> String {
        let done = self.command(arguments).output().unwrap();
        let said = String::from_utf8_lossy(&done.stdout).into_owned();
        let complaint = String::from_utf8_lossy(&done.stderr);
        assert!(done.status.success(), "plumb {arguments:?}: {said}{complaint}");
        said
    }

    fn run(&self, procedure: &str, settings: &[&str]) -> String {
        let mut arguments = vec!["run", "cell/cell.yaml", procedure, "--headless"];
        arguments.extend(settings.iter().flat_map(|setting| ["--set", setting]));
        self.plumb(&arguments)
    }

    /// Measures, and adds the trigger poses to the table.
    fn measure(&self, settings: &[&str]) {
        self.run("measure-by-triggers", settings);
        let rows = self.plumb(&["show", "--table"]);
        let table = match fs::read_to_string(self.path("table.csv")) {
            Ok(before) => before + rows.split_once('\n').unwrap().1,
            Err(_) => rows,
        };
        fs::write(self.path("table.csv"), table).unwrap();
    }

    fn lab(&self, command: &str, more: &[&str]) -> Value {
        let mut arguments = vec!["model", command, "cell/trial.model.yaml"];
        arguments.extend(more);
        arguments.extend(["--data", "table.csv", "--json"]);
        serde_json::from_str(&self.plumb(&arguments)).unwrap()
    }

    /// The true error of the hand over fifty points the model sends it to, mm RMS.
    fn true_error(&self, settings: &[&str]) -> f64 {
        self.run("verify-by-points", settings);
        let shown: Value = serde_json::from_str(&self.plumb(&["show", "--json"])).unwrap();
        let steps = shown["steps"].as_array().unwrap();
        let error = steps.iter().find(|step| step["step"] == "error").unwrap();
        error["result"]["rms_mm"].as_f64().unwrap()
    }

    /// The score of a diagnosis, by the opened seal.
    fn score(&self, diagnosis: &Value) -> Value {
        fs::write(self.path("diagnosis.json"), diagnosis.to_string()).unwrap();
        let revealed = self.plumb(&["trial", "reveal", "cell", "--diagnosis", "diagnosis.json", "--json"]);
        serde_json::from_str::<Value>(&revealed).unwrap()
    }
}

/// The error of the same arm with nothing hidden, found in the same way.
fn floor(seed: u64) -> f64 {
    let trial = Trial::new("none", seed);
    trial.measure(&[]);
    let diagnosis = trial.lab("diagnose", &[]);
    assert_eq!(diagnosis["verdict"], "at_floor", "{}", diagnosis["sentence"]);
    trial.lab("accept", &[]);
    trial.true_error(&[])
}

/// What is wrong is found in the cell, and the cell then does better by it.
fn found_and_cured(fault: &str, seed: u64) {
    let trial = Trial::new(fault, seed);
    let before = trial.true_error(&[]);
    trial.measure(&[]);
    let diagnosis = trial.lab("diagnose", &[]);
    if diagnosis["verdict"] != "named" {
        let sentence = diagnosis["sentence"].as_str().unwrap();
        assert!(sentence.contains("cannot"), "it is said what cannot be told apart: {sentence}");
    }
    let revealed = trial.score(&diagnosis);
    assert_eq!(revealed["score"]["right"], true, "{} {revealed}", diagnosis["sentence"]);
    let label = diagnosis["candidates"][0]["label"].as_str().unwrap().to_owned();
    trial.lab("add", &[&label]);
    let (after, floor) = (trial.true_error(&[]), floor(seed));
    println!("{fault} {seed}: {label}, {before:.3} -> {after:.3} mm, floor {floor:.3}");
    assert!(before > 2.0 * floor, "{fault}: {before:.3} mm before, floor {floor:.3}");
    assert!(after <= OF_THE_FLOOR * floor, "{label}: {after:.3} mm, floor {floor:.3}");
}

#[test]
fn a_wide_spot_is_found_by_edges_at_several_heights() {
    found_and_cured("spot", 3);
}

#[test]
fn a_forearm_that_droops_is_found() {
    found_and_cured("droop", 14);
}

#[test]
fn play_is_found_by_meeting_things_from_both_sides() {
    found_and_cured("backlash", 12);
}

#[test]
fn lost_steps_are_found_and_dated() {
    let trial = Trial::new("lost_steps", 16);
    trial.measure(&[]);
    let diagnosis = trial.lab("diagnose", &[]);
    let revealed = trial.score(&diagnosis);
    assert_eq!(revealed["score"]["right"], true, "{} {revealed}", diagnosis["sentence"]);
    assert_eq!(diagnosis["named"]["effect"], "joint_step");
    let at = diagnosis["named"]["at"].as_f64().unwrap();
    let (last_before, first_after) = around_the_haste(&fs::read_to_string(trial.path("table.csv")).unwrap());
    assert!((last_before..=first_after).contains(&at), "{last_before} to {first_after} s, dated {at}");
    assert!(diagnosis["sentence"].as_str().unwrap().contains("find the zeros anew"));
}

/// Times of the last trigger pose before the drive at full speed, and of the first after it.
fn around_the_haste(table: &str) -> (f64, f64) {
    let mut lines = table.lines();
    let header: Vec<&str> = lines.next().unwrap().split(',').collect();
    let column = |name: &str| header.iter().position(|known| *known == name).unwrap();
    let (time, step) = (column("time_s"), column("step"));
    let rows: Vec<Vec<&str>> = lines.map(|line| line.split(',').collect()).collect();
    let second = rows.iter().position(|row| row[step].starts_with("round[8]")).unwrap();
    (rows[second - 1][time].parse().unwrap(), rows[second][time].parse().unwrap())
}
