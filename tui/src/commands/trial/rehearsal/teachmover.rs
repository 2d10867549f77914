//! A trial in the TeachMover's cell.

use serde_json::Value;

use super::bench::Bench;
use super::{End, Rehearsal, word};
use crate::commands::trial::cell::teachmover::POSES;
use crate::commands::trial::error::TrialError;

/// What has been measured, in a trial's directory.
const TABLE: &str = "table.csv";

const MODEL: &str = "cell/trial.model.yaml";

/// How many poses the lab is asked for, beside the two it returns to.
const POSES_ASKED: &str = "12";

/// What the hand can be given to carry, kg: two thirds of what this arm lifts.
const LOAD_KG: f64 = 0.3;

/// By so much, mm, the true error changes at least when a motor has lost steps: a half-step moves the hand by 0.03 to 0.08.
const LOST_MM: f64 = 0.02;

const VERIFY: &str = "verify-by-points";

/// The arm's own error once the zeros were fitted: the floor, if nothing is hidden.
pub(super) fn floor(bench: &Bench) -> Result<f64, TrialError> {
    bench.run("find-zeros", &[])?;
    measure(bench)?;
    lab(bench, "accept", &[])?;
    bench.true_error(VERIFY, &[])
}

/// From the zeros to what is left.
pub(super) fn rehearse(bench: &Bench, floor_mm: f64) -> Result<End, TrialError> {
    bench.run("find-zeros", &[])?;
    let before_mm = bench.true_error(VERIFY, &[])?;
    let run = measure(bench)?;
    if bench.fault.starts_with("lost_steps") && !has_lost_steps(bench, before_mm)? {
        return Ok(End::NotScored("no step was lost in the run, so there was nothing to find".to_owned()));
    }
    let mut diagnosis = lab(bench, "diagnose", &[])?;
    let at_first = Some(word(&diagnosis, "verdict")).filter(|_| asks_for_poses(&diagnosis));
    if at_first.is_some() {
        measure_further(bench, &run)?;
        diagnosis = lab(bench, "diagnose", &[])?;
    }
    let (verdict, sentence) = (word(&diagnosis, "verdict"), word(&diagnosis, "sentence"));
    let first = diagnosis.pointer("/candidates/0/label").and_then(Value::as_str).unwrap_or_default();
    let found = ["named", "located", "tied"].contains(&verdict.as_str()) && !first.is_empty();
    let added = if found { first.to_owned() } else { String::new() };
    match found {
        true => lab(bench, "add", &[&added])?,
        false => lab(bench, "accept", &[])?,
    };
    let after_mm = bench.true_error(VERIFY, &[])?;
    let lost = added.starts_with("joint_step");
    let lost_again_mm = if lost { Some(bench.true_error(VERIFY, &["hurry=1"])?) } else { None };
    let anew_mm = if lost { Some(bench.true_error(VERIFY, &["hurry=1", "anew=1"])?) } else { None };
    let score = bench.score(&diagnosis)?;
    Ok(End::Scored(Rehearsal {
        at_first,
        verdict,
        added,
        right: score.right,
        reported_not_shown: score.reported_not_shown,
        sentence,
        before_mm,
        after_mm,
        floor_mm,
        lost_again_mm,
        anew_mm,
    }))
}

/// Whether the arm is further off once it was driven at full speed. Every run begins with the arm as it was left to be found, so that this is asked in a run of its own,
/// with the same moves.
fn has_lost_steps(bench: &Bench, before_mm: f64) -> Result<bool, TrialError> {
    Ok((bench.true_error(VERIFY, &["hurry=1"])? - before_mm).abs() > LOST_MM)
}

/// Whether the lab says that other poses would show more: of what is tied, or of what these cannot show.
fn asks_for_poses(diagnosis: &Value) -> bool {
    let not_shown = diagnosis.get("not_shown").and_then(Value::as_array).is_some_and(|list| !list.is_empty());
    ["tied", "located"].contains(&word(diagnosis, "verdict").as_str()) || not_shown
}

/// Measures by the sensor in the hand: the number of the run.
fn measure(bench: &Bench) -> Result<String, TrialError> {
    bench.run("measure-by-triggers", &[])?;
    let run = bench.last_run()?;
    tabulate(bench, &[&run])?;
    Ok(run)
}

/// Takes the poses that the lab asks for, some under load, beside what a run has measured.
fn measure_further(bench: &Bench, measured: &str) -> Result<(), TrialError> {
    let loads = format!("0,{LOAD_KG}");
    let asked = ["model", "next", MODEL, "--data", TABLE, "-n", POSES_ASKED, "--payload", &loads, "--csv"];
    bench.write(&format!("cell/{POSES}"), &bench.plumb(&asked)?)?;
    bench.run("measure-poses", &[])?;
    tabulate(bench, &[measured, &bench.last_run()?])
}

/// Makes a measurement table of what runs have measured.
fn tabulate(bench: &Bench, runs: &[&str]) -> Result<(), TrialError> {
    bench.write(TABLE, &bench.plumb(&[&["show"], runs, &["--table"]].concat())?)
}

fn lab(bench: &Bench, command: &str, more: &[&str]) -> Result<Value, TrialError> {
    let mut arguments = vec!["model", command, MODEL];
    arguments.extend(more);
    arguments.extend(["--data", TABLE, "--json"]);
    bench.json(&arguments)
}
