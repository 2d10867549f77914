//! One page that needs no other file: what the model was, what it lacks, how the error fell, what to measure next.

use std::fmt::Write;

use serde::Serialize;

use crate::claim::Claim;
use crate::explainable::Explainable;
use crate::laboratory::{Comparison, ErrorSummary, Errors, Laboratory, LaboratoryError};
use crate::phrase::listed;
use crate::plot::{escaped, svg};
use crate::{Diagnosis, NextPoses};
use plumb_calibration::arm_model::{AddedEffect, Model};
use plumb_estimation::Progress;

/// One step of the fall of the error, mm2: variances add, root mean squares do not.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Fall {
    /// What was added; `start` for the model without any added effect.
    pub added: String,
    /// Mean square over the rows that were fitted.
    pub fit_mm2: f64,
    /// Mean square over left-out regions.
    pub cv_mm2: Option<f64>,
    /// Mean square over the locked rows.
    pub check_mm2: Option<f64>,
}

/// One line of the model's story: a revision.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Chapter {
    /// The revision's number, 0 for the original.
    pub number: u32,
    /// What was done.
    pub did: String,
    /// RMS of the fit then, mm.
    pub rms_mm: Option<f64>,
}

/// Everything a report tells.
#[derive(Debug, Clone, Serialize)]
pub struct Report {
    /// The model as it stands, against the table.
    pub comparison: Comparison,
    /// What it lacks.
    pub diagnosis: Diagnosis,
    /// The fall of the error through the added effects.
    pub fall: Vec<Fall>,
    /// Parameters that moved by more than two standard errors when the added effects came in.
    pub moved: Vec<String>,
    /// Poses to measure next, where any would settle something.
    pub next: Option<NextPoses>,
    /// The revisions.
    pub story: Vec<Chapter>,
}

/// Added effects shown one by one; more are shown in groups.
const STEPS: usize = 12;

impl Laboratory {
    /// Gathers what a report tells; `story` are the revisions so far.
    ///
    /// # Errors
    /// Nothing can be fitted, or cancellation.
    pub fn report(&self, story: Vec<Chapter>, progress: &Progress) -> Result<Report, LaboratoryError> {
        progress.report(0.0, "comparing")?;
        let comparison = self.compare_in_full(progress)?;
        let (fall, moved) = self.fall(&comparison, progress)?;
        let diagnosis = self.diagnose(progress)?;
        let asks = !diagnosis.next.is_empty() || diagnosis.named.is_some();
        let next = match asks {
            true => {
                let wanted = crate::Wanted { count: 8, keep_out: Vec::new(), payloads: Vec::new() };
                self.next_poses(&wanted, progress).ok()
            }
            false => None,
        };
        Ok(Report { comparison, diagnosis, fall, moved, next, story })
    }

    fn fall(
        &self,
        now: &Comparison,
        progress: &Progress,
    ) -> Result<(Vec<Fall>, Vec<String>), LaboratoryError> {
        let effects: &[AddedEffect] = &self.model().effects;
        let group = effects.len().div_ceil(STEPS).max(1);
        let mut fall = Vec::new();
        let mut bare: Option<Comparison> = None;
        for count in (0..effects.len()).step_by(group) {
            progress.report(count as f64 / effects.len() as f64, "telling the fall of the error")?;
            let model =
                Model { effects: effects.iter().take(count).cloned().collect(), ..self.model().clone() };
            let smaller = Self::new(model, self.table().clone(), self.options().clone())?;
            let comparison = smaller.compare(progress)?;
            fall.push(Fall::of(self.group_label(count, group), &comparison));
            if count == 0 {
                bare = Some(comparison);
            }
        }
        fall.push(Fall::of(self.group_label(effects.len(), group), now));
        let moved = bare.map_or_else(Vec::new, |bare| crate::laboratory::moved(&bare.effects, &now.effects));
        Ok((fall, moved))
    }

    /// What came in with the last `group` of the first `count` effects.
    fn group_label(&self, count: usize, group: usize) -> String {
        let effects = &self.model().effects;
        let first = count.saturating_sub(if count.is_multiple_of(group) { group } else { count % group });
        let labels: Vec<String> = effects
            .get(first..count)
            .unwrap_or(&[])
            .iter()
            .map(|added| match self.model().correction(&added.id) {
                Some(_) => format!("{} (correction)", self.model().label(&added.id)),
                None => self.model().label(&added.id),
            })
            .collect();
        match labels.as_slice() {
            [] => "start".to_owned(),
            [one] => one.clone(),
            [one, rest @ ..] => format!("{one} and {} more", rest.len()),
        }
    }
}

impl Fall {
    fn of(added: String, comparison: &Comparison) -> Self {
        let rms = comparison.rms_mm;
        let square = |value: f64| value * value;
        Self { added, fit_mm2: square(rms.fit), cv_mm2: rms.cv.map(square), check_mm2: rms.check.map(square) }
    }
}

const STYLE: &str = "body{font:15px/1.5 sans-serif;max-width:60em;margin:2em auto;padding:0 1em;color:#222}\
table{border-collapse:collapse;margin:.6em 0}td,th{padding:.15em .8em .15em 0;text-align:left;vertical-align:top}\
td.n{text-align:right;font-variant-numeric:tabular-nums}.verdict{font-size:1.2em;padding:.7em 1em;background:#eef3f8;border-left:4px solid #1f5fa0}\
svg{max-width:100%;height:auto}th{border-bottom:1px solid #bbb}.faint{color:#666}";

/// The report as one HTML page with its drawings inside.
pub fn html(report: &Report) -> String {
    let mut out = String::new();
    write_page(&mut out, report).unwrap_or_default();
    out
}

fn write_page(out: &mut String, report: &Report) -> std::fmt::Result {
    let comparison = &report.comparison;
    let title = escaped(&format!("{} against {}", comparison.arm, comparison.data));
    writeln!(out, "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{title}</title>")?;
    writeln!(out, "<style>{STYLE}</style></head><body>\n<h1>{title}</h1>")?;
    writeln!(out, "<p class=\"verdict\">{}</p>", escaped(&report.diagnosis.sentence))?;
    writeln!(
        out,
        "<p>{} {} rows were fitted with {} parameters, {} were held out.</p>",
        escaped(&comparison.sentence),
        comparison.fit_rows,
        comparison.parameters,
        comparison.check_rows
    )?;
    errors(out, &comparison.error_mm)?;
    if let Some(explainable) = &comparison.explainable {
        writeln!(out, "<p>How much could be explained: {}.</p>", escaped(&explainable.sentence))?;
        groups(out, explainable)?;
    }
    list(out, "Notes", &report.diagnosis.warnings)?;
    story(out, &report.story)?;
    waterfall(out, report)?;
    list(
        out,
        "Parameters that moved by more than two standard errors when the added effects came in",
        &report.moved,
    )?;
    effects(out, comparison)?;
    candidates(out, &report.diagnosis)?;
    next(out, report)?;
    let far: Vec<String> = comparison.outliers.iter().take(40).map(|line| format!("line {line}")).collect();
    list(out, "Rows far outside the others' scatter (kept, with less weight)", &far)?;
    writeln!(out, "<h2>What is left</h2>\n{}", svg(comparison))?;
    writeln!(out, "</body></html>")
}

/// The error of one measured point where the model was fitted and where it was not.
fn errors(out: &mut String, errors: &Errors) -> std::fmt::Result {
    writeln!(
        out,
        "<table><tr><th>error of a point, mm</th><th>RMS</th><th>mean</th><th>95 %</th><th>maximum</th><th>points</th></tr>"
    )?;
    let parts = [
        ("where it was fitted", Some(errors.fit)),
        ("regions left out", errors.cv),
        ("held out", errors.check),
    ];
    for (name, summary) in parts {
        let Some(ErrorSummary { points, rms, mean, percentile_95, max }) = summary else { continue };
        let cells = [rms, mean, percentile_95, max].map(|value| format!("<td class=\"n\">{value:.4}</td>"));
        writeln!(out, "<tr><td>{name}</td>{}<td class=\"n\">{points}</td></tr>", cells.join(""))?;
    }
    writeln!(out, "</table>")
}

/// What each kind of knowledge of a row predicts of unseen rows.
fn groups(out: &mut String, explainable: &Explainable) -> std::fmt::Result {
    writeln!(
        out,
        "<table><tr><th>known of a row</th><th>left with it and those above, mm</th><th>rise without it alone, mm</th><th>&plusmn; one standard error</th></tr>"
    )?;
    for group in &explainable.groups {
        let name = escaped(&group.group);
        match group.explains {
            true => writeln!(
                out,
                "<tr><td>{name}</td><td class=\"n\">{:.4}</td><td class=\"n\">{:.4}</td><td class=\"n\">{:.4}</td></tr>",
                group.left_mm, group.beyond_others_mm, group.scatter_mm
            )?,
            false => writeln!(
                out,
                "<tr><td>{name}</td><td class=\"faint\">nothing</td><td></td><td class=\"n\">{:.4}</td></tr>",
                group.scatter_mm
            )?,
        }
    }
    writeln!(out, "</table>")
}

fn list(out: &mut String, heading: &str, lines: &[String]) -> std::fmt::Result {
    if lines.is_empty() {
        return Ok(());
    }
    writeln!(out, "<h2>{}</h2><ul>", escaped(heading))?;
    for line in lines {
        writeln!(out, "<li>{}</li>", escaped(line))?;
    }
    writeln!(out, "</ul>")
}

fn story(out: &mut String, story: &[Chapter]) -> std::fmt::Result {
    if story.len() < 2 {
        return Ok(());
    }
    writeln!(
        out,
        "<h2>The story so far</h2><table><tr><th>revision</th><th>what was done</th><th>RMS, mm</th></tr>"
    )?;
    for chapter in story {
        let rms = chapter.rms_mm.map_or_else(String::new, |rms| format!("{rms:.4}"));
        let did = escaped(&chapter.did);
        writeln!(
            out,
            "<tr><td class=\"n\">{}</td><td>{did}</td><td class=\"n\">{rms}</td></tr>",
            chapter.number
        )?;
    }
    writeln!(out, "</table>")
}

/// Where the bars of the error's fall begin, and the length of the longest.
const BARS: (f64, f64) = (300.0, 520.0);

/// Height of one step of the fall.
const STEP_HEIGHT: f64 = 44.0;

/// The greatest mean square of any step.
fn greatest(fall: &[Fall]) -> f64 {
    let values = fall.iter().flat_map(|step| [Some(step.fit_mm2), step.cv_mm2, step.check_mm2]).flatten();
    values.filter(|value| value.is_finite()).fold(1e-12, f64::max)
}

fn waterfall(out: &mut String, report: &Report) -> std::fmt::Result {
    let greatest = greatest(&report.fall);
    let height = STEP_HEIGHT * report.fall.len() as f64 + 54.0;
    writeln!(
        out,
        "<h2>The fall of the error</h2>\n<p class=\"faint\">In mm\u{b2}, because root mean squares do not add: solid where it was fitted, hollow where regions were left out, dashed on the locked rows; the lines are the noise floor and what no function of pose, moves or conditions predicts on unseen rows.</p>"
    )?;
    writeln!(
        out,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 960 {height}\" width=\"960\" height=\"{height}\" font-family=\"sans-serif\" font-size=\"12\">"
    )?;
    for (index, step) in report.fall.iter().enumerate() {
        let name = if index == 0 { "start".to_owned() } else { format!("+ {}", step.added) };
        bars(out, step, &name, 10.0 + STEP_HEIGHT * index as f64, greatest)?;
    }
    if let Some(sigma) = report.comparison.floor.sigma_mm {
        // Residuals are lengths in space where three axes were measured, and so is the floor.
        let floor = axes_measured(&report.comparison) * sigma * sigma;
        vertical_line(out, ("floor", "#2a8a2a", floor), height - 10.0, greatest)?;
    }
    if let Some(explainable) = report.comparison.explainable.as_ref().filter(|known| known.is_structured()) {
        let bound = explainable.not_predictable_mm.powi(2);
        vertical_line(out, ("not predictable", "#b06000", bound), height - 24.0, greatest)?;
    }
    writeln!(out, "</svg>")
}

/// The bars of one step: fitted, left out, locked.
fn bars(out: &mut String, step: &Fall, name: &str, top: f64, greatest: f64) -> std::fmt::Result {
    let (left, width) = BARS;
    writeln!(
        out,
        "<text x=\"{}\" y=\"{:.0}\" text-anchor=\"end\">{}</text>",
        left - 10.0,
        top + 14.0,
        escaped(name)
    )?;
    let bars = [
        (Some(step.fit_mm2), "fill=\"#1f5fa0\"", 0.0),
        (step.cv_mm2, "fill=\"white\" stroke=\"#1f5fa0\"", 12.0),
        (step.check_mm2, "fill=\"white\" stroke=\"#1f5fa0\" stroke-dasharray=\"3 2\"", 24.0),
    ];
    for (value, style, down) in bars {
        let Some(value) = value.filter(|value| value.is_finite()) else { continue };
        let long = (width * value / greatest).max(0.5);
        writeln!(
            out,
            "<rect x=\"{left}\" y=\"{:.0}\" width=\"{long:.1}\" height=\"10\" {style}/>",
            top + 4.0 + down
        )?;
        writeln!(
            out,
            "<text x=\"{:.1}\" y=\"{:.0}\" font-size=\"10\" fill=\"#555\">{:.4} mm</text>",
            left + long + 6.0,
            top + 13.0 + down,
            value.sqrt()
        )?;
    }
    Ok(())
}

/// A line across all steps with its name below, at `square` mm2.
fn vertical_line(
    out: &mut String,
    (name, colour, square): (&str, &str, f64),
    below: f64,
    greatest: f64,
) -> std::fmt::Result {
    let x = BARS.0 + BARS.1 * (square / greatest).min(1.0);
    let foot = below - 12.0;
    writeln!(out, "<path d=\"M{x:.1} 6V{foot:.0}\" stroke=\"{colour}\" stroke-dasharray=\"5 3\"/>")?;
    writeln!(
        out,
        "<text x=\"{x:.1}\" y=\"{below:.0}\" fill=\"{colour}\">{name} {:.4} mm</text>",
        square.sqrt()
    )
}

/// How many axes a row measures: residual vectors without an entry along an axis measured nothing there.
fn axes_measured(comparison: &Comparison) -> f64 {
    let along = |axis: usize| {
        comparison.rows.iter().any(|row| row.vector_mm.get(axis).is_some_and(|part| part.abs() > 0.0))
    };
    let count = (0..3).filter(|axis| along(*axis)).count();
    count.max(1) as f64
}

fn effects(out: &mut String, comparison: &Comparison) -> std::fmt::Result {
    if comparison.effects.is_empty() && comparison.residual_map.is_none() {
        return Ok(());
    }
    writeln!(
        out,
        "<h2>What is fitted</h2><table><tr><th>effect</th><th>size</th><th>&plusmn; one standard error</th><th></th></tr>"
    )?;
    for effect in &comparison.effects {
        let label = escaped(&effect.label);
        let mut remark = if effect.plausible { String::new() } else { "no real machine has that".to_owned() };
        if effect.claim == Claim::Correction {
            remark.push_str(&escaped(&format!(" correction: may be {}", listed(&effect.may_be, "or"))));
        }
        match effect.held {
            true => writeln!(
                out,
                "<tr><td>{label}</td><td>held</td><td></td><td class=\"faint\">these data cannot tell it from others</td></tr>"
            )?,
            false => writeln!(
                out,
                "<tr><td>{label}</td><td class=\"n\">{:.5}</td><td class=\"n\">{:.5} {}</td><td>{remark}</td></tr>",
                effect.size,
                effect.se,
                escaped(&effect.unit)
            )?,
        }
    }
    writeln!(out, "</table>")?;
    match &comparison.residual_map {
        Some(map) => writeln!(out, "<p>Besides, {}.</p>", escaped(&map.sentence())),
        None => Ok(()),
    }
}

fn candidates(out: &mut String, diagnosis: &Diagnosis) -> std::fmt::Result {
    if diagnosis.candidates.is_empty() {
        return Ok(());
    }
    writeln!(
        out,
        "<h2>What could explain the rest</h2><table><tr><th>effect</th><th>explains, mm</th><th>size</th><th></th></tr>"
    )?;
    for candidate in &diagnosis.candidates {
        let why = candidate.rejected.as_deref().unwrap_or("named");
        writeln!(
            out,
            "<tr><td>{}</td><td class=\"n\">{:.4}</td><td>{:.3e} &plusmn; {:.1e} {}</td><td>{}</td></tr>",
            escaped(&candidate.label),
            candidate.explains_mm,
            candidate.size,
            candidate.se,
            escaped(&candidate.unit),
            escaped(why)
        )?;
    }
    writeln!(out, "</table>")
}

fn next(out: &mut String, report: &Report) -> std::fmt::Result {
    let Some(next) = &report.next else { return Ok(()) };
    writeln!(out, "<h2>What to measure next</h2><p>{}</p><table>", escaped(&next.sentence))?;
    for (index, pose) in next.next.iter().enumerate() {
        let q: Vec<String> = pose.q_deg.iter().map(|q| format!("<td class=\"n\">{q:.2}</td>")).collect();
        writeln!(out, "<tr><td class=\"n\">{}</td>{}</tr>", index + 1, q.join(""))?;
    }
    writeln!(out, "</table>")
}
