//! Trials in the TeachMover's cell: something is hidden in its world; runs of the cell measure it with the sensor in the hand alone, the lab says what it is,
//! and the hand then comes where the model sends it. `plumb trial rehearse` does all of that, as a person would.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

use serde_json::Value;

/// Further from the floor than this factor no true error may stay.
const OF_THE_FLOOR: f64 = 1.3;

/// A whole trial, kept in `place`: what it came to.
fn rehearsed(folder: &Path, fault: &str, seed: u64) -> Value {
    let seed = seed.to_string();
    let mut command = Command::new(env!("CARGO_BIN_EXE_plumb"));
    command.args(["trial", "rehearse", "--cell", "teachmover", "--fault", fault, "--seed", &seed, "--json"]);
    command.arg("-o").arg(folder).current_dir(folder).stdin(Stdio::null()).env("NO_COLOR", "1");
    let done = command.output().unwrap();
    let output = String::from_utf8_lossy(&done.stdout).into_owned();
    assert!(done.status.success(), "{output}{}", String::from_utf8_lossy(&done.stderr));
    let all: Value = serde_json::from_str(&output).unwrap();
    println!("{all:#}");
    all[0].clone()
}

fn millimetres(rehearsed: &Value, key: &str) -> f64 {
    rehearsed[key].as_f64().unwrap_or_else(|| panic!("{key}: {rehearsed}"))
}

/// What is wrong is found in the cell, and the cell then does better by it.
fn found_and_cured(fault: &str, seed: u64, effect: &str) -> Value {
    let folder = tempfile::tempdir().unwrap();
    let trial = rehearsed(folder.path(), fault, seed);
    assert_eq!(trial["right"], true, "{trial:#}");
    if trial["verdict"] == "named" {
        assert_eq!(trial["added"], effect);
    } else {
        let sentence = trial["sentence"].as_str().unwrap();
        assert!(sentence.contains("cannot"), "it is said what cannot be distinguished: {sentence}");
    }
    let [before, after, floor] = ["before_mm", "after_mm", "floor_mm"].map(|key| millimetres(&trial, key));
    assert!(before > OF_THE_FLOOR * floor, "{fault}: {before:.3} mm before, floor {floor:.3}");
    assert!(after <= OF_THE_FLOOR * floor, "{effect}: {after:.3} mm, floor {floor:.3}");
    trial
}

#[test]
fn a_wide_spot_is_found_by_edges_at_several_heights() {
    found_and_cured("spot", 11, "trigger_spot(sensor)");
}

#[test]
fn a_forearm_that_droops_is_distinguished_from_a_wheel_out_of_true_by_the_load_the_lab_asks_for() {
    let trial = found_and_cured("droop(elbow)", 4, "joint_compliance(elbow)");
    assert_eq!((&trial["at_first"], &trial["verdict"]), (&"located".into(), &"named".into()), "{trial:#}");
}

#[test]
fn poses_that_cannot_be_taken_are_refused_before_the_arm_moves_and_a_load_too_heavy_stops_the_run() {
    let folder = tempfile::tempdir().unwrap();
    plumb(
        folder.path(),
        &["trial", "new", "--cell", "teachmover", "--fault", "none", "--seed", "1", "-o", "cell"],
    );
    let poses = folder.path().join("cell/poses.csv");
    let asked = fs::read_to_string(&poses).unwrap();
    for (table, expected) in [
        (asked.replace("approach_q3", "side_q3"), "`poses` has no `approach_q3`"),
        (asked.replace("-105", "low"), "line 3: `low` under `q3_deg` is no number"),
    ] {
        fs::write(&poses, table).unwrap();
        let (code, output) = plumb(folder.path(), &["run", "cell/cell.yaml", "measure-poses", "--headless"]);
        assert!(
            code == Some(2) && output.contains(expected) && !output.contains("high: Raise the arm"),
            "{output}"
        );
    }
    fs::write(&poses, asked.replace(",0.3,", ",2,")).unwrap();
    let (code, output) = plumb(folder.path(), &["run", "cell/cell.yaml", "measure-poses", "--headless"]);
    // The run could be resumed: its world waits for that.
    plumb(folder.path(), &["doctor", "--clean", "cell/cell.yaml"]);
    assert!(code == Some(2) && output.contains("this hand lifts 0 to 0.454 kg"), "{output}");
}

/// A command in a folder with a record of its own: its exit code, and what it said.
fn plumb(folder: &Path, arguments: &[&str]) -> (Option<i32>, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_plumb"));
    command.args(arguments).current_dir(folder).env("XDG_STATE_HOME", folder.join("record"));
    let done = command.stdin(Stdio::null()).env("NO_COLOR", "1").output().unwrap();
    let output = [done.stdout, done.stderr].map(|text| String::from_utf8_lossy(&text).into_owned());
    (done.status.code(), output.concat())
}

#[test]
fn play_is_found_by_meeting_things_from_both_sides() {
    found_and_cured("backlash(elbow)", 12, "joint_backlash(elbow)");
}

#[test]
fn a_forearm_that_the_shoulder_drags_along_is_distinguished_from_a_wheel_out_of_true() {
    found_and_cured("coupling(elbow)", 3, "joint_coupling(elbow, shoulder)");
}

#[test]
fn lost_steps_are_dated_and_cured_by_finding_the_zeros_anew() {
    let folder = tempfile::tempdir().unwrap();
    let trial = rehearsed(folder.path(), "lost_steps(shoulder)", 16);
    assert_eq!(trial["right"], true, "{trial:#}");
    assert_eq!(trial["added"], "joint_step(shoulder)");
    let sentence = trial["sentence"].as_str().unwrap();
    assert!(sentence.contains("find the zeros anew"), "{sentence}");
    let at = dated(sentence);
    let table = fs::read_to_string(folder.path().join("lost_steps-shoulder-16/table.csv")).unwrap();
    let (last_before, first_after) = around_the_haste(&table);
    assert!((last_before..=first_after + 0.5).contains(&at), "{last_before} to {first_after} s, dated {at}");
    let [again, anew, floor] = ["lost_again_mm", "anew_mm", "floor_mm"].map(|key| millimetres(&trial, key));
    assert!(again > 5.0 * floor, "lost again, {again:.3} mm are left; floor {floor:.3}");
    assert!(anew <= OF_THE_FLOOR * floor, "with new zeros {anew:.3} mm are left; floor {floor:.3}");
}

/// The moment in a sentence, s, as in `joint_step(shoulder) at 570 s`.
fn dated(sentence: &str) -> f64 {
    let (_, rest) = sentence.split_once(" at ").unwrap();
    rest.split_whitespace().next().unwrap().parse().unwrap()
}

/// Times of the last trigger pose before the drive at full speed, and of the first after it.
fn around_the_haste(table: &str) -> (f64, f64) {
    // A table says first which cell it is of.
    let mut lines = table.lines().filter(|line| !line.starts_with('#'));
    let header: Vec<&str> = lines.next().unwrap().split(',').collect();
    let column = |name: &str| header.iter().position(|known| *known == name).unwrap();
    let (time, step) = (column("time_s"), column("step"));
    let rows: Vec<Vec<&str>> = lines.map(|line| line.split(',').collect()).collect();
    let second = rows.iter().position(|row| row[step].starts_with("round[8]")).unwrap();
    (rows[second - 1][time].parse().unwrap(), rows[second][time].parse().unwrap())
}

#[test]
fn a_shoulder_that_droops_where_the_rows_do_not_show_it_is_not_called_at_the_floor_without_a_word() {
    let folder = tempfile::tempdir().unwrap();
    let trial = rehearsed(folder.path(), "droop(shoulder)", 5105);
    assert_eq!(trial["right"], true, "{trial:#}");
    let [after, floor] = ["after_mm", "floor_mm"].map(|key| millimetres(&trial, key));
    let sentence = trial["sentence"].as_str().unwrap();
    let is_reported =
        sentence.contains("Not shown by them") && sentence.contains("joint_compliance(shoulder)");
    assert!(
        after <= OF_THE_FLOOR * floor || is_reported,
        "{after:.3} mm are left, floor {floor:.3}: {sentence}"
    );
}

#[test]
fn a_trial_that_fails_does_not_take_the_others_with_it() {
    let folder = tempfile::tempdir().unwrap();
    // Where the second trial is to be there is a file.
    fs::write(folder.path().join("none-2"), "in the way").unwrap();
    let (code, output) = plumb(
        folder.path(),
        &[
            "trial",
            "rehearse",
            "--cell",
            "teachmover",
            "--fault",
            "none",
            "--seed",
            "1",
            "-n",
            "2",
            "-o",
            ".",
        ],
    );
    assert_eq!(code, Some(2), "{output}");
    let line =
        |seed: &str| output.lines().find(|line| line.starts_with("none") && line.contains(seed)).unwrap();
    assert!(line("   1  ").contains("at_floor"), "{output}");
    assert!(line("   2  ").contains("FAILED: cannot write") && line("   2  ").contains("none-2"), "{output}");
    assert!(
        output.lines().any(|line| line.starts_with("all ") && line.trim_end().ends_with('1')),
        "{output}"
    );
}

#[test]
fn what_cannot_be_hidden_is_refused_before_anything_is_run() {
    let folder = tempfile::tempdir().unwrap();
    for (arguments, expected) in [
        (["--cell", "teachmover", "--fault", "rust"], "known are none, spot, backlash"),
        (["--cell", "mill", "--fault", "none"], "there is no cell `mill`; known are teachmover"),
    ] {
        let (code, output) = plumb(folder.path(), &[&["trial", "rehearse"], arguments.as_slice()].concat());
        assert!(code == Some(2) && output.contains(expected), "{output}");
    }
}

#[test]
fn the_cell_of_every_trial_is_in_order() {
    for cell in ["teachmover", "puma", "light-stripe"] {
        let folder = tempfile::tempdir().unwrap();
        let (code, output) =
            plumb(folder.path(), &["trial", "new", "--cell", cell, "--seed", "3", "-o", "cell"]);
        assert_eq!(code, Some(0), "{output}");
        let (code, output) = plumb(folder.path(), &["check", "cell/cell.yaml"]);
        assert_eq!(code, Some(0), "{cell}: {output}");
    }
}
