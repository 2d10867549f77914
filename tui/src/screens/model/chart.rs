//! One chart: points, the noise, a fitted curve, both axes with what they show and their ends. What lies outside is drawn on the rim and counted, so that one
//! gross error squashes nothing. Every point can be clicked, and leads to its row.

use std::collections::HashMap;

use ratatui::Frame;
use ratatui::layout::{Position, Rect};
use ratatui::style::{Color, Style};
use ratatui::symbols::Marker;
use ratatui::text::{Line as TextLine, Span};
use ratatui::widgets::canvas::{Canvas, Circle, Context, Line, Points};

use crate::screens::hits::{Hit, Hits};
use crate::screens::pane::{columns, fitted};
use crate::screens::theme::Theme;

/// Columns for the numbers of the vertical axis.
const GUTTER: u16 = 7;

/// The least width with a gutter, and the least height with a horizontal axis.
const ROOM_FOR_AXES: (u16, u16) = (24, 4);

/// The least height at which titles that need it get a row of their own.
const ROOM_FOR_TITLES: u16 = 9;

/// The mark of the row that is pointed out.
const POINTED: &str = "\u{25c6}";

/// Colours of what a chart shows, and the row that is pointed out.
#[derive(Clone, Copy)]
pub(super) struct Look {
    pub(super) points: Color,
    pub(super) curve: Color,
    pub(super) floor: Color,
    pub(super) axis: Color,
    pub(super) outside: Color,
    pub(super) mark: Style,
    /// The row that is pointed out.
    pub(super) pointed: Option<usize>,
}

/// What a chart shows.
pub(super) struct Chart<'a> {
    /// What it is of, over the vertical axis' title; empty where that says it.
    pub(super) heading: String,
    /// What goes up, with its unit.
    pub(super) title: String,
    /// What goes across, with its unit.
    pub(super) across: String,
    /// Ends of the horizontal axis; nothing where it has the scale of the vertical one.
    pub(super) x: Option<[f64; 2]>,
    /// Ends of the vertical axis.
    pub(super) y: [f64; 2],
    /// Across, up, row.
    pub(super) points: &'a [(f64, f64, usize)],
    /// From left to right.
    pub(super) curve: &'a [(f64, f64)],
    /// One standard deviation of the noise of what goes up.
    pub(super) floor: Option<f64>,
}

/// The parts of a chart's room.
pub(super) struct Parts {
    pub(super) head: Rect,
    pub(super) gutter: Rect,
    pub(super) canvas: Rect,
    pub(super) foot: Rect,
}

impl Parts {
    /// With one row above and one below, or two where titles get rows of their own.
    pub(super) fn of(area: Rect, two_rows: bool) -> Self {
        let head = if two_rows { 2 } else { 1 };
        let foot = if two_rows { 2 } else { u16::from(area.height >= ROOM_FOR_AXES.1) };
        let gutter = if area.width >= ROOM_FOR_AXES.0 { GUTTER } else { 0 };
        let height = area.height.saturating_sub(head + foot);
        let canvas =
            Rect { x: area.x + gutter, y: area.y + head, width: area.width.saturating_sub(gutter), height };
        Self {
            head: Rect { height: head, ..area },
            gutter: Rect { x: area.x, width: gutter, ..canvas },
            canvas,
            foot: Rect { y: area.y + head + height, height: foot, ..area },
        }
    }
}

/// Draws a chart.
pub(super) fn draw(chart: &Chart, look: Look, theme: &Theme, hits: &Hits, frame: &mut Frame, area: Rect) {
    if area.height < 3 || area.width < 8 {
        return;
    }
    let parts = Parts::of(area, !chart.heading.is_empty() && area.height >= ROOM_FOR_TITLES);
    let x = bounds(chart, parts.canvas);
    let finite = |point: &&(f64, f64, usize)| point.0.is_finite() && point.1.is_finite();
    let inside = |point: &&(f64, f64, usize)| {
        (x[0]..=x[1]).contains(&point.0) && (chart.y[0]..=chart.y[1]).contains(&point.1)
    };
    let (seen, outside): (Vec<_>, Vec<_>) = chart.points.iter().filter(finite).partition(inside);
    let on_rim = |point: &(f64, f64, usize)| {
        (point.0.clamp(x[0], x[1]), point.1.clamp(chart.y[0], chart.y[1]), point.2)
    };
    let rim: Vec<(f64, f64, usize)> = outside.into_iter().map(on_rim).collect();
    let without_row = |point: &(f64, f64, usize)| (point.0, point.1);
    let (dots, edge): (Vec<_>, Vec<_>) =
        (seen.iter().map(|point| without_row(point)).collect(), rim.iter().map(without_row).collect());
    let pointed = seen.iter().copied().chain(&rim).find(|point| Some(point.2) == look.pointed);
    let canvas = Canvas::default().marker(Marker::Braille).x_bounds(x).y_bounds(chart.y).paint(|context| {
        noise(context, chart, look, x);
        context.draw(&Points { coords: &dots, color: look.points });
        context.layer();
        for (from, to) in chart.curve.iter().zip(chart.curve.iter().skip(1)) {
            let line = Line { x1: from.0, y1: from.1, x2: to.0, y2: to.1, color: look.curve };
            context.draw(&line);
        }
        context.layer();
        context.draw(&Points { coords: &edge, color: look.outside });
        if let Some(point) = pointed {
            context.print(point.0, point.1, TextLine::styled(POINTED, look.mark));
        }
    });
    frame.render_widget(canvas, parts.canvas);
    note_hits(seen.iter().copied().chain(&rim), (x, chart.y), parts.canvas, hits);
    titles(chart, (x, rim.len()), theme, frame, &parts);
}

/// The ends of the horizontal axis: with some air, or as wide as the canvas is against its height. A Braille dot is about square, two across and four down to
/// a cell.
fn bounds(chart: &Chart, canvas: Rect) -> [f64; 2] {
    match chart.x {
        Some([left, right]) => {
            let air = 0.02 * (right - left).max(1e-9);
            [left - air, right + air]
        }
        None => {
            let half = 0.5 * (chart.y[1] - chart.y[0]);
            let wide = half * f64::from(canvas.width) / (2.0 * f64::from(canvas.height.max(1)));
            [-wide, wide]
        }
    }
}

/// The line of no error, and the noise: dotted lines above and below, or a ring where both axes are errors.
fn noise(context: &mut Context, chart: &Chart, look: Look, x: [f64; 2]) {
    context.draw(&Line { x1: x[0], y1: 0.0, x2: x[1], y2: 0.0, color: look.axis });
    if chart.x.is_none() {
        context.draw(&Line { x1: 0.0, y1: chart.y[0], x2: 0.0, y2: chart.y[1], color: look.axis });
        context.layer();
        if let Some(floor) = chart.floor {
            context.draw(&Circle { x: 0.0, y: 0.0, radius: 2.0 * floor, color: look.floor });
        }
        return;
    }
    for y in chart.floor.into_iter().flat_map(|floor| [-floor, floor]) {
        let dots: Vec<(f64, f64)> =
            (0..24).map(|dot| (x[0] + (x[1] - x[0]) * f64::from(dot) / 23.0, y)).collect();
        context.draw(&Points { coords: &dots, color: look.floor });
    }
    context.layer();
}

/// The cell of a canvas in which a point is drawn, as [`ratatui::widgets::canvas::Painter`] places it.
pub(super) fn cell_of((x, y): (f64, f64), (across, up): ([f64; 2], [f64; 2]), canvas: Rect) -> Option<Rect> {
    let fraction = |value: f64, [low, high]: [f64; 2]| ((value - low) / (high - low)).clamp(0.0, 1.0);
    if canvas.is_empty() || across[1] <= across[0] || up[1] <= up[0] {
        return None;
    }
    let column = fraction(x, across) * (2.0 * f64::from(canvas.width) - 1.0);
    let row = (1.0 - fraction(y, up)) * (4.0 * f64::from(canvas.height) - 1.0);
    // Both lie within the canvas, so the casts are exact.
    let (column, row) = (column.round() as u16 / 2, row.round() as u16 / 4);
    Some(Rect::new(canvas.x + column, canvas.y + row, 1, 1))
}

/// Notes where each point can be clicked; of several in one cell the one with the largest error.
fn note_hits<'p>(
    points: impl Iterator<Item = &'p (f64, f64, usize)>,
    bounds: ([f64; 2], [f64; 2]),
    canvas: Rect,
    hits: &Hits,
) {
    let mut cells: HashMap<Position, (f64, usize, Rect)> = HashMap::new();
    for (x, y, row) in points {
        let Some(cell) = cell_of((*x, *y), bounds, canvas) else { continue };
        let known = cells.entry(cell.as_position()).or_insert((y.abs(), *row, cell));
        if y.abs() > known.0 {
            *known = (y.abs(), *row, cell);
        }
    }
    cells.into_values().for_each(|(_, row, cell)| hits.note(cell, Hit::Row(row)));
}

/// The titles of both axes, their ends, and how many points lie outside.
fn titles(chart: &Chart, (x, outside): ([f64; 2], usize), theme: &Theme, frame: &mut Frame, parts: &Parts) {
    let count = if outside > 0 { format!("{outside} off") } else { String::new() };
    let width = usize::from(parts.head.width);
    let room = width.saturating_sub(count.len() + 1);
    let rows: Vec<String> = match (parts.head.height, chart.heading.is_empty()) {
        (2.., _) => vec![fitted(&chart.heading, room), fitted(&chart.title, width)],
        (_, true) => vec![fitted(&chart.title, room)],
        (_, false) => vec![fitted(&format!("{}: {}", chart.heading, chart.title), room)],
    };
    for (row, text) in parts.head.rows().zip(rows) {
        frame.render_widget(Span::styled(text, theme.heading), row);
    }
    let first = Rect { height: 1, ..parts.head };
    frame.render_widget(TextLine::from(Span::styled(count, theme.bad)).right_aligned(), first);
    let ends = chart.x.unwrap_or(x);
    let below = Rect { x: parts.canvas.x, width: parts.canvas.width, height: 1, ..parts.foot };
    match parts.foot.height {
        0 => {}
        1 => across(&chart.across, ends, theme, frame, below),
        _ => {
            across("", ends, theme, frame, below);
            let title = fitted(&chart.across, usize::from(parts.foot.width));
            let row = Rect { y: parts.foot.y + 1, height: 1, ..parts.foot };
            frame.render_widget(TextLine::styled(title, theme.faint).centered(), row);
        }
    }
    up(chart.y, theme, frame, parts.gutter);
}

/// The horizontal axis: its ends, and between them what it shows.
pub(super) fn across(title: &str, ends: [f64; 2], theme: &Theme, frame: &mut Frame, area: Rect) {
    let width = usize::from(area.width);
    let [left, right] = ends_of_axis(ends[0], ends[1]);
    let room = width.saturating_sub(columns(&left) + columns(&right) + 2);
    let title = fitted(title, room);
    let line = format!("{left} {title:^room$} {right}");
    frame.render_widget(TextLine::styled(line, theme.faint), area);
}

/// The numbers of the vertical axis: its ends, and zero where that lies between.
fn up(ends: [f64; 2], theme: &Theme, frame: &mut Frame, area: Rect) {
    if area.width == 0 || area.height == 0 {
        return;
    }
    let row = |y: u16, text: &str| (Rect { y, height: 1, ..area }, format!("{text:>6} "));
    let mut numbers = vec![row(area.y, &short(ends[1])), row(area.bottom() - 1, &short(ends[0]))];
    if ends[0] < 0.0 && ends[1] > 0.0 && area.height > 2 {
        let fraction = ends[1] / (ends[1] - ends[0]);
        // Within the area, so the cast is exact.
        let down = (fraction * f64::from(area.height - 1)).round() as u16;
        numbers.push(row(area.y + down, "0"));
    }
    for (row_area, text) in numbers {
        frame.render_widget(Span::styled(text, theme.faint), row_area);
    }
}

/// A number with three figures.
fn short(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    // Between 0 and 4.
    let decimals = (2.0 - value.abs().log10().floor()).clamp(0.0, 4.0) as usize;
    format!("{value:.decimals$}")
}

/// The ends of an axis with the digits that distinguish them.
pub(super) fn ends_of_axis(left: f64, right: f64) -> [String; 2] {
    // Between 0 and 4.
    let decimals = (1.0 - (right - left).abs().max(1e-12).log10().floor()).clamp(0.0, 4.0) as usize;
    let decimals = if right - left >= 10.0 { 0 } else { decimals };
    // A negative nothing is nothing.
    [left, right].map(|value| {
        let least = 0.5 * 10_f64.powi(-(decimals as i32));
        let value = if value.abs() < least { 0.0 } else { value };
        format!("{value:.decimals$}")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ends_of_an_axis_are_distinguished() {
        assert_eq!(ends_of_axis(-150.2, 149.8), ["-150", "150"]);
        assert_eq!(ends_of_axis(20.1, 23.4), ["20.1", "23.4"]);
        assert_eq!(ends_of_axis(-1e-15, 0.31), ["0.00", "0.31"]);
        assert_eq!(ends_of_axis(-732.0, -0.2), ["-732", "0"]);
    }

    #[test]
    fn a_point_is_clicked_where_it_is_drawn() {
        let canvas = Rect::new(10, 5, 20, 8);
        let bounds = ([-1.0, 1.0], [0.0, 4.0]);
        assert_eq!(cell_of((-1.0, 4.0), bounds, canvas), Some(Rect::new(10, 5, 1, 1)));
        assert_eq!(cell_of((1.0, 0.0), bounds, canvas), Some(Rect::new(29, 12, 1, 1)));
        assert_eq!(cell_of((9.0, 0.0), bounds, canvas), Some(Rect::new(29, 12, 1, 1)), "on the rim");
        assert_eq!(cell_of((0.0, 0.0), ([1.0, 1.0], [0.0, 1.0]), canvas), None);
    }
}
