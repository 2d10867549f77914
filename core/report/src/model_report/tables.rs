//! The tables of a report.

use std::collections::HashSet;
use std::fmt::Write;

use super::shown_rows::{most_turned, worst};
use crate::phrase::{figure, is_determined, listed, percent};
use crate::plot::escaped;
use crate::words::{map_in_words, next_poses_sentence, rejection_in_words, why_held_in_words};
use plumb_calibration::effect::Unit;
use plumb_calibration::measurement::ReadingUnit;
use plumb_diagnosis::laboratory::{
    Comparison, EffectValue, ErrorSummary, Errors, OrientationErrors, RowResidual,
};
use plumb_diagnosis::report::{Chapter, Report};
use plumb_diagnosis::{Claim, Diagnosis, Explainable};

/// The error of one measured point where the model was fitted and where it was not.
pub(super) fn errors(out: &mut String, errors: &Errors, unit: ReadingUnit) -> std::fmt::Result {
    writeln!(
        out,
        "<table><tr><th>error of a point, {unit}</th><th>RMS</th><th>mean</th><th>95 %</th><th>maximum</th><th>points</th></tr>"
    )?;
    let parts = [
        ("where it was fitted", Some(errors.fit)),
        ("cross-validation", errors.cv),
        ("held out", errors.check),
    ];
    for (name, summary) in parts {
        let Some(ErrorSummary { points, rms, mean, percentile_95, max }) = summary else { continue };
        let cells = [rms, mean, percentile_95, max].map(|value| format!("<td class=\"n\">{value:.4}</td>"));
        writeln!(out, "<tr><td>{name}</td>{}<td class=\"n\">{points}</td></tr>", cells.join(""))?;
    }
    writeln!(out, "</table>")
}

/// The same of measured orientations; nothing where none was measured.
pub(super) fn orientation_errors(out: &mut String, errors: Option<&OrientationErrors>) -> std::fmt::Result {
    let Some(errors) = errors else { return Ok(()) };
    writeln!(
        out,
        "<table><tr><th>error of an orientation or angle, deg</th><th>RMS</th><th>mean</th><th>95 %</th><th>maximum</th><th>readings</th></tr>"
    )?;
    for (name, summary) in [("where it was fitted", Some(&errors.fit)), ("held out", errors.check.as_ref())] {
        let Some(ErrorSummary { points, rms, mean, percentile_95, max }) = summary else { continue };
        let cells = [rms, mean, percentile_95, max].map(|value| format!("<td class=\"n\">{value:.5}</td>"));
        writeln!(out, "<tr><td>{name}</td>{}<td class=\"n\">{points}</td></tr>", cells.join(""))?;
    }
    writeln!(out, "</table>")
}

/// What each kind of knowledge of a row predicts of unseen rows.
pub(super) fn groups(out: &mut String, explainable: &Explainable) -> std::fmt::Result {
    writeln!(
        out,
        "<table><tr><th>known of a row</th><th>left with it and those above, {unit}</th><th>rise without it alone, {unit}</th><th>&plusmn; one standard error</th></tr>",
        unit = explainable.unit
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

/// What is left along the motion of each joint.
pub(super) fn along_joints(out: &mut String, comparison: &Comparison) -> std::fmt::Result {
    if comparison.along_joints.is_empty() {
        return Ok(());
    }
    writeln!(out, "<table><tr><th>joint</th><th>left along its motion, {} RMS</th></tr>", comparison.unit)?;
    for joint in &comparison.along_joints {
        writeln!(out, "<tr><td>{}</td><td class=\"n\">{:.4}</td></tr>", escaped(&joint.joint), joint.rms_mm)?;
    }
    writeln!(out, "</table>")
}

/// The head of a table of rows.
fn head_of_rows(out: &mut String, comparison: &Comparison) -> std::fmt::Result {
    let joints =
        comparison.joints.iter().map(|joint| format!("<th>{}, {}</th>", escaped(&joint.name), joint.unit));
    writeln!(
        out,
        "<table><tr><th>line</th><th>error, {}</th>{}{}<th>at x, mm</th><th>y</th><th>z</th>{}<th></th></tr>",
        comparison.unit,
        if turns(comparison) { "<th>turned, deg</th>" } else { "" },
        if is_in_space(comparison) { "<th>along x, mm</th><th>y</th><th>z</th>" } else { "" },
        joints.collect::<String>()
    )
}

/// Whether orientations were measured.
fn turns(comparison: &Comparison) -> bool {
    comparison.orientation_error_deg.is_some()
}

/// Whether an error has a direction in space: angles and distances have none.
fn is_in_space(comparison: &Comparison) -> bool {
    comparison.rows.iter().any(|row| row.vector_mm != [0.0; 3])
}

/// A number's cell, with so many digits after the point.
fn cell(value: f64, digits: usize) -> String {
    format!("<td class=\"n\">{value:.digits$}</td>")
}

/// The same where there is a number; else an empty one.
fn cell_if_known(value: Option<f64>, digits: usize) -> String {
    value.map_or_else(|| "<td></td>".to_owned(), |value| cell(value, digits))
}

fn row_cells(row: &RowResidual, comparison: &Comparison) -> String {
    let mut cells = cell_if_known(row.size, 4);
    if turns(comparison) {
        cells.push_str(&cell_if_known(row.size_deg, 5));
    }
    if is_in_space(comparison) {
        cells.extend(row.vector_mm.iter().map(|part| cell(*part, 4)));
    }
    cells.extend(row.point_mm.iter().map(|part| cell(*part, 1)));
    cells.extend(row.joints.iter().map(|joint| cell(*joint, 2)));
    let mut remarks = Vec::new();
    if row.held_out {
        remarks.push("held out".to_owned());
    }
    // What would be shown as 1.00 is no remark.
    if row.weight < 0.995 {
        remarks.push(format!("weight {:.2}", row.weight));
    }
    cells.push_str(&format!("<td>{}</td>", remarks.join(", ")));
    cells
}

/// The rows with the largest error, each leading to its place in the table of all rows.
pub(super) fn worst_rows(out: &mut String, comparison: &Comparison) -> std::fmt::Result {
    let rows = worst(comparison);
    if rows.is_empty() {
        return Ok(());
    }
    writeln!(out, "<h3>The worst rows</h3><div class=\"rows\">")?;
    head_of_rows(out, comparison)?;
    for row in rows {
        writeln!(
            out,
            "<tr><td class=\"n\"><a href=\"#line-{0}\">{0}</a></td>{1}</tr>",
            row.line,
            row_cells(row, comparison)
        )?;
    }
    writeln!(out, "</table></div>")
}

/// The rows whose orientation is farthest off; nothing where none was measured.
pub(super) fn most_turned_rows(out: &mut String, comparison: &Comparison) -> std::fmt::Result {
    let rows = most_turned(comparison);
    if rows.is_empty() {
        return Ok(());
    }
    writeln!(out, "<h3>The rows turned farthest</h3><div class=\"rows\">")?;
    head_of_rows(out, comparison)?;
    for row in rows {
        let line = row.line;
        writeln!(
            out,
            "<tr><td class=\"n\"><a href=\"#line-{line}\">{line}</a></td>{}</tr>",
            row_cells(row, comparison)
        )?;
    }
    writeln!(out, "</table></div>")
}

/// Every row of the table that is shown: where points of the plots lead.
pub(super) fn all_rows(out: &mut String, comparison: &Comparison, shown: &HashSet<u32>) -> std::fmt::Result {
    writeln!(
        out,
        "<h2>Every row</h2><p>Line of {}, what was measured less what the model predicts, and the pose.</p><div class=\"rows\">",
        escaped(&comparison.data)
    )?;
    head_of_rows(out, comparison)?;
    for row in comparison.rows.iter().filter(|row| shown.contains(&row.line)) {
        writeln!(
            out,
            "<tr id=\"line-{0}\"><td class=\"n\">{0}</td>{1}</tr>",
            row.line,
            row_cells(row, comparison)
        )?;
    }
    writeln!(out, "</table></div>")?;
    match comparison.rows.len().saturating_sub(shown.len()) {
        0 => Ok(()),
        more => writeln!(
            out,
            "<p class=\"faint\">{more} rows more are neither drawn nor listed: of so many, some spread evenly and the worst are.</p>"
        ),
    }
}

/// A list under a heading; nothing where it is empty.
pub(super) fn list(out: &mut String, heading: &str, lines: &[String]) -> std::fmt::Result {
    if lines.is_empty() {
        return Ok(());
    }
    writeln!(out, "<h3>{}</h3><ul>", escaped(heading))?;
    for line in lines {
        writeln!(out, "<li>{}</li>", escaped(line))?;
    }
    writeln!(out, "</ul>")
}

/// The revisions.
pub(super) fn story(out: &mut String, story: &[Chapter]) -> std::fmt::Result {
    if story.len() < 2 {
        return Ok(());
    }
    writeln!(
        out,
        "<h3>The story so far</h3><table><tr><th>revision</th><th>what was done</th><th>RMS</th></tr>"
    )?;
    for chapter in story {
        let rms = chapter.rms.map_or_else(String::new, |rms| rms.to_string());
        let did = escaped(&chapter.did);
        writeln!(
            out,
            "<tr><td class=\"n\">{}</td><td>{did}</td><td class=\"n\">{rms}</td></tr>",
            chapter.number
        )?;
    }
    writeln!(out, "</table>")
}

/// What is said of a fitted effect besides its size.
fn remark(effect: &EffectValue) -> String {
    let mut remarks = Vec::new();
    if !effect.plausible {
        remarks.push("implausible value".to_owned());
    }
    if effect.claim == Claim::Correction {
        remarks.push(format!("correction: may be {}", listed(&effect.may_be, "or")));
    } else if effect.added {
        remarks.push("added".to_owned());
    }
    escaped(&remarks.join("; "))
}

/// Why an effect is not estimated.
fn why_held(effect: &EffectValue) -> String {
    let why = effect.held_because.as_ref().map(why_held_in_words);
    why.unwrap_or_else(|| "these rows cannot distinguish it from others".to_owned())
}

/// What is fitted, with its sizes.
pub(super) fn effects(out: &mut String, comparison: &Comparison) -> std::fmt::Result {
    if comparison.effects.is_empty() && comparison.residual_map.is_none() {
        return Ok(());
    }
    writeln!(
        out,
        "<h3>What is fitted</h3><table><tr><th>effect</th><th>size</th><th>&plusmn; one standard error</th><th></th></tr>"
    )?;
    for effect in &comparison.effects {
        let label = escaped(&effect.label);
        match effect.held {
            true => writeln!(
                out,
                "<tr><td>{label}</td><td>not estimated</td><td></td><td class=\"faint\">{}</td></tr>",
                escaped(&why_held(effect))
            )?,
            false => writeln!(
                out,
                "<tr><td>{label}</td><td class=\"n\">{}</td><td class=\"n\">{}</td><td>{}</td></tr>",
                figure(effect.size),
                error_text(effect.se, &effect.unit),
                remark(effect)
            )?,
        }
    }
    writeln!(out, "</table>")?;
    match &comparison.residual_map {
        Some(map) => writeln!(out, "<p>Besides, {}.</p>", escaped(&map_in_words(map))),
        None => Ok(()),
    }
}

/// A standard error with its unit; a ratio has none.
fn error_text(error: f64, unit: &str) -> String {
    if !is_determined(error) {
        return "not determined".to_owned();
    }
    if unit == Unit::RATIO.name { figure(error) } else { format!("{} {}", figure(error), escaped(unit)) }
}

/// What could explain the rest.
pub(super) fn candidates(out: &mut String, diagnosis: &Diagnosis) -> std::fmt::Result {
    if diagnosis.candidates.is_empty() {
        return writeln!(out, "<p>No effect of the library explains more than chance would.</p>");
    }
    writeln!(
        out,
        "<table><tr><th>effect</th><th>explains, {}</th><th>size</th><th>probability</th><th>p (Holm)</th><th></th></tr>",
        diagnosis.unit
    )?;
    for candidate in &diagnosis.candidates {
        let why = candidate.rejected.as_ref().map_or_else(|| "named".to_owned(), rejection_in_words);
        let probability = candidate.probability.map_or_else(String::new, percent);
        writeln!(
            out,
            "<tr><td>{}</td><td class=\"n\">{:.4}</td><td>{} &plusmn; {}</td><td class=\"n\">{probability}</td><td class=\"n\">{}</td><td>{}</td></tr>",
            escaped(&candidate.label),
            candidate.explains_mm,
            figure(candidate.size),
            error_text(candidate.se, &candidate.unit),
            figure(candidate.holm_p),
            escaped(&why)
        )?;
    }
    writeln!(out, "</table>")
}

/// The poses to measure next.
pub(super) fn next(out: &mut String, report: &Report) -> std::fmt::Result {
    let Some(next) = &report.next else { return Ok(()) };
    let joints = report
        .comparison
        .joints
        .iter()
        .map(|joint| format!("<th>{}, {}</th>", escaped(&joint.name), joint.unit));
    writeln!(
        out,
        "<h2>What to measure next</h2><p>{}</p><table><tr><th></th>{}</tr>",
        escaped(&next_poses_sentence(next)),
        joints.collect::<String>()
    )?;
    for (index, pose) in next.next.iter().enumerate() {
        let q: Vec<String> = pose.q_deg.iter().map(|q| format!("<td class=\"n\">{q:.2}</td>")).collect();
        writeln!(out, "<tr><td class=\"n\">{}</td>{}</tr>", index + 1, q.join(""))?;
    }
    writeln!(out, "</table>")
}
