//! Many runs by one command.

use std::fs;

use crate::lab::Lab;

#[test]
fn an_ideal_cell_repeats_to_what_three_cycles_leave() {
    let lab = Lab::new();
    // A hand that is not vertical would show: it is not what the cycles find.
    lab.edit(
        "world-ideal.yaml",
        "    zero_error",
        "    start_within: {waist_deg: 3, shoulder_deg: 3, elbow_deg: 5}\n    zero_error",
    );
    let diagnosed = lab.plumb(&["repeatability", "cell.yaml", "-n", "4", "--seed", "7", "-o", "out"]);
    assert_eq!(diagnosed.code(), 0, "{}", diagnosed.all());
    let line = diagnosed
        .out()
        .lines()
        .find(|line| line.starts_with("height_mm"))
        .map(str::to_owned)
        .unwrap_or_default();
    let spread: f64 =
        line.split_whitespace().nth(2).and_then(|number| number.parse().ok()).unwrap_or(f64::NAN);
    assert!(spread < 1e-3, "{}", diagnosed.out());
    let rows = fs::read_to_string(lab.path("out/repeatability-runs.csv")).unwrap();
    assert_eq!(rows.lines().count(), 5, "{rows}");
    assert!(rows.lines().skip(1).all(|row| row.contains("Passed")), "{rows}");
    assert!(fs::read_to_string(lab.path("out/repeatability.svg")).unwrap().starts_with("<svg"));
    let again = lab.plumb(&["repeatability", "cell.yaml", "-n", "4", "--seed", "7"]);
    let table = |text: &str| {
        text.lines().take_while(|line| !line.contains("a second")).map(str::to_owned).collect::<Vec<_>>()
    };
    assert_eq!(table(&diagnosed.out()), table(&again.out()), "the same seeds give the same table");
}

#[test]
fn a_run_made_after_others_is_what_it_is_alone() {
    let lab = Lab::new();
    let study = |first: &str, count: &str| {
        let diagnosed =
            lab.plumb(&["repeatability", "cell-worn.yaml", "-n", count, "--seed", first, "-o", "out"]);
        assert_eq!(diagnosed.code(), 0, "{}", diagnosed.all());
        let rows = fs::read_to_string(lab.path("out/repeatability-runs.csv")).unwrap();
        rows.lines().last().unwrap_or_default().to_owned()
    };
    assert_eq!(study("11", "3"), study("12", "2"), "seed 13 after two others, and after one");
}

const STUDY: &str = "
study: small
title: two lines and a figure
runs: 2
cell: cell.yaml
procedure: initialize
set: {tilt_deg: 10}
check_pose: {waist: 8, shoulder: 38, elbow: -90}
lines:
  - {title: as it is}
  - title: half-steps
    world: {arm: {teachmover: {resolution: half_step}}}
  - title: nothing to see
    world: {sensor: {optics: {ideal: {height_mm: 0.5}}}}
figures:
  - figure: small-tilt
    title: a tilted hand
    vary: world.arm.teachmover.start.wrist_pitch_deg
    across: attitude, deg
    values: [-91, -89]
    show: [{of: elbow_deg, as: bias}]
";

#[test]
fn a_study_that_is_written_down_makes_a_table_its_failures_and_its_figures() {
    let lab = Lab::new();
    lab.write("small.yaml", STUDY);
    let diagnosed = lab.plumb(&["imperfections", "small.yaml", "-o", "out"]);
    assert_eq!(diagnosed.code(), 0, "{}", diagnosed.all());
    let out = diagnosed.out();
    assert!(out.contains("as it is") && out.contains("2/2"), "{out}");
    assert!(out.contains("0/2") && out.contains("nothing to see: 2 of 2 did not pass: step `"), "{out}");
    assert!(fs::read_to_string(lab.path("out/small-tilt.csv")).unwrap().lines().count() == 3);
    assert!(lab.path("out/small-runs.csv").exists() && lab.path("out/small-tilt.svg").exists());
}

#[test]
fn a_study_that_cannot_be_made_says_why() {
    let lab = Lab::new();
    let refused = |text: &str, expected: &str| {
        lab.write("wrong.yaml", text);
        let diagnosed = lab.plumb(&["imperfections", "wrong.yaml"]);
        assert_eq!(diagnosed.code(), 2, "{}", diagnosed.all());
        assert!(diagnosed.err().contains(expected), "{}", diagnosed.err());
    };
    refused(
        &STUDY.replace("vary: world.", "vary: "),
        "is neither in the `world.` nor among the parameters, `set.`",
    );
    refused(&STUDY.replace("half_step}", "half_steps}"), "half_steps");
    refused(&STUDY.replace("procedure: initialize", "procedure: initialise"), "did you mean `initialize`?");
    refused(&STUDY.replace("cell: cell.yaml\n", ""), "a study needs the key `cell`");
    refused("study: x\ntitle: y\nrunz: 3\n", "unknown key `runz` in a study");
    refused(
        &STUDY.replace("cell: cell.yaml\n", "cell: cell.yaml\nwrold: {}\n"),
        "unknown key `wrold` in a study",
    );
    let absent = lab.plumb(&["imperfections", "absent.yaml"]);
    assert!(absent.err().contains("cannot read the study absent.yaml"), "{}", absent.err());
}
