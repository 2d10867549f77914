//! Draws the Scan screen.

use plumb_cloud::CloudPoint;
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Position, Rect};
use ratatui::style::{Color, Style};
use ratatui::symbols::Marker;
use ratatui::text::Line as TextLine;
use ratatui::widgets::Paragraph;
use ratatui::widgets::canvas::{Canvas, Context, Line, Points};

use super::eye::{Short, Viewpoint};
use super::picture::joined;
use super::scale::Scale;
use super::state::{ScanState, Strokes};
use crate::screens::hits::Hit;
use crate::screens::pane::{self, wrapped};
use crate::screens::state::State;
use crate::screens::theme::Theme;

/// More points are thinned out: a terminal has fewer dots.
const MOST_POINTS: usize = 60_000;

/// Draws the page.
pub(crate) fn view(state: &State, frame: &mut Frame, area: Rect) {
    let Some(scan) = &state.scan else { return };
    let theme = &state.theme;
    let beside = area.width >= 100;
    let width = if beside { 36 } else { area.width };
    let lines = lines(scan, theme, usize::from(width.saturating_sub(2)));
    let [picture, words] = if beside {
        Layout::horizontal([Constraint::Fill(1), Constraint::Length(width)]).areas(area)
    } else {
        let rows = u16::try_from(lines.len() + 2).unwrap_or(u16::MAX).min(area.height / 2);
        Layout::vertical([Constraint::Fill(1), Constraint::Length(rows)]).areas(area)
    };
    let title = format!("{} \u{b7} {} points, {} stripes", scan.name, scan.points.len(), scan.stripes);
    let room = usize::from(picture.width.saturating_sub(4));
    let inner = pane::open(frame, picture, theme, &pane::fitted(&title, room), false);
    state.hits.note(inner, Hit::Cloud);
    cloud(scan, theme, frame, inner);
    let inner = pane::open(frame, words, theme, "View", false);
    frame.render_widget(Paragraph::new(lines), inner);
}

/// Where a cell of the terminal lies in the view drawn last, in the view's units.
pub(super) fn units(state: &State, column: u16, row: u16) -> Option<(f64, f64)> {
    let area = state.hits.area_of(Hit::Cloud)?;
    let (width, height) = dots(area);
    let unit = width.min(height) / 2.0;
    let across = 2.0 * (f64::from(column) - f64::from(area.x)) + 1.0;
    let down = 4.0 * (f64::from(row) - f64::from(area.y)) + 2.0;
    Some(((across - width / 2.0) / unit, (height / 2.0 - down) / unit))
}

/// Braille dots of an area, across and down.
fn dots(area: Rect) -> (f64, f64) {
    (2.0 * f64::from(area.width.max(1)), 4.0 * f64::from(area.height.max(1)))
}

fn cloud(scan: &ScanState, theme: &Theme, frame: &mut Frame, area: Rect) {
    if area.is_empty() {
        return;
    }
    let (width, height) = dots(area);
    let unit = width.min(height) / 2.0;
    let canvas = Canvas::default()
        .marker(Marker::Braille)
        .x_bounds([-width / 2.0 / unit, width / 2.0 / unit])
        .y_bounds([-height / 2.0 / unit, height / 2.0 / unit])
        .paint(|context| paint(context, scan, theme, (width, height)));
    frame.render_widget(canvas, area);
    // The cross is a letter, so that it is seen whatever lies under it.
    let cell = |units: f64, dots: f64, each: f64| (units * unit + dots / 2.0) / each;
    let (x, y) = (cell(scan.aim.0, width, 2.0), cell(-scan.aim.1, height, 4.0));
    if scan.cursor.is_some() && x >= 0.0 && y >= 0.0 {
        let position = Position::new(area.x.saturating_add(x as u16), area.y.saturating_add(y as u16));
        if area.contains(position)
            && let Some(cell) = frame.buffer_mut().cell_mut(position)
        {
            cell.set_symbol("+").set_style(theme.focus);
        }
    }
}

fn paint(context: &mut Context, scan: &ScanState, theme: &Theme, (width, height): (f64, f64)) {
    let unit = width.min(height) / 2.0;
    let (low, high) = scan.values();
    let ramp = theme.ramp.map(colour);
    let of = |point: &CloudPoint| {
        let fraction = ((scan.value(point) - low) / (high - low)).clamp(0.0, 1.0);
        ramp[((fraction * ramp.len() as f64) as usize).min(ramp.len() - 1)]
    };
    let every = scan.points.len().div_ceil(MOST_POINTS).max(1);
    let gap = scan.widest_gap() * every as f64;
    let mut seen: Vec<(usize, f64)> = scan
        .points
        .iter()
        .enumerate()
        .step_by(every)
        .filter_map(|(index, point)| Some((index, scan.eye.see(&point.position)?.depth)))
        .collect();
    // The nearest is drawn last and gives its cell the colour.
    seen.sort_by(|one, other| other.1.total_cmp(&one.1));
    for (index, _) in seen {
        let Some(point) = scan.points.get(index) else { continue };
        let Some(here) = scan.eye.see(&point.position) else { continue };
        let next = scan.points.get(index + 1).and_then(|next| scan.eye.see(&next.position));
        match next.filter(|_| scan.strokes == Strokes::Stripes && joined(scan, index, gap)) {
            Some(next) => {
                context.draw(&Line { x1: here.x, y1: here.y, x2: next.x, y2: next.y, color: of(point) })
            }
            None => context.draw(&Points { coords: &[(here.x, here.y)], color: of(point) }),
        }
    }
    context.layer();
    marks(context, scan, theme, unit);
    scale(context, scan, theme, (width, height), unit);
}

/// A scale in the lower left corner, as long as it says; edge-on with what the thickness is drawn to.
fn scale(context: &mut Context, scan: &ScanState, theme: &Theme, (width, height): (f64, f64), unit: f64) {
    let scale = Scale::across(&scan.eye, 0.4 * width / unit);
    // A letter is two dots wide.
    let columns = ((scale.in_view * unit / 2.0).round() as usize).max(2);
    let bar = "\u{2500}".repeat(columns - 2);
    let mut text = format!("\u{251c}{bar}\u{2524} {}", scale.label(&scan.eye));
    if let Some(up) = Scale::of_thickness(&scan.eye, height / unit) {
        let rows = up.in_view * unit / 4.0;
        text.push_str(&format!("; {rows:.1} rows up: {}", up.label(&scan.eye)));
    }
    let room = (width / 2.0) as usize;
    let (left, low) = (-width / 2.0 / unit, -height / 2.0 / unit);
    context.print(left, low, TextLine::styled(pane::fitted(&text, room), theme.faint));
}

/// The point under the cursor, the marked one and the way between them; edge-on the band's edges.
fn marks(context: &mut Context, scan: &ScanState, theme: &Theme, unit: f64) {
    let (cursor, mark) = scan.chosen();
    let in_view = |point: Option<&CloudPoint>| point.and_then(|point| scan.eye.see(&point.position));
    let (cursor, mark) = (in_view(cursor), in_view(mark));
    if let (Some(one), Some(other)) = (cursor, mark) {
        let color = colour(theme.focus);
        context.draw(&Line { x1: one.x, y1: one.y, x2: other.x, y2: other.y, color });
    }
    for seen in [cursor, mark].into_iter().flatten() {
        let arm = 4.0 / unit;
        let color = colour(theme.focus);
        context.draw(&Line { x1: seen.x - arm, y1: seen.y, x2: seen.x + arm, y2: seen.y, color });
        context.draw(&Line { x1: seen.x, y1: seen.y - arm, x2: seen.x, y2: seen.y + arm, color });
    }
    if let (Viewpoint::EdgeOn { .. }, Some(band)) = (&scan.eye.viewpoint, &scan.band) {
        let color = colour(theme.warning);
        for edge in [band.edges.0, band.edges.1] {
            if let Some(seen) = scan.eye.see(&(band.middle + band.normal * edge)) {
                context.draw(&Line { x1: -9.0, y1: seen.y, x2: 9.0, y2: seen.y, color });
            }
        }
    }
}

/// What is written beside the view.
fn lines(scan: &ScanState, theme: &Theme, width: usize) -> Vec<TextLine<'static>> {
    let mut lines: Vec<TextLine<'static>> = Vec::new();
    let mut say = |text: String, style: Style| {
        lines.extend(wrapped(&text, width.max(20)).into_iter().map(|line| TextLine::styled(line, style)));
    };
    let (cursor, mark) = scan.chosen();
    if let Some(point) = cursor {
        let [x, y, z] = point.position.coords.into();
        say(format!("cursor [{x:.3}, {y:.3}, {z:.3}] mm"), theme.focus);
        let seen = &point.seen;
        let mut more = format!("stripe {}, row {:.0}", point.stripe + 1, seen.v_px);
        if seen.width_px > 0.0 {
            more.push_str(&format!(", width {:.0} px", seen.width_px));
        }
        if seen.sigma_mm > 0.0 {
            more.push_str(&format!(", sigma {:.3} mm", seen.sigma_mm));
        }
        if let Some(band) = &scan.band {
            more.push_str(&format!(", {:+.3} mm from the plane", band.away(&point.position)));
        }
        say(more, theme.text);
    }
    if let (Some(point), Some(mark)) = (cursor, mark) {
        let way = point.position - mark.position;
        say(
            format!("{:.3} mm from the mark: [{:.3}, {:.3}, {:.3}]", way.norm(), way.x, way.y, way.z),
            theme.heading,
        );
    }
    if let (Viewpoint::EdgeOn { .. }, Some(band)) = (&scan.eye.viewpoint, &scan.band) {
        say(
            format!(
                "band {:.3} mm thick (95 % of {} points), rms {:.3} mm",
                band.thickness(),
                band.points,
                band.rms
            ),
            theme.heading,
        );
    }
    let (low, high) = scan.values();
    let (what, unit) = scan.colouring.title_and_unit();
    say(format!("colour: {what} {} to {} {unit}", Short(low), Short(high)).trim_end().to_owned(), theme.text);
    say(scan.eye.describe(), theme.faint);
    lines
}

fn colour(style: Style) -> Color {
    style.fg.unwrap_or(Color::Reset)
}
