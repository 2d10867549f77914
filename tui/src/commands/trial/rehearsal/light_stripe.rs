//! A trial in the light stripe's cell.

use serde_json::{Value, json};

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
    let said = bench.json(&["stripe", "diagnose", CELL, "--scans", &scans, "--json"])?;
    let (verdict, sentence) = (word(&said, "verdict"), word(&said, "sentence"));
    let first = said.pointer("/candidates/0/effect").and_then(Value::as_str).unwrap_or_default();
    let found = ["named", "tied"].contains(&verdict.as_str()) && !first.is_empty();
    let after_mm = match found {
        true => adjusted(bench, &scans, "true", Some(first))?,
        false => before_mm,
    };
    let score = bench.score(&as_table_lab(&said))?;
    Ok(End::Scored(Rehearsal {
        at_first: None,
        verdict,
        added: if found { first.to_owned() } else { String::new() },
        right: score.right,
        told_not_shown: false,
        sentence,
        before_mm,
        after_mm,
        floor_mm,
        lost_again_mm: None,
        anew_mm: None,
    }))
}

/// The diagnosis in the words of the table lab: effect and place apart.
fn as_table_lab(said: &Value) -> Value {
    let apart = |name: &str| {
        let (effect, rest) = name.split_once('(').unwrap_or((name, ""));
        let place = rest.split([',', ')']).next().unwrap_or_default();
        json!({"effect": effect, "where": place})
    };
    let candidates: Vec<Value> = said
        .get("candidates")
        .and_then(Value::as_array)
        .into_iter()
        .flatten()
        .filter_map(|one| Some(apart(one.get("effect")?.as_str()?)))
        .collect();
    let named = said.get("named").and_then(Value::as_str).map(apart);
    let tied = if word(said, "verdict") == "tied" { candidates.clone() } else { Vec::new() };
    json!({"verdict": word(said, "verdict"), "named": named, "tied": tied, "candidates": candidates})
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
