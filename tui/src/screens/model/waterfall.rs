//! What adding effects did: the error of a measured point, mm, from the bare model through each effect. Mechanisms are solid, corrections and a residual map
//! hatched; the end of a whisker is what is left where nothing was fitted. The noise of a point and what no function of what is known of a row predicts are
//! lines across all bars.

use plumb_diagnosis::report::StepKind;
use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::Style;
use ratatui::text::{Line, Span};
use ratatui::widgets::Paragraph;

use super::state::{ErrorStep, ModelState, ModelSummary};
use crate::screens::pane::{self, columns, fitted, wrapped};
use crate::screens::theme::Theme;

/// What fills a bar: mechanisms, and what has a correction in.
const SOLID: &str = "\u{2588}";
const HATCHED: &str = "\u{2592}";

/// The lines across the bars: the noise, and what is not predictable.
const NOISE: &str = "\u{2502}";
const BOUND: &str = "\u{250a}";

/// Length of a bar in columns per millimetre, and the two lines.
struct Scale {
    greatest_mm: f64,
    width: usize,
    noise_mm: Option<f64>,
    bound_mm: Option<f64>,
}

impl Scale {
    /// The column in which an error ends, from 0; the last for the greatest.
    fn column(&self, error_mm: f64) -> usize {
        let fraction =
            if self.greatest_mm > 0.0 { (error_mm / self.greatest_mm).clamp(0.0, 1.0) } else { 0.0 };
        // At most the width of a terminal, so the cast is exact.
        (fraction * self.width.saturating_sub(1) as f64).round() as usize
    }
}

/// Draws the fall.
pub(crate) fn view(model: &ModelState, theme: &Theme, frame: &mut Frame, area: Rect) {
    let inner = pane::open(frame, area, theme, &format!("RMS of a point, {}", model.reading_unit()), false);
    let Some(summary) = &model.summary else { return };
    let width = usize::from(inner.width);
    let scale = scale(summary, width);
    let mut lines = Vec::new();
    let mut hatched = false;
    for step in &summary.error_steps {
        hatched |= matches!(step.kind, StepKind::Correction | StepKind::ResidualMap);
        lines.extend(step_lines(step, hatched, &scale, theme));
    }
    if let Some(preview) = &model.preview {
        let step = ErrorStep {
            added: format!("? {}", preview.candidate),
            kind: StepKind::Mechanism,
            fit_mm: preview.rms_mm,
            cross_validation_mm: None,
        };
        lines.extend(step_lines(&step, hatched, &scale, theme).map(|line| in_style(line, theme.preview)));
    }
    let legend = legend(summary, hatched, (width, inner.height), theme);
    let next = next_lines(summary, width, theme);
    // The newest steps and the noise stay where room is short.
    let height = usize::from(inner.height);
    let next = if lines.len() + legend.len() + next.len() <= height { next } else { Vec::new() };
    let room = height.saturating_sub(legend.len() + next.len());
    let cut = lines.len().saturating_sub(room);
    let mut shown: Vec<Line> = lines.into_iter().skip(cut).collect();
    shown.extend(legend);
    shown.extend(next);
    frame.render_widget(Paragraph::new(shown), inner);
}

fn scale(summary: &ModelSummary, width: usize) -> Scale {
    let errors =
        summary.error_steps.iter().flat_map(|step| [Some(step.fit_mm), step.cross_validation_mm]).flatten();
    let lines = [summary.floor_of_a_point_mm, summary.not_predictable_mm];
    let all = errors.chain(lines.into_iter().flatten()).filter(|error| error.is_finite());
    Scale {
        greatest_mm: all.fold(0.0, f64::max),
        width,
        noise_mm: summary.floor_of_a_point_mm,
        bound_mm: summary.not_predictable_mm,
    }
}

/// The poses to measure next, where the lab asks for some.
fn next_lines(summary: &ModelSummary, width: usize, theme: &Theme) -> Vec<Line<'static>> {
    if summary.next.is_empty() {
        return Vec::new();
    }
    let heads = [Line::default(), Line::styled("measure next, deg", theme.heading)].into_iter();
    let poses = summary.next.iter().map(|pose| Line::styled(fitted(pose, width), theme.text));
    heads.chain(poses).collect()
}

/// Rows of the pane from which the legend says all.
const ROOM_FOR_LEGEND: u16 = 18;

/// What the signs mean, and the errors at which the lines are; in a small pane only the latter.
fn legend(
    summary: &ModelSummary,
    hatched: bool,
    (width, height): (usize, u16),
    theme: &Theme,
) -> Vec<Line<'static>> {
    let roomy = height >= ROOM_FOR_LEGEND;
    let mut lines = Vec::new();
    let mut push = |text: String, style: Style| {
        lines.extend(wrapped(&text, width).into_iter().map(|line| Line::styled(line, style)));
    };
    match (summary.floor_of_a_point_mm, summary.floor_mm) {
        (Some(point), Some(reading)) if roomy => push(
            format!("{NOISE} noise of a point {point:.4} ({reading:.4} a reading, {})", summary.floor_source),
            theme.good,
        ),
        (Some(point), _) => push(format!("{NOISE} noise {point:.4}"), theme.good),
        _ => push("noise unknown: no repeats, none declared".to_owned(), theme.good),
    }
    if let Some(bound) = summary.not_predictable_mm {
        push(format!("{BOUND} not predictable {bound:.4}"), theme.preview);
    }
    if !roomy {
        return lines;
    }
    let correction = if hatched { format!(", {HATCHED} with corrections") } else { String::new() };
    let validated = match summary.error_steps.iter().any(|step| step.cross_validation_mm.is_some()) {
        true => ", \u{2524} cross-validation",
        false => "",
    };
    push(format!("{SOLID} fit{correction}{validated}"), theme.faint);
    lines
}

/// A line all in one style, but for the lines across.
fn in_style(mut line: Line<'static>, style: Style) -> Line<'static> {
    let is_line = |span: &Span| span.content == NOISE || span.content == BOUND;
    line.iter_mut().filter(|span| !is_line(span)).for_each(|span| span.style = style);
    line
}

fn step_lines(step: &ErrorStep, hatched: bool, scale: &Scale, theme: &Theme) -> [Line<'static>; 2] {
    let fit = format!("{:.4}", step.fit_mm);
    let validated = step.cross_validation_mm.map_or_else(String::new, |error| format!("\u{2524}{error:.4}"));
    let numbers = format!("{fit}{validated}");
    let label = fitted(&step.added, scale.width.saturating_sub(columns(&numbers) + 1));
    let gap = scale.width.saturating_sub(columns(&label) + columns(&numbers));
    [
        Line::from(vec![
            Span::styled(label, theme.heading),
            Span::styled(format!("{:gap$}{fit}", ""), theme.text),
            Span::styled(validated, theme.faint),
        ]),
        bar(step, hatched, scale, theme),
    ]
}

/// The bar of a step, column by column.
fn bar(step: &ErrorStep, hatched: bool, scale: &Scale, theme: &Theme) -> Line<'static> {
    let fill = if hatched { HATCHED } else { SOLID };
    let fit = scale.column(step.fit_mm);
    let validated = step.cross_validation_mm.map(|error| scale.column(error)).filter(|end| *end > fit);
    let noise = scale.noise_mm.map(|error| scale.column(error));
    let bound = scale.bound_mm.map(|error| scale.column(error));
    let last = [Some(fit), validated, noise, bound].into_iter().flatten().max().unwrap_or(0);
    let cell = |column: usize| -> Span<'static> {
        if Some(column) == noise {
            Span::styled(NOISE, theme.good)
        } else if Some(column) == bound {
            Span::styled(BOUND, theme.preview)
        } else if column <= fit {
            Span::styled(fill, theme.measured)
        } else {
            match validated {
                Some(end) if column == end => Span::styled("\u{2524}", theme.measured),
                Some(end) if column < end => Span::styled("\u{2500}", theme.measured),
                _ => Span::raw(" "),
            }
        }
    };
    (0..=last.min(scale.width.saturating_sub(1))).map(cell).collect()
}
