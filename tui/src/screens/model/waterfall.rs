//! The fall of the error from the bare model through each effect to the floor, in variance, because root mean squares do
//! not add. What is fitted is solid, what is left where nothing was fitted is hollow.

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::Style;
use ratatui::text::{Line, Span};
use ratatui::widgets::Paragraph;

use super::state::{FallStep, ModelState, Standing};
use crate::screens::pane::{self, columns, fitted};
use crate::screens::theme::Theme;

/// Draws the fall.
pub(crate) fn view(model: &ModelState, theme: &Theme, frame: &mut Frame, area: Rect) {
    let inner = pane::open(frame, area, theme, "Error left, mm\u{b2}", false);
    let Some(standing) = &model.standing else { return };
    let width = usize::from(inner.width);
    let greatest = standing
        .fall
        .iter()
        .flat_map(|step| [step.fit_mm2, step.held_out_mm2.unwrap_or(0.0)])
        .filter(|value| value.is_finite())
        .fold(0.0, f64::max);
    let legend = Line::from(vec![
        Span::styled("\u{2588}", theme.measured),
        Span::styled(" fit ", theme.faint),
        Span::styled("\u{2591}", theme.measured),
        Span::styled(" held out", theme.faint),
    ]);
    let numbers = Line::styled(format!("{:>width$}", "RMS mm"), theme.faint);
    let mut lines = vec![legend, numbers];
    for step in &standing.fall {
        lines.extend(step_lines(step, greatest, width, theme));
    }
    if let Some(preview) = &model.preview {
        let step = FallStep {
            added: format!("? {}", preview.candidate),
            fit_mm2: preview.rms_mm * preview.rms_mm,
            held_out_mm2: None,
        };
        lines.extend(step_lines(&step, greatest, width, theme).map(|line| in_style(line, theme.preview)));
    }
    let mut floor = bound_lines(standing, greatest, width, theme);
    floor.extend(floor_lines(standing, greatest, width, theme));
    let next = next_lines(standing, width, theme);
    // The newest steps and the floor stay where room is short.
    let next =
        if lines.len() + floor.len() + next.len() <= usize::from(inner.height) { next } else { Vec::new() };
    let room = usize::from(inner.height).saturating_sub(floor.len() + next.len());
    let cut = lines.len().saturating_sub(room);
    let mut shown: Vec<Line> = lines.into_iter().skip(cut).collect();
    shown.extend(floor);
    shown.extend(next);
    frame.render_widget(Paragraph::new(shown), inner);
}

/// The poses to measure next, where the lab asks for some.
fn next_lines(standing: &Standing, width: usize, theme: &Theme) -> Vec<Line<'static>> {
    if standing.next.is_empty() {
        return Vec::new();
    }
    let heads = [Line::default(), Line::styled("measure next, deg", theme.heading)].into_iter();
    let poses = standing.next.iter().map(|pose| Line::styled(fitted(pose, width), theme.text));
    heads.chain(poses).collect()
}

/// What no function of pose, moves and conditions predicts, as a bar beside the others.
fn bound_lines(standing: &Standing, greatest: f64, width: usize, theme: &Theme) -> Vec<Line<'static>> {
    let Some(bound) = standing.not_predictable_mm else { return Vec::new() };
    let step = FallStep { added: "not predictable".to_owned(), fit_mm2: bound * bound, held_out_mm2: None };
    step_lines(&step, greatest, width, theme).map(|line| in_style(line, theme.preview)).into()
}

/// The floor as a bar beside the others, and where it comes from. Residuals are lengths in space where more than one axis
/// was measured, and so is the floor then.
fn floor_lines(standing: &Standing, greatest: f64, width: usize, theme: &Theme) -> Vec<Line<'static>> {
    let words = |text: &str| {
        let lines = pane::wrapped(text, width).into_iter();
        lines.map(|line| Line::styled(line, theme.good)).collect::<Vec<_>>()
    };
    let Some(floor) = standing.floor_mm else { return words("floor unknown: no repeats, none declared") };
    let axes = standing.residuals.axes().max(1);
    let square = floor * floor * axes as f64;
    let step = FallStep { added: "noise floor".to_owned(), fit_mm2: square, held_out_mm2: None };
    let mut lines: Vec<Line> =
        step_lines(&step, greatest, width, theme).map(|line| in_style(line, theme.good)).into();
    let each = if axes > 1 { format!("{floor:.4} mm an axis, ") } else { String::new() };
    lines.extend(words(&format!("{each}{}", standing.floor_source)));
    lines
}

/// A line all in one style.
fn in_style(mut line: Line<'static>, style: Style) -> Line<'static> {
    line.iter_mut().for_each(|span| span.style = style);
    line
}

fn step_lines(step: &FallStep, greatest: f64, width: usize, theme: &Theme) -> [Line<'static>; 2] {
    let rms = |square: f64| format!("{:.4}", square.max(0.0).sqrt());
    let (fit, held_out) = (rms(step.fit_mm2), step.held_out_mm2.map_or_else(String::new, rms));
    let label = fitted(&step.added, width.saturating_sub(columns(&fit) + 1));
    let gap = width.saturating_sub(columns(&label) + columns(&fit));
    let room = width.saturating_sub(columns(&fit) + 1);
    let (solid, hollow) = bar(step, greatest, room);
    let rest = width.saturating_sub(columns(&solid) + columns(&hollow));
    [
        Line::from(vec![
            Span::styled(label, theme.heading),
            Span::styled(format!("{:gap$}{fit}", ""), theme.text),
        ]),
        Line::from(vec![
            Span::styled(solid, theme.measured),
            Span::styled(hollow, theme.measured),
            Span::styled(format!("{held_out:>rest$}"), theme.faint),
        ]),
    ]
}

/// The solid and the hollow part of a bar, in eighths of a column.
fn bar(step: &FallStep, greatest: f64, width: usize) -> (String, String) {
    const EIGHTHS: [&str; 8] =
        ["", "\u{258f}", "\u{258e}", "\u{258d}", "\u{258c}", "\u{258b}", "\u{258a}", "\u{2589}"];
    let eighths = |value: f64| {
        let share = if greatest > 0.0 { (value / greatest).clamp(0.0, 1.0) } else { 0.0 };
        // At most eight times the width of a terminal, so the cast is exact.
        (share * width as f64 * 8.0).round() as usize
    };
    let fit = eighths(step.fit_mm2);
    let mut solid = "\u{2588}".repeat(fit / 8);
    solid.push_str(EIGHTHS.get(fit % 8).copied().unwrap_or(""));
    if solid.is_empty() && step.fit_mm2 > 0.0 {
        solid.push_str(EIGHTHS[1]);
    }
    let held_out = step.held_out_mm2.map_or(0, eighths).div_ceil(8);
    let hollow = "\u{2591}".repeat(held_out.saturating_sub(columns(&solid)));
    (solid, hollow)
}
