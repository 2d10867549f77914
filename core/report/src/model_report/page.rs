//! The report as one HTML page with its drawings inside. The order is that of the questions: how large is the error, how much of it could be explained, where
//! is it, which effect is it, how sure is that, what did adding effects do.

use std::collections::HashSet;
use std::fmt::Write;

use super::error_picture;
use super::shown_rows::shown;
use super::tables::{
    all_rows, along_joints, candidates, effects, errors, groups, list, most_turned_rows, next,
    orientation_errors, story, worst_rows,
};
use crate::phrase::percent;
use crate::plot::{Links, Panel, effect_panel, escaped, grid, panels, space};
use crate::words::{
    alike_in_words, comparison_sentence, diagnosis_sentence, explainable_sentence, hypothesis_sentence,
    note_in_words,
};
use plumb_diagnosis::report::Report;

const STYLE: &str = "body{font:15px/1.5 sans-serif;max-width:64em;margin:2em auto;padding:0 1em;color:#222}\
table{border-collapse:collapse;margin:.6em 0}td,th{padding:.15em .8em .15em 0;text-align:left;vertical-align:top}\
td.n{text-align:right;font-variant-numeric:tabular-nums}.verdict{font-size:1.2em;padding:.7em 1em;background:#eef3f8;border-left:4px solid #1f5fa0}\
svg{max-width:100%;height:auto}th{border-bottom:1px solid #bbb}.faint{color:#666}.rows{max-height:28em;overflow:auto;font-size:.85em}tr:target{background:#ffe9b0}";

/// The report as one HTML page.
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
    writeln!(out, "<p class=\"verdict\">{}</p>", escaped(&diagnosis_sentence(&report.diagnosis)))?;
    let shown = shown(comparison);
    how_large(out, report)?;
    how_much(out, report)?;
    whereabouts(out, report, &shown)?;
    which_effect(out, report, &shown)?;
    how_sure(out, report)?;
    what_adding_did(out, report, &shown)?;
    writeln!(
        out,
        "<h2>What is left, against everything on record</h2>\n<p class=\"faint\">A dot is a row (hollow: held out, red ring: outside the range drawn) and leads to it; the green band is the noise.</p>\n{}",
        grid(&thinned(panels(comparison), &shown), &[], Links::Rows)
    )?;
    next(out, report)?;
    all_rows(out, comparison, &shown)?;
    writeln!(out, "</body></html>")
}

fn how_large(out: &mut String, report: &Report) -> std::fmt::Result {
    let comparison = &report.comparison;
    writeln!(
        out,
        "<h2>How large the error is</h2><p>{} {} rows were fitted with {} parameters, {} were held out.</p>",
        escaped(&comparison_sentence(comparison)),
        comparison.fit_rows,
        comparison.parameters,
        comparison.check_rows
    )?;
    errors(out, &comparison.error_mm, comparison.unit)?;
    orientation_errors(out, comparison.orientation_error_deg.as_ref())?;
    match (comparison.floor_of_a_point_mm, comparison.floor.sigma_mm) {
        (Some(point), Some(reading)) => writeln!(
            out,
            "<p>The noise of a point is {point:.4} {unit} ({reading:.4} {unit} a reading): with nothing wrong the RMS would be that.</p>",
            unit = comparison.unit
        ),
        _ => writeln!(out, "<p>The noise is not known: return to some poses, or declare it.</p>"),
    }
}

fn how_much(out: &mut String, report: &Report) -> std::fmt::Result {
    writeln!(out, "<h2>How much of it could be explained</h2>")?;
    match &report.comparison.explainable {
        Some(explainable) => {
            writeln!(out, "<p>{}.</p>", escaped(&explainable_sentence(explainable)))?;
            groups(out, explainable)
        }
        None => writeln!(out, "<p>Not asked: there are too few poses to leave any out.</p>"),
    }
}

fn whereabouts(out: &mut String, report: &Report, shown: &HashSet<u32>) -> std::fmt::Result {
    let comparison = &report.comparison;
    writeln!(out, "<h2>Where it is</h2>")?;
    if let Some(picture) = space(comparison, shown, Links::Rows) {
        writeln!(out, "{picture}")?;
    }
    along_joints(out, comparison)?;
    worst_rows(out, comparison)?;
    most_turned_rows(out, comparison)?;
    let far: Vec<String> = comparison.outliers.iter().take(40).map(|line| format!("line {line}")).collect();
    list(out, "Rows far outside the others' scatter (kept, with less weight)", &far)
}

/// The own plots of the candidates, or of what was added.
fn own_plots(report: &Report, added: bool, shown: &HashSet<u32>) -> Vec<Panel> {
    let requested = report.plots.iter().filter(|plot| plot.added == added);
    let panels = requested.map(|plot| {
        let mut panel = effect_panel(plot, &report.comparison);
        let [before, after] = plot.rms_mm;
        panel.title.push_str(&format!(": {before:.3} -> {after:.3} {}", plot.up.unit));
        panel
    });
    thinned(panels.collect(), shown)
}

/// The panels with no other points than of the rows that are shown.
fn thinned(mut panels: Vec<Panel>, shown: &HashSet<u32>) -> Vec<Panel> {
    for panel in &mut panels {
        panel.points.retain(|dot| shown.contains(&dot.line));
    }
    panels
}

fn plots(out: &mut String, panels: &[Panel]) -> std::fmt::Result {
    if panels.is_empty() {
        return Ok(());
    }
    writeln!(
        out,
        "<p class=\"faint\">What is left without an effect against what drives it, and (line) the effect as it is fitted; the numbers are the RMS about zero and about the line, at the lever \
         of a typical pose.</p>\n{}",
        grid(panels, &[], Links::Rows)
    )
}

fn which_effect(out: &mut String, report: &Report, shown: &HashSet<u32>) -> std::fmt::Result {
    writeln!(out, "<h2>Which effect could explain what is left</h2>")?;
    candidates(out, &report.diagnosis)?;
    plots(out, &own_plots(report, false, shown))
}

fn how_sure(out: &mut String, report: &Report) -> std::fmt::Result {
    let diagnosis = &report.diagnosis;
    writeln!(
        out,
        "<h2>How sure that is</h2><p class=\"sure\">{}</p>",
        escaped(&diagnosis_sentence(diagnosis))
    )?;
    if let Some(probability) = diagnosis.probability {
        writeln!(out, "<p>Probability that this is it: {}.</p>", percent(probability))?;
    }
    if let Some(left) = diagnosis.left_unexplained_mm {
        writeln!(
            out,
            "<p>With it in, {left:.4} {} besides the noise is still not explained.</p>",
            diagnosis.unit
        )?;
    }
    if let Some(hypothesis) = &diagnosis.hypothesis {
        writeln!(
            out,
            "<p>{}</p><pre>{}</pre>",
            escaped(&hypothesis_sentence(hypothesis)),
            escaped(&hypothesis.define)
        )?;
    }
    let alike: Vec<String> = diagnosis.alike.iter().map(alike_in_words).collect();
    list(out, "Effects that move these readings alike", &alike)?;
    let notes: Vec<String> = diagnosis.warnings.iter().map(note_in_words).collect();
    list(out, "Notes", &notes)
}

fn what_adding_did(out: &mut String, report: &Report, shown: &HashSet<u32>) -> std::fmt::Result {
    writeln!(out, "<h2>What adding effects did: the fall of the error</h2>")?;
    error_picture::draw(out, report)?;
    plots(out, &own_plots(report, true, shown))?;
    effects(out, &report.comparison)?;
    list(
        out,
        "Parameters that moved by more than two standard errors when the added effects came in",
        &report.moved,
    )?;
    story(out, &report.story)
}
