//! How fast the poses of repeated searches settle: the change from turn to turn, every line of the axis ten times the one
//! below.

use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Style};
use ratatui::symbols::Marker;
use ratatui::text::Line as TextLine;
use ratatui::widgets::canvas::{Canvas, Circle, Context, Line};
use ratatui::widgets::{Block, Borders, Padding};

use crate::screens::theme::Theme;

/// Columns the plot needs to say something.
pub(crate) const LEAST: u16 = 16;

/// The greatest and the smallest change the axis shows, as powers of ten; degrees or mm.
const DECADES: (i32, i32) = (1, -4);

/// Names are kept at least this share of a line apart: below a whole line, so that two names a line apart do not collide by rounding.
const LINE_SHARE: f64 = 0.9;

/// Draws the changes of each series, called by its joint, over the turns. The names are at the lines' ends, for who sees no colours.
pub(crate) fn view(series: &[(String, Vec<f64>)], unit: &str, theme: &Theme, frame: &mut Frame, area: Rect) {
    let turns = series.iter().map(|(_, changes)| changes.len()).max().unwrap_or(0);
    if area.height < 4 || area.width < LEAST || turns == 0 {
        return;
    }
    let area = captioned(unit, theme, frame, area);
    let axes = Axes {
        left: -0.45 * turns as f64,
        right: turns as f64 + 0.5,
        low: f64::from(DECADES.0.min(DECADES.1)),
        high: f64::from(DECADES.0.max(DECADES.1)),
        area,
    };
    let inks = [ink(theme.measured), ink(theme.machine)];
    let canvas = Canvas::default()
        .marker(Marker::Braille)
        .x_bounds([axes.left, axes.right])
        .y_bounds([axes.low, axes.high])
        .paint(|context| {
            axes.draw_decades(context, theme);
            context.layer();
            let mut labels: Vec<f64> = Vec::new();
            for ((name, changes), color) in series.iter().zip(inks.into_iter().cycle()) {
                axes.draw_series(context, (name, changes), color, &mut labels);
            }
            axes.number_decades(context, theme);
        });
    frame.render_widget(canvas, area);
}

/// The caption on a line of its own and a rule at the left: beside the table's columns the axis's numbers would read as one of them. What is left of the area.
fn captioned(unit: &str, theme: &Theme, frame: &mut Frame, area: Rect) -> Rect {
    let block = Block::new().borders(Borders::LEFT).border_style(theme.faint).padding(Padding::left(1));
    let inner = block.inner(area);
    frame.render_widget(block, area);
    let [caption, plot] = Layout::vertical([Constraint::Length(1), Constraint::Min(0)]).areas(inner);
    let long = format!("change from turn to turn, {unit}");
    let fits = long.chars().count() < usize::from(plot.width);
    let text = if fits { long } else { format!("change, {unit}") };
    frame.render_widget(TextLine::styled(text, theme.heading).right_aligned(), caption);
    plot
}

fn ink(style: Style) -> Color {
    style.fg.unwrap_or(Color::Reset)
}

/// The plot's range: turns from left to right, with room for the axis's numbers at the left; powers of ten from low to high.
struct Axes {
    left: f64,
    right: f64,
    low: f64,
    high: f64,
    area: Rect,
}

impl Axes {
    fn draw_decades(&self, context: &mut Context<'_>, theme: &Theme) {
        for decade in DECADES.1..=DECADES.0 {
            let y = f64::from(decade);
            context.draw(&Line { x1: 0.4, y1: y, x2: self.right, y2: y, color: ink(theme.faint) });
        }
    }

    fn number_decades(&self, context: &mut Context<'_>, theme: &Theme) {
        for (decade, text) in [(DECADES.0, "10"), (0, "1"), (-2, ".01"), (DECADES.1, ".0001")] {
            context.print(self.left, f64::from(decade), TextLine::styled(text, theme.faint));
        }
    }

    /// One joint's changes, with its name at their end. `labels` holds the heights of the names so far.
    fn draw_series(
        &self,
        context: &mut Context<'_>,
        (name, changes): (&str, &[f64]),
        color: Color,
        labels: &mut Vec<f64>,
    ) {
        let points: Vec<(f64, f64)> =
            (1_u32..).map(f64::from).zip(changes.iter().map(|one| self.height(*one))).collect();
        for (from, to) in points.iter().zip(points.iter().skip(1)) {
            context.draw(&Line { x1: from.0, y1: from.1, x2: to.0, y2: to.1, color });
        }
        if let Some((_, y)) = points.last() {
            let column = (self.right - self.left) / f64::from(self.area.width);
            let x = self.right - column * name.chars().count() as f64;
            let y = self.free_height(*y, labels);
            labels.push(y);
            context.print(x, y, TextLine::styled(name.to_owned(), Style::new().fg(color)));
        }
        let radius = 1.2 * (self.right - self.left) / (2.0 * f64::from(self.area.width));
        for (x, y) in points {
            context.draw(&Circle { x, y, radius, color });
        }
    }

    /// The height of a change: its power of ten.
    fn height(&self, change: f64) -> f64 {
        change.abs().max(1e-12).log10().clamp(self.low, self.high)
    }

    /// Where a name is written: poses that settle alike end at one height, and the second name is written at the nearest height that is free. With more names
    /// than lines it is where the series ends.
    fn free_height(&self, y: f64, labels: &[f64]) -> f64 {
        let lines = f64::from(self.area.height.max(1));
        let line = (self.high - self.low) / lines;
        let apart = |height: f64| labels.iter().all(|other| (other - height).abs() >= LINE_SHARE * line);
        let offsets = (0..self.area.height).flat_map(|count| [f64::from(count), -f64::from(count)]);
        offsets
            .map(|offset| y + offset * line)
            .find(|height| (self.low..=self.high).contains(height) && apart(*height))
            .unwrap_or(y)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_at_one_height_are_written_a_line_apart() {
        let axes = Axes { left: 0.0, right: 4.0, low: -4.0, high: 1.0, area: Rect::new(0, 0, 20, 5) };
        assert_eq!(axes.free_height(-2.0, &[]), -2.0);
        assert_eq!(axes.free_height(-2.0, &[0.5]), -2.0);
        assert_eq!(axes.free_height(-2.0, &[-2.2]), -1.0);
        assert_eq!(axes.free_height(-2.0, &[-2.0, -1.0]), -3.0, "the third is written below");
        assert_eq!(axes.free_height(0.5, &[0.5]), -0.5, "above the top nothing is shown");
        let full: Vec<f64> = (0..6).map(|line| f64::from(line) - 4.0).collect();
        assert_eq!(axes.free_height(-2.0, &full), -2.0, "no line is free");
    }
}
