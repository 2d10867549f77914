//! Draws the Log screen: what happened, newest last.

use std::collections::VecDeque;

use plumb_cell::event::LogLevel;
use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::text::{Line, Span};
use ratatui::widgets::Paragraph;

use super::state::LogLine;
use crate::screens::pane;
use crate::screens::state::State;
use crate::screens::theme::Theme;

/// Draws the page: the newest lines that fit, long ones on as many rows as they take.
pub(crate) fn view(state: &State, frame: &mut Frame, area: Rect) {
    let inner = pane::open(frame, area, &state.theme, "Log, times in UTC", false);
    let (room, width) = (usize::from(inner.height), usize::from(inner.width));
    let log = &state.log;
    let end = log.lines.len().saturating_sub(log.scrolled_back);
    let mut rows: VecDeque<Line> = VecDeque::new();
    for line in log.lines.range(..end).rev() {
        if rows.len() >= room {
            break;
        }
        for row in rows_of(line, width, &state.theme).into_iter().rev() {
            rows.push_front(row);
        }
    }
    // Of the oldest of these only its last rows may fit.
    let cut = rows.len().saturating_sub(room);
    // Scrolled back to the first line, the page stays full from there on.
    for line in log.lines.range(end..) {
        if rows.len() >= room {
            break;
        }
        rows.extend(rows_of(line, width, &state.theme));
    }
    frame.render_widget(Paragraph::new(rows.into_iter().skip(cut).collect::<Vec<_>>()), inner);
}

/// One line of the log on as many rows as it takes; those after the first are indented to where its message begins.
fn rows_of(line: &LogLine, width: usize, theme: &Theme) -> Vec<Line<'static>> {
    let (word, style) = match line.level {
        LogLevel::Debug => ("debug: ", theme.faint),
        LogLevel::Info => ("", theme.text),
        LogLevel::Warning => ("warning: ", theme.warning),
        LogLevel::Error => ("error: ", theme.bad),
    };
    let (time, source) = (format!("{:<8} ", line.time), format!("{:<6} ", line.source));
    let margin = pane::columns(&time) + pane::columns(&source);
    let message = format!("{word}{}", line.message);
    let parts = pane::wrapped(&message, width.saturating_sub(margin).max(20));
    let mut head = Some((Span::styled(time, theme.faint), Span::styled(source, theme.heading)));
    parts
        .into_iter()
        .map(|part| match head.take() {
            Some((time, source)) => Line::from(vec![time, source, Span::styled(part, style)]),
            None => Line::from(vec![Span::raw(" ".repeat(margin)), Span::styled(part, style)]),
        })
        .collect()
}
