//! The strip over the page: how large the error is, how much of it could be explained, where it is; in this order.

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::text::{Line, Span};
use ratatui::widgets::Paragraph;

use super::state::{ModelState, StripLine};
use crate::screens::pane::{columns, fitted, wrapped};
use crate::screens::theme::Theme;

/// Columns of the names at the left.
const NAMES: usize = 13;

/// Rows of the page from which a line of the strip is there in full although it takes two of them.
const ROOM_FOR_TWO: u16 = 32;

/// Rows a line may take where the page is narrow; what is still left then is cut, and marked.
const MOST_ROWS: usize = 3;

/// The lines of the strip on a page of this size; none before the lab has looked.
pub(super) fn lines(model: &ModelState, (width, height): (u16, u16), theme: &Theme) -> Vec<Line<'static>> {
    let Some(summary) = &model.summary else { return Vec::new() };
    let strip =
        [("Error", &summary.how_large), ("Explainable", &summary.how_much), ("Where", &summary.where_it_is)];
    let room = usize::from(width).saturating_sub(NAMES + 1);
    let shown = strip.into_iter().filter(|(_, line)| !line.full.is_empty());
    shown.flat_map(|(name, line)| named_rows(name, rows(line, room, height), theme)).collect()
}

/// The rows of one line: in full where it fits into a row, or the page is high.
fn rows(line: &StripLine, room: usize, height: u16) -> Vec<String> {
    let is_full = columns(&line.full) <= room || height >= ROOM_FOR_TWO;
    let mut rows = wrapped(if is_full { &line.full } else { &line.short }, room);
    if rows.len() > MOST_ROWS {
        rows.truncate(MOST_ROWS);
        if let Some(last) = rows.last_mut() {
            *last = fitted(&format!("{last}\u{2026}"), room);
        }
    }
    rows
}

fn named_rows(name: &'static str, rows: Vec<String>, theme: &Theme) -> Vec<Line<'static>> {
    let row = |(index, row): (usize, String)| {
        let name = if index == 0 { name } else { "" };
        Line::from(vec![Span::styled(format!(" {name:<12}"), theme.heading), Span::styled(row, theme.text)])
    };
    rows.into_iter().enumerate().map(row).collect()
}

/// Draws the strip.
pub(super) fn view(lines: Vec<Line<'static>>, frame: &mut Frame, area: Rect) {
    frame.render_widget(Paragraph::new(lines), area);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line() -> StripLine {
        StripLine {
            full: "worst lines 79, 134; along lift 0.191".to_owned(),
            short: "79, 134; lift 0.191".to_owned(),
        }
    }

    #[test]
    fn what_does_not_fit_into_a_row_is_said_in_short_and_then_wrapped_never_cut_without_a_mark() {
        assert_eq!(rows(&line(), 37, 22), [line().full]);
        assert_eq!(rows(&line(), 36, 22), [line().short]);
        assert_eq!(rows(&line(), 36, 40), ["worst lines 79, 134; along lift", "0.191"]);
        assert_eq!(rows(&line(), 8, 22), ["79, 134;", "lift", "0.191"]);
        assert_eq!(rows(&line(), 5, 22), ["79,", "134;", "lift\u{2026}"]);
    }
}
