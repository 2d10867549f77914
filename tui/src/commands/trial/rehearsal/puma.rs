//! A trial in the PUMA's cell.

use serde_json::Value;

use super::bench::Bench;
use super::{End, Rehearsal, word};
use crate::commands::trial::cell::puma::POSES;
use crate::commands::trial::error::TrialError;

const TABLE: &str = "table.csv";
const MODEL: &str = "cell/lab.yaml";
const VERIFY: &str = "verify";

/// The tip, above the tabletop with what the cage may reach, mm.
const KEEP_OUT: &str = "0,0,1,-430";

/// Loads beside the cage, kg.
const LOADS: &str = "0,1.5";

const POSES_ASKED: &str = "10";

/// Rounds of poses that the lab asks for, at most.
const ROUNDS: usize = 2;

/// With zeros found and everything fitted that the lab leaves free.
pub(super) fn floor(bench: &Bench) -> Result<f64, TrialError> {
    measured(bench)?;
    lab(bench, "accept", &[])?;
    bench.true_error(VERIFY, &[])
}

/// From the first day to what is left.
pub(super) fn rehearse(bench: &Bench, floor_mm: f64) -> Result<End, TrialError> {
    let (mut runs, mut diagnosis) = measured(bench)?;
    let before_mm = bench.true_error(VERIFY, &[])?;
    let at_first = Some(word(&diagnosis, "verdict")).filter(|verdict| verdict != "named");
    for _ in 1..ROUNDS {
        if !asks_for_poses(&diagnosis) {
            break;
        }
        diagnosis = measured_further(bench, &mut runs)?;
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
        lost_again_mm: None,
        anew_mm: None,
    }))
}

fn asks_for_poses(diagnosis: &Value) -> bool {
    let not_shown = diagnosis.get("not_shown").and_then(Value::as_array).is_some_and(|list| !list.is_empty());
    ["tied", "located", "unknown"].contains(&word(diagnosis, "verdict").as_str()) || not_shown
}

/// The classical calibration, then poses with the tracker that the lab asks for: the runs, and what the lab says of them.
fn measured(bench: &Bench) -> Result<(Vec<String>, Value), TrialError> {
    bench.run("calibrate", &[])?;
    let mut runs = vec![bench.last_run()?];
    tabulate(bench, &runs)?;
    let diagnosis = measured_further(bench, &mut runs)?;
    Ok((runs, diagnosis))
}

/// Ten poses more that the lab asks for, with the tracker.
fn measured_further(bench: &Bench, runs: &mut Vec<String>) -> Result<Value, TrialError> {
    let asked = [
        "model",
        "next",
        MODEL,
        "--data",
        TABLE,
        "-n",
        POSES_ASKED,
        "--keep-out",
        KEEP_OUT,
        "--payload",
        LOADS,
        "--csv",
    ];
    bench.write(&format!("cell/{POSES}"), &bench.plumb(&asked)?)?;
    bench.run("measure-tip", &[])?;
    runs.push(bench.last_run()?);
    tabulate(bench, runs)?;
    lab(bench, "diagnose", &[])
}

/// Makes a measurement table of what runs have measured, as POTCAL left the arm.
fn tabulate(bench: &Bench, runs: &[String]) -> Result<(), TrialError> {
    let runs: Vec<&str> = runs.iter().map(String::as_str).collect();
    let table = bench.plumb(&[&["show"], runs.as_slice(), &["--table", "--as-left"]].concat())?;
    bench.write(TABLE, &table)
}

fn lab(bench: &Bench, command: &str, more: &[&str]) -> Result<Value, TrialError> {
    let mut arguments = vec!["model", command, MODEL];
    arguments.extend(more);
    arguments.extend(["--data", TABLE, "--json"]);
    bench.json(&arguments)
}
