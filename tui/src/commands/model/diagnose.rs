//! `plumb model diagnose`.

use std::error::Error;

use plumb_calibration::measurement::ReadingUnit;
use plumb_diagnosis::{Candidate, Diagnosis, Verdict};
use plumb_report::{
    diagnosis_sentence, hypothesis_sentence, is_determined, json, note_in_words, rejection_in_words,
};

use super::arguments::DiagnoseArguments;
use super::text::{error_lines, explainable_line, figure, floor_line, noise_lines};
use crate::progress::watched;
use crate::shown_unit::shown_unit;

/// Diagnoses, prints.
pub(super) fn run(arguments: &DiagnoseArguments) -> Result<String, Box<dyn Error>> {
    let opened = arguments.pair.open()?;
    let diagnosis = watched(|progress| opened.laboratory.diagnose_in_full(progress))?;
    Ok(match arguments.pair.json {
        true => super::json(&json::diagnosis(&diagnosis)?)?,
        false => describe(&diagnosis, &diagnosis_sentence(&diagnosis)),
    })
}

/// The verdict in a word or two.
pub(super) fn verdict(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::AtFloor => "AT THE FLOOR",
        Verdict::Named => "NAMED",
        Verdict::Located => "LOCATED",
        Verdict::Tied => "TIED",
        Verdict::Unknown => "UNKNOWN",
        Verdict::Blind => "BLIND",
        Verdict::NotRepeatable => "NOT REPEATABLE",
        Verdict::FloorUnknown => "FLOOR UNKNOWN",
    }
}

/// The whole diagnosis as text, with its sentence.
pub(super) fn describe(diagnosis: &Diagnosis, sentence: &str) -> String {
    let mut text = error_lines(&diagnosis.error_mm, diagnosis.unit);
    text.push_str(&floor_line(&diagnosis.floor, diagnosis.unit));
    text.push_str(&noise_lines(&diagnosis.noise));
    text.push_str(&findings(diagnosis, sentence));
    text
}

/// What was found: how much could be explained, the candidates, the verdict.
pub(crate) fn findings(diagnosis: &Diagnosis, sentence: &str) -> String {
    let mut text = explainable_line(diagnosis.explainable.as_ref());
    text.push_str(&candidates(&diagnosis.candidates, diagnosis.unit));
    if !diagnosis.besides.is_empty() {
        text.push_str(&format!("also at work: {}\n", diagnosis.besides.join(", ")));
    }
    if !diagnosis.outliers.is_empty() {
        let lines: Vec<String> = diagnosis.outliers.iter().take(20).map(u32::to_string).collect();
        text.push_str(&format!("far outside the others: line {}\n", lines.join(", ")));
    }
    for warning in &diagnosis.warnings {
        text.push_str(&format!("note: {}\n", note_in_words(warning)));
    }
    text.push_str(&format!("\n{}. {sentence}\n", verdict(diagnosis.verdict)));
    if let Some(hypothesis) = &diagnosis.hypothesis {
        text.push_str(&format!("\nHYPOTHESIS. {}\n\n{}", hypothesis_sentence(hypothesis), hypothesis.define));
    }
    text
}

fn candidates(candidates: &[Candidate], unit: ReadingUnit) -> String {
    if candidates.is_empty() {
        return String::new();
    }
    let width = candidates.iter().map(|candidate| candidate.label.len()).max().unwrap_or(0);
    let mut text = String::from("\n");
    for candidate in candidates.iter().take(8) {
        let size = match is_determined(candidate.se) {
            true => format!(
                "{} +- {} {}",
                figure(candidate.size),
                figure(candidate.se),
                shown_unit(&candidate.unit)
            ),
            false => "size not determined".to_owned(),
        };
        let why = candidate.rejected.as_ref().map_or_else(|| "named".to_owned(), rejection_in_words);
        text.push_str(&format!(
            "  {:width$}  explains {:7.4} {unit}  {size:<34} {why}\n",
            candidate.label, candidate.explains_mm
        ));
    }
    text
}
