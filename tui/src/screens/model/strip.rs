//! The strip over the page: how large the error is, how much of it could be explained, where it is; in this order.

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::text::{Line, Span};
use ratatui::widgets::Paragraph;

use super::state::ModelState;
use crate::screens::pane::{columns, wrapped};
use crate::screens::theme::Theme;

/// Columns of the names at the left.
const NAMES: usize = 13;

/// Rows of the page from which a line of the strip may take two of them.
const ROOM_FOR_TWO: u16 = 32;

/// The lines of the strip on a page of this size; none before the lab has looked.
pub(super) fn lines(model: &ModelState, (width, height): (u16, u16), theme: &Theme) -> Vec<Line<'static>> {
    let most_rows = if height >= ROOM_FOR_TWO { 2 } else { 1 };
    let Some(standing) = &model.standing else { return Vec::new() };
    let told = [
        ("Error", &standing.how_large),
        ("Explainable", &standing.how_much),
        ("Where", &standing.where_it_is),
    ];
    let room = usize::from(width).saturating_sub(NAMES + 1);
    let lines = told.into_iter().filter(|(_, text)| !text.is_empty()).flat_map(|(name, text)| {
        let mut rows = wrapped(text, room);
        if rows.len() > most_rows {
            rows.truncate(most_rows);
            if let Some(last) = rows.last_mut() {
                while columns(last) + 1 > room {
                    last.pop();
                }
                last.push('\u{2026}');
            }
        }
        rows.into_iter().enumerate().map(move |(place, row)| {
            let name = if place == 0 { name } else { "" };
            Line::from(vec![
                Span::styled(format!(" {name:<12}"), theme.heading),
                Span::styled(row, theme.text),
            ])
        })
    });
    lines.collect()
}

/// Draws the strip.
pub(super) fn view(lines: Vec<Line<'static>>, frame: &mut Frame, area: Rect) {
    frame.render_widget(Paragraph::new(lines), area);
}
