//! `plumb stripe diagnose`

use std::fmt::Write as _;
use std::io::{self, Write as _};
use std::process::ExitCode;

use plumb_diagnosis::Diagnosis;
use plumb_diagnosis::stripe::{Adjustment, Found};
use plumb_report::diagnosis_sentence;
use serde_json::{Value, json};

use super::lab::{Chosen, Lab};
use super::lab_error::LabError;
use crate::commands::model::diagnose::findings;
use crate::commands::model::text::error_lines;
use crate::failure::CommandResult;
use crate::progress::watched;

/// Options of `diagnose`.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    #[command(flatten)]
    chosen: Chosen,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// Diagnoses and reports.
pub(super) fn run(arguments: &Arguments) -> CommandResult {
    let lab = arguments.chosen.open()?;
    let adjusted = watched(|progress| lab.adjusted(progress)).map_err(LabError::from)?;
    let laboratory = adjusted.laboratory().map_err(LabError::from)?;
    let diagnosis = watched(|progress| laboratory.diagnose_in_full(progress))?;
    let text = if arguments.json {
        serde_json::to_string_pretty(&as_json(&lab, &adjusted, &diagnosis)?)? + "\n"
    } else {
        format_diagnosis(&lab, &adjusted, &diagnosis)
    };
    io::stdout().lock().write_all(text.as_bytes())?;
    Ok(ExitCode::SUCCESS)
}

fn format_diagnosis(lab: &Lab, adjusted: &Adjustment, diagnosis: &Diagnosis) -> String {
    let mut text = format!(
        "{} scans, {} views, {} points: {:.3} mm are left of them; neighbouring points scatter by {:.3} mm, of the pictures' noise {:.3} mm are expected\n",
        lab.scans.names.len(),
        lab.scans.views.len(),
        adjusted.points,
        adjusted.rms_mm,
        adjusted.noise_mm,
        adjusted.floor_mm
    );
    text.push_str(&numbers(adjusted));
    let _ = writeln!(
        text,
        "\na stripe on a surface is one point of the lab: where it lies, how it is turned, how it bends"
    );
    text.push_str(&error_lines(&diagnosis.error_mm, diagnosis.unit));
    if let Some(sigma) = diagnosis.floor.sigma_mm {
        let _ = writeln!(
            text,
            "noise: {sigma:.4} mm a reading of a stripe, from the scatter of neighbouring points"
        );
    }
    text.push_str(&findings(diagnosis, &diagnosis_sentence(diagnosis)));
    text
}

/// What was found, a number a line.
pub(super) fn numbers(adjustment: &Adjustment) -> String {
    let mut text = String::new();
    let width = adjustment.found.iter().map(|found| found.name.len()).max().unwrap_or(0);
    for found in &adjustment.found {
        let _ = writeln!(text, "  {:<width$} {}", found.name, size(found));
    }
    for hidden in &adjustment.not_observable {
        let _ = writeln!(text, "  {hidden}");
    }
    text
}

/// Below this a number is written with its power of ten.
const SMALL: f64 = 1e-3;

fn size(found: &Found) -> String {
    let Found { value, sigma, unit, .. } = found;
    if value.abs() < SMALL {
        format!("{value:+.3e} +- {sigma:.1e} {unit}").trim_end().to_owned()
    } else {
        format!("{value:+.5} +- {sigma:.5} {unit}").trim_end().to_owned()
    }
}

/// The JSON of any diagnosis, and what is said of the stripes and of what was adjusted to them.
fn as_json(lab: &Lab, adjusted: &Adjustment, diagnosis: &Diagnosis) -> serde_json::Result<Value> {
    let number = |found: &Found| json!({"name": found.name, "value": found.value, "sigma": found.sigma, "unit": found.unit});
    let mut output = plumb_report::json::diagnosis(diagnosis)?;
    output["stripes"] = json!({
        "scans": lab.scans.names.len(),
        "views": lab.scans.views.len(),
        "points": adjusted.points,
        "rms_mm": adjusted.rms_mm,
        "noise_mm": adjusted.noise_mm,
        "expected_noise_mm": adjusted.floor_mm,
        "found": adjusted.found.iter().map(number).collect::<Vec<_>>(),
        "not_observable": adjusted.not_observable,
    });
    Ok(output)
}
