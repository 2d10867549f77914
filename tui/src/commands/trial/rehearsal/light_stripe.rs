//! A trial in the light stripe's cell.

use serde_json::Value;

use super::bench::Bench;
use super::{End, Rehearsal, word};
use crate::commands::trial::cell::light_stripe::FLYING;
use crate::commands::trial::error::TrialError;

const CELL: &str = "cell/cell.yaml";
const RECORD: &str = "rec";

/// With zeros and rig adjusted alone: the floor, if nothing is hidden.
pub(super) fn floor(bench: &Bench) -> Result<f64, TrialError> {
    let scans = gather(bench)?;
    adjusted(bench, &scans, "classical", None)
}

/// From the scans to what is left.
pub(super) fn rehearse(bench: &Bench, floor_mm: f64) -> Result<End, TrialError> {
    let scans = gather(bench)?;
    let before_mm = adjusted(bench, &scans, "classical", None)?;
    let message = bench.json(&["stripe", "diagnose", CELL, "--scans", &scans, "--json"])?;
    let (verdict, sentence) = (word(&message, "verdict"), word(&message, "sentence"));
    let first = first_in_question(&message).unwrap_or_default();
    let found = ["named", "tied"].contains(&verdict.as_str()) && !first.is_empty();
    let after_mm = match found {
        true => adjusted(bench, &scans, "true", Some(first))?,
        false => before_mm,
    };
    let score = bench.score(&message)?;
    Ok(End::Scored(Rehearsal {
        at_first: None,
        verdict,
        added: if found { first.to_owned() } else { String::new() },
        right: score.right,
        reported_not_shown: false,
        sentence,
        before_mm,
        after_mm,
        floor_mm,
        lost_again_mm: None,
        anew_mm: None,
    }))
}

/// What a diagnosis names, or the likeliest of what it cannot distinguish, as it is added.
fn first_in_question(message: &Value) -> Option<&str> {
    let candidates = message.get("candidates")?.as_array()?;
    let is_named = |one: &&Value| one.get("rejected").is_none_or(Value::is_null);
    candidates.iter().find(is_named).or(candidates.first())?.get("label")?.as_str()
}

/// In motion where a picture's time may be wrong.
fn settings(bench: &Bench) -> Vec<&'static str> {
    if bench.fault.starts_with("delay") { vec!["--set", FLYING] } else { Vec::new() }
}

/// Scans for the lab: the folder they lie in.
fn gather(bench: &Bench) -> Result<String, TrialError> {
    let run = ["run", CELL, "gather", "--headless", "--record", RECORD];
    bench.plumb(&[run.as_slice(), settings(bench).as_slice()].concat())?;
    let shown = bench.json(&["show", "--json", "--record", RECORD])?;
    Ok(format!("{RECORD}/run-{}", shown.pointer("/run/run").and_then(Value::as_i64).unwrap_or(1)))
}

/// How far the apexes of twelve approaches lie apart, mm, in a cell that uses what the scans give.
fn adjusted(bench: &Bench, scans: &str, name: &str, add: Option<&str>) -> Result<f64, TrialError> {
    let cell = format!("cell/{name}.yaml");
    let add: Vec<&str> = add.into_iter().flat_map(|effect| ["--add", effect]).collect();
    let adjust = [&["stripe", "adjust", CELL, "--scans", scans, "-o", &cell], add.as_slice()];
    bench.plumb(&adjust.concat())?;
    let run = ["run", &cell, "direction-error", "--headless", "--record", RECORD, "--set", "most_mm=100"];
    bench.plumb(&[run.as_slice(), settings(bench).as_slice()].concat())?;
    let shown = bench.json(&["show", "--json", "--record", RECORD])?;
    let steps = shown.get("steps").and_then(Value::as_array).map_or(&[] as &[Value], Vec::as_slice);
    let spread = steps.iter().find(|step| step.get("step").and_then(Value::as_str) == Some("spread"));
    let error = spread.and_then(|step| step.pointer("/result/error_mm")).and_then(Value::as_f64);
    error.ok_or_else(|| TrialError::Rehearsal {
        command: "show --json".to_owned(),
        cause: "the run tells no error".to_owned(),
    })
}
