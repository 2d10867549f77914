//! `plumb stripe diagnose`

use std::fmt::Write as _;
use std::io::{self, Write as _};
use std::process::ExitCode;

use plumb_diagnosis::stripe::{Adjustment, Found, StripeDiagnosis, StripeVerdict, Tried, diagnose};
use serde_json::{Value, json};

use super::lab::{Chosen, Lab, to_lab};
use super::lab_error::LabError;
use crate::failure::CommandResult;

/// Options of `diagnose`.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    #[command(flatten)]
    chosen: Chosen,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// Diagnoses and tells.
pub(super) fn run(arguments: &Arguments) -> CommandResult {
    let lab = arguments.chosen.open()?;
    let diagnosis = of(&lab)?;
    let text = if arguments.json {
        serde_json::to_string_pretty(&as_json(&lab, &diagnosis))? + "\n"
    } else {
        told(&lab, &diagnosis)
    };
    io::stdout().lock().write_all(text.as_bytes())?;
    Ok(ExitCode::SUCCESS)
}

/// The lab's diagnosis of what was opened.
pub(crate) fn of(lab: &Lab) -> Result<StripeDiagnosis, LabError> {
    Ok(diagnose(&lab.model, &to_lab(&lab.rig), &lab.surfaces, &lab.scans, &lab.added)?)
}

fn told(lab: &Lab, diagnosis: &StripeDiagnosis) -> String {
    let classical = &diagnosis.classical;
    let mut text = format!(
        "{} scans, {} views, {} points: {:.3} mm are left of them; neighbouring points scatter by {:.3} mm, of the pictures' noise {:.3} mm are expected\n",
        lab.scans.names.len(),
        lab.scans.views.len(),
        classical.points,
        classical.rms_mm,
        classical.noise_mm,
        diagnosis.floor_mm
    );
    text.push_str(&numbers(classical));
    let _ = writeln!(
        text,
        "\n{:<30} {:>9} {:>20} {:>10}  size",
        "what else it may be", "BIC gain", "held-out gain", "leaves mm"
    );
    for tried in &diagnosis.tried {
        let (gain, error) = tried.held_out_gain;
        let _ = writeln!(
            text,
            "{:<30} {:>9.1} {:>10.3} +- {:>6.3} {:>10.3}  {}",
            tried.suspect.name,
            tried.bic_gain,
            gain,
            error,
            tried.adjustment.rms_mm,
            sizes_in_words(tried)
        );
    }
    let _ = writeln!(text, "\n{}", diagnosis.sentence);
    text
}

/// What was found, a number a line.
pub(super) fn numbers(adjustment: &Adjustment) -> String {
    let mut text = String::new();
    for found in &adjustment.found {
        let _ = writeln!(text, "  {:<26} {}", found.name, size(found));
    }
    for hidden in &adjustment.not_observable {
        let _ = writeln!(text, "  not shown by these scans: {hidden}");
    }
    text
}

fn size(found: &Found) -> String {
    let (unit, factor) = match found.unit.as_str() {
        "rad" => ("deg", 180.0 / std::f64::consts::PI),
        unit => (unit, 1.0),
    };
    let (value, sigma) = (found.value * factor, found.sigma * factor);
    if value.abs() < 1e-3 {
        format!("{value:+.3e} +- {sigma:.1e} {unit}").trim_end().to_owned()
    } else {
        format!("{value:+.5} +- {sigma:.5} {unit}").trim_end().to_owned()
    }
}

/// The numbers of a suspect itself, with their errors and units.
pub(crate) fn sizes_in_words(tried: &Tried) -> String {
    sizes(tried).iter().map(size).collect::<Vec<_>>().join(", ")
}

/// The numbers of a suspect itself.
fn sizes(tried: &Tried) -> Vec<Found> {
    let own: Vec<String> = tried.suspect.options.rig.iter().map(|parameter| parameter.name()).collect();
    let is_own = |found: &&Found| found.name.starts_with(&tried.suspect.name) || own.contains(&found.name);
    tried.adjustment.found.iter().filter(is_own).cloned().collect()
}

fn as_json(lab: &Lab, diagnosis: &StripeDiagnosis) -> Value {
    let number = |found: &Found| json!({"name": found.name, "value": found.value, "sigma": found.sigma, "unit": found.unit});
    let tried = |tried: &Tried| {
        json!({
            "effect": tried.suspect.name,
            "bic_gain": tried.bic_gain,
            "held_out_gain": tried.held_out_gain.0,
            "held_out_se": tried.held_out_gain.1,
            "rms_mm": tried.adjustment.rms_mm,
            "noise_mm": tried.adjustment.noise_mm,
            "size": sizes(tried).iter().map(number).collect::<Vec<_>>(),
        })
    };
    let classical = &diagnosis.classical;
    json!({
        "verdict": diagnosis.verdict.word(),
        "floor_mm": diagnosis.floor_mm,
        "rms_mm": classical.rms_mm,
        "noise_mm": classical.noise_mm,
        "named": diagnosis.tried.first().filter(|_| diagnosis.verdict == StripeVerdict::Named).map(|best| best.suspect.name.as_str()),
        "scans": lab.scans.names.len(),
        "views": lab.scans.views.len(),
        "points": classical.points,
        "found": classical.found.iter().map(number).collect::<Vec<_>>(),
        "not_observable": classical.not_observable,
        "candidates": diagnosis.tried.iter().map(tried).collect::<Vec<_>>(),
        "sentence": diagnosis.sentence,
    })
}
