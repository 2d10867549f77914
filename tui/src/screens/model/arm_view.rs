//! The error in space: whiskers where the target was, on a drawing of the arm; each points to where the target was measured, many times enlarged. The worst
//! rows are marked with their lines of the table.

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::Color;
use ratatui::symbols::Marker;
use ratatui::text::{Line as TextLine, Span};
use ratatui::widgets::canvas::{Canvas, Circle, Line};

use super::chart::{Look, cell_of, ends_of_axis};
use super::plane::{plane_name, span};
use super::residuals::{AXES, Residuals};
use crate::screens::hits::{Hit, Hits};
use crate::screens::pane::{columns, fitted};
use crate::screens::theme::Theme;

/// Whiskers drawn at most; of more, every n-th. The worst are always among them.
const MOST_WHISKERS: usize = 150;

/// Worst rows marked with their lines.
const NUMBERED: usize = 3;

/// Length of a typical whisker, dots of the drawing.
const TYPICAL_LENGTH: f64 = 7.0;

/// What is drawn, and in which plane: two of the axes x, y, z.
pub(super) struct Scene<'a> {
    pub(super) residuals: &'a Residuals,
    pub(super) arm_mm: &'a [[f64; 3]],
    pub(super) plane: [usize; 2],
}

/// The error of a row, in the plane.
struct Whisker {
    row: usize,
    line: u32,
    at: (f64, f64),
    error: (f64, f64),
    /// Among the worst.
    numbered: bool,
}

/// Draws the arm and the whiskers.
pub(super) fn view(scene: &Scene, look: Look, theme: &Theme, hits: &Hits, frame: &mut Frame, area: Rect) {
    if area.height < 4 || area.width < 8 {
        return;
    }
    let in_plane = |point: &[f64; 3]| finite(*point.get(scene.plane[0])?, *point.get(scene.plane[1])?);
    let arm: Vec<(f64, f64)> = scene.arm_mm.iter().filter_map(&in_plane).collect();
    let whiskers = whiskers(scene.residuals, look.pointed, &in_plane);
    let points = || arm.iter().chain(whiskers.iter().map(|whisker| &whisker.at));
    let (Some((left, right)), Some((below, above))) =
        (span(points().map(|point| point.0)), span(points().map(|point| point.1)))
    else {
        return;
    };
    let body = Rect { y: area.y + 1, height: area.height - 2, ..area };
    let (across, up) = (2.0 * f64::from(body.width), 4.0 * f64::from(body.height));
    // One scale both ways, with some air.
    let dot = 1.1 * ((right - left) / across).max((above - below) / up).max(1e-9);
    let (middle_x, middle_y) = (f64::midpoint(left, right), f64::midpoint(below, above));
    let times = magnification(TYPICAL_LENGTH * dot / scene.residuals.typical_mm().max(1e-12));
    let x = [middle_x - 0.5 * dot * across, middle_x + 0.5 * dot * across];
    let y = [middle_y - 0.5 * dot * up, middle_y + 0.5 * dot * up];
    let machine = theme.machine.fg.unwrap_or(Color::Reset);
    let canvas = Canvas::default().marker(Marker::Braille).x_bounds(x).y_bounds(y).paint(|context| {
        for whisker in &whiskers {
            context.draw(&drawn(whisker, times, dot, look));
        }
        context.layer();
        for (from, to) in arm.iter().zip(arm.iter().skip(1)) {
            context.draw(&Line { x1: from.0, y1: from.1, x2: to.0, y2: to.1, color: machine });
        }
        for (x, y) in &arm {
            context.draw(&Circle { x: *x, y: *y, radius: 1.2 * dot, color: machine });
        }
        context.layer();
        for whisker in whiskers.iter().filter(|whisker| whisker.numbered) {
            let style = if Some(whisker.row) == look.pointed { look.mark } else { theme.bad };
            context.print(whisker.at.0, whisker.at.1, TextLine::styled(whisker.line.to_string(), style));
        }
    });
    frame.render_widget(canvas, body);
    note_hits(&whiskers, (x, y), body, hits);
    titles(scene, times, ((left, right), (below, above)), theme, frame, area);
}

/// Notes where each row can be clicked.
fn note_hits(whiskers: &[Whisker], (x, y): ([f64; 2], [f64; 2]), body: Rect, hits: &Hits) {
    // What is marked lies over the others.
    let (marked, others): (Vec<_>, Vec<_>) = whiskers.iter().partition(|whisker| whisker.numbered);
    for whisker in others.into_iter().chain(marked) {
        match whisker.numbered {
            true => hits.note(label_of(whisker, (x, y), body), Hit::Row(whisker.row)),
            false => {
                if let Some(cell) = cell_of(whisker.at, (x, y), body) {
                    hits.note(cell, Hit::Row(whisker.row));
                }
            }
        }
    }
}

/// Over and below the drawing: what it shows, and what it spans, mm.
fn titles(
    scene: &Scene,
    times: f64,
    ((left, right), (below, above)): ((f64, f64), (f64, f64)),
    theme: &Theme,
    frame: &mut Frame,
    area: Rect,
) {
    let head = Rect { height: 1, ..area };
    let foot = Rect { y: area.bottom() - 1, height: 1, ..area };
    let title = format!("error in space \u{d7}{times:.0}, {}", plane_name(scene.plane));
    frame.render_widget(Span::styled(fitted(&title, usize::from(area.width)), theme.heading), head);
    let axis = |index: usize| AXES.get(scene.plane[index]).copied().unwrap_or("");
    let [left, right] = ends_of_axis(left, right);
    let [below, above] = ends_of_axis(below, above);
    let ends =
        format!("{} {left}\u{2026}{right}, {} {below}\u{2026}{above} mm; numbers: rows", axis(0), axis(1));
    frame.render_widget(Span::styled(fitted(&ends, usize::from(area.width)), theme.faint), foot);
}

/// Where the canvas prints the number of a row.
fn label_of(whisker: &Whisker, (x, y): ([f64; 2], [f64; 2]), body: Rect) -> Rect {
    let ((across, up), width) = (whisker.at, columns(&whisker.line.to_string()));
    let column = (across - x[0]) / (x[1] - x[0]) * f64::from(body.width.saturating_sub(1));
    let row = (y[1] - up) / (y[1] - y[0]) * f64::from(body.height.saturating_sub(1));
    // Both lie within the body, so the casts are exact.
    let (column, row) = (body.x + column.max(0.0) as u16, body.y + row.max(0.0) as u16);
    let room = body.right().saturating_sub(column);
    Rect { x: column, y: row, width: u16::try_from(width).unwrap_or(room).min(room), height: 1 }
}

/// A whisker as a line. A gross error does not strike through the whole drawing.
fn drawn(whisker: &Whisker, times: f64, dot: f64, look: Look) -> Line {
    let ((x, y), (across, up)) = (whisker.at, whisker.error);
    let most = 6.0 * TYPICAL_LENGTH * dot;
    let length = (times * across.hypot(up)).max(1e-12);
    let cut = (most / length).min(1.0);
    Line {
        x1: x,
        y1: y,
        x2: x + cut * times * across,
        y2: y + cut * times * up,
        color: if cut < 1.0 { look.outside } else { look.points },
    }
}

/// Two coordinates that can be drawn.
fn finite(across: f64, up: f64) -> Option<(f64, f64)> {
    (across.is_finite() && up.is_finite()).then_some((across, up))
}

/// Where errors sit and which way they point, in a plane; of many every n-th, the worst, and the one that is pointed out.
fn whiskers(
    residuals: &Residuals,
    pointed: Option<usize>,
    in_plane: &impl Fn(&[f64; 3]) -> Option<(f64, f64)>,
) -> Vec<Whisker> {
    let every = residuals.rows.len().div_ceil(MOST_WHISKERS).max(1);
    let worst: Vec<usize> = residuals.worst().into_iter().take(NUMBERED).collect();
    let rows = residuals.rows.iter().enumerate().filter_map(|(index, row)| {
        let numbered = worst.contains(&row.row) || pointed == Some(row.row);
        (numbered || index % every == 0).then_some((row, numbered))
    });
    rows.filter_map(|(row, numbered)| {
        let (at, error) = (in_plane(&row.point_mm)?, in_plane(&row.vector_mm)?);
        Some(Whisker { row: row.row, line: row.line, at, error, numbered })
    })
    .collect()
}

/// The round magnification below `wanted`: 1, 2 or 5 times a power of ten.
fn magnification(requested: f64) -> f64 {
    if !requested.is_finite() || requested <= 0.0 {
        return 1.0;
    }
    let power = 10_f64.powf(requested.log10().floor());
    [5.0, 2.0, 1.0].into_iter().map(|step| step * power).find(|step| *step <= requested).unwrap_or(power)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn magnifications_are_round() {
        assert_eq!(magnification(7.3), 5.0);
        assert_eq!(magnification(430.0), 200.0);
        assert!((magnification(0.15) - 0.1).abs() < 1e-12);
        assert_eq!(magnification(f64::NAN), 1.0);
    }
}
