//! `plumb model compare`.

use std::error::Error;
use std::fmt::Write as _;

use plumb_diagnosis::laboratory::Comparison;
use plumb_report::{comparison_sentence, gauge_in_words, json, map_in_words, note_in_words, plot};

use super::arguments::{CompareArguments, PlotFormat};
use super::text::{
    effects_table, error_lines, explainable_line, floor_line, noise_lines, orientation_lines,
    placement_lines, surface_lines,
};
use crate::progress::watched;

/// Fits, compares, prints.
pub(super) fn run(arguments: &CompareArguments) -> Result<String, Box<dyn Error>> {
    let opened = arguments.pair.open()?;
    let comparison = watched(|progress| opened.laboratory.compare_in_full(progress))?;
    let mut printed = match arguments.pair.json {
        true => super::json(&json::comparison(&comparison)?)?,
        false => describe(&comparison),
    };
    match arguments.plot {
        Some(PlotFormat::Svg) => {
            let path = arguments.output();
            std::fs::write(path, plot::svg(&comparison)).map_err(|error| super::not_written(path, &error))?;
            if !arguments.pair.json {
                writeln!(printed, "Drawn to {}.", path.display())?;
            }
        }
        Some(PlotFormat::Term) if !arguments.pair.json => printed.push_str(&plot::terminal(&comparison, 78)),
        Some(PlotFormat::Term) | None => {}
    }
    Ok(printed)
}

fn describe(comparison: &Comparison) -> String {
    let mut text = format!("{} against {}: ", comparison.arm, comparison.data);
    text.push_str(&format!(
        "{} rows fitted, {} held out, {} parameters\n",
        comparison.fit_rows, comparison.check_rows, comparison.parameters
    ));
    text.push_str(&error_lines(&comparison.error_mm, comparison.unit));
    text.push_str(&orientation_lines(comparison.orientation_error_deg.as_ref()));
    text.push_str(&floor_line(&comparison.floor, comparison.unit));
    text.push_str(&explainable_line(comparison.explainable.as_ref()));
    text.push_str(&noise_lines(&comparison.noise));
    text.push_str(&placement_lines(&comparison.placed));
    text.push_str(&surface_lines(&comparison.surfaces));
    text.push_str(&effects_table(&comparison.effects));
    if let Some(map) = &comparison.residual_map {
        text.push_str(&format!("{}\n", map_in_words(map)));
    }
    for gauge in &comparison.gauges {
        text.push_str(&format!("{}\n", gauge_in_words(gauge)));
    }
    if !comparison.outliers.is_empty() {
        let lines: Vec<String> = comparison.outliers.iter().take(20).map(u32::to_string).collect();
        text.push_str(&format!("far outside the others: line {}\n", lines.join(", ")));
    }
    for warning in &comparison.warnings {
        text.push_str(&format!("note: {}\n", note_in_words(warning)));
    }
    text.push_str(&format!("\n{}\n", comparison_sentence(comparison)));
    text
}
