//! How fast the poses of repeated searches settle: the change from turn to turn, every line of the axis ten times the one
//! below.

use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Style};
use ratatui::symbols::Marker;
use ratatui::text::Line as TextLine;
use ratatui::widgets::canvas::{Canvas, Circle, Line};
use ratatui::widgets::{Block, Borders, Padding};

use crate::screens::theme::Theme;

/// Columns the plot needs to say something.
pub(crate) const LEAST: u16 = 16;

/// The greatest and the smallest change the axis shows, as powers of ten; degrees or mm.
const DECADES: (i32, i32) = (1, -4);

/// Draws the changes of each series, called by its joint, over the turns. The names stand at the lines' ends, for who sees no colours.
pub(crate) fn view(series: &[(String, Vec<f64>)], unit: &str, theme: &Theme, frame: &mut Frame, area: Rect) {
    let turns = series.iter().map(|(_, changes)| changes.len()).max().unwrap_or(0);
    if area.height < 4 || area.width < LEAST || turns == 0 {
        return;
    }
    // A line of its own and a rule at the left: beside the table's columns the axis's numbers would read as one of them.
    let block = Block::new().borders(Borders::LEFT).border_style(theme.faint).padding(Padding::left(1));
    let inner = block.inner(area);
    frame.render_widget(block, area);
    let area = inner;
    let [caption, area] = Layout::vertical([Constraint::Length(1), Constraint::Min(0)]).areas(area);
    let what = format!("change from turn to turn, {unit}");
    let what = if what.chars().count() < usize::from(area.width) { what } else { format!("change, {unit}") };
    frame.render_widget(TextLine::styled(what, theme.heading).right_aligned(), caption);
    let colour = |style: Style| style.fg.unwrap_or(Color::Reset);
    let inks = [colour(theme.measured), colour(theme.machine)];
    let (high, low) = (f64::from(DECADES.0), f64::from(DECADES.1));
    // Room for the numbers of the axis at the left.
    let (left, right) = (0.0 - 0.45 * turns as f64, turns as f64 + 0.5);
    let radius = 1.2 * (right - left) / (2.0 * f64::from(area.width));
    let canvas =
        Canvas::default().marker(Marker::Braille).x_bounds([left, right]).y_bounds([low, high]).paint(
            |context| {
                for decade in DECADES.1..=DECADES.0 {
                    let y = f64::from(decade);
                    context.draw(&Line { x1: 0.4, y1: y, x2: right, y2: y, color: colour(theme.faint) });
                }
                context.layer();
                let column = (right - left) / f64::from(area.width);
                let at_the_right = |text: &str| right - column * text.chars().count() as f64;
                let line = (high - low) / f64::from(area.height.max(1));
                let mut labels: Vec<f64> = Vec::new();
                for ((name, changes), color) in series.iter().zip(inks.into_iter().cycle()) {
                    let height = |change: &f64| change.abs().max(1e-12).log10().clamp(low, high);
                    let points: Vec<(f64, f64)> = changes
                        .iter()
                        .enumerate()
                        .map(|(turn, change)| (turn as f64 + 1.0, height(change)))
                        .collect();
                    for (from, to) in points.iter().zip(points.iter().skip(1)) {
                        context.draw(&Line { x1: from.0, y1: from.1, x2: to.0, y2: to.1, color });
                    }
                    if let Some((_, y)) = points.last() {
                        let style = Style::new().fg(color);
                        // Poses that settle alike end at one height: the second name stands a line higher, or lower at the top.
                        let beside = if *y + line > high { -line } else { line };
                        let is_free = |at: f64| labels.iter().all(|other| (other - at).abs() >= line);
                        let at = if is_free(*y) { *y } else { *y + beside };
                        labels.push(at);
                        context.print(at_the_right(name), at, TextLine::styled(name.clone(), style));
                    }
                    for (x, y) in points {
                        context.draw(&Circle { x, y, radius, color });
                    }
                }
                for (decade, text) in [(DECADES.0, "10"), (0, "1"), (-2, ".01"), (DECADES.1, ".0001")] {
                    context.print(left, f64::from(decade), TextLine::styled(text, theme.faint));
                }
            },
        );
    frame.render_widget(canvas, area);
}
