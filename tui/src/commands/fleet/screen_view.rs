//! The fleet's terminal screen, drawn.

use std::time::Duration;

use plumb_central::CellState;
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::Style;
use ratatui::text::{Line, Span};
use ratatui::widgets::Paragraph;

use super::words::{Due, calibration, doing, due, duration, is_silent, minute, queued, summary};
use crate::screens::pane::{fitted, open, wrapped};
use crate::screens::theme::Theme;

/// Rows of the pane of the chosen cell, its frame among them.
const DETAILS: u16 = 6;

/// A terminal of fewer rows shows no such pane: the list counts more.
const DETAILS_FROM: u16 = 16;

/// A terminal of fewer columns does not show when a cell's last run passed, and which machine ships its record.
const WIDE: usize = 110;

/// Columns of a time in minutes.
const MINUTE: usize = 16;

/// Columns of the longest state, `needs operator`.
const STATE: usize = 14;

/// The widest name of a cell or machine that is shown whole.
const LONGEST_NAME: usize = 20;

/// What there is to draw.
pub(super) struct Shown<'a> {
    /// In the order they are drawn.
    pub(super) cells: &'a [CellState],
    /// The row of the chosen one.
    pub(super) chosen: usize,
    /// Why they were not read since.
    pub(super) trouble: Option<&'a str>,
    /// How long ago they were read.
    pub(super) old: Duration,
    /// 2027-03-31.
    pub(super) today: String,
}

pub(super) fn view(frame: &mut Frame, shown: &Shown<'_>, theme: &Theme) {
    let area = frame.area();
    let trouble = trouble(shown, usize::from(area.width));
    let details = if area.height >= DETAILS_FROM && !shown.cells.is_empty() { DETAILS } else { 0 };
    let parts = [
        Constraint::Length(1),
        Constraint::Length(u16::try_from(trouble.len()).unwrap_or(u16::MAX)),
        Constraint::Min(2),
        Constraint::Length(details),
        Constraint::Length(1),
    ];
    let [head, summary_area, list, pane, foot] = Layout::vertical(parts).areas(area);
    let title = Line::from(vec![
        Span::styled("plumb fleet", theme.heading),
        Span::styled(format!("   {}", summary(shown.cells)), theme.text),
    ]);
    frame.render_widget(title, head);
    let lines: Vec<Line<'_>> = trouble.into_iter().map(|line| Line::styled(line, theme.bad)).collect();
    frame.render_widget(Paragraph::new(lines), summary_area);
    draw_list(frame, list, shown, theme);
    if details > 0 {
        draw_chosen(frame, pane, shown, theme);
    }
    frame.render_widget(keys(theme), foot);
}

/// The database does not answer, and how old what is shown is.
fn trouble(shown: &Shown<'_>, width: usize) -> Vec<String> {
    let Some(trouble) = shown.trouble else { return Vec::new() };
    let old = duration(shown.old.as_secs_f64());
    let mut lines =
        wrapped(&format!("What follows is {old} old, and is read again every 2 s: {trouble}"), width);
    // Causes may be long; the list has to stay.
    lines.truncate(3);
    lines
}

fn keys(theme: &Theme) -> Line<'static> {
    let mut spans = Vec::new();
    for (key, does) in [("j k", "choose"), ("PgDn PgUp", "further"), ("g G", "first, last"), ("q", "leave")] {
        spans.push(Span::styled(key, theme.key));
        spans.push(Span::styled(format!(" {does}   "), theme.faint));
    }
    Line::from(spans)
}

/// Widths of the columns.
struct Columns {
    cell: usize,
    does: usize,
    /// Last passed and host, where there is room.
    host: Option<usize>,
}

impl Columns {
    fn of(cells: &[CellState], width: usize) -> Self {
        let longest =
            |texts: &mut dyn Iterator<Item = usize>| texts.max().unwrap_or(0).clamp(4, LONGEST_NAME);
        let cell = longest(&mut cells.iter().map(|cell| Span::raw(cell.cell.as_str()).width()));
        let host = longest(&mut cells.iter().map(|cell| Span::raw(cell.host.as_str()).width()));
        let host = (width >= WIDE).then_some(host);
        // Two columns between each, two for the mark.
        let taken = 2 + cell + 2 + STATE + 2 + MINUTE + 2 + host.map_or(0, |host| MINUTE + 2 + host + 2);
        Self { cell, does: width.saturating_sub(taken), host }
    }

    fn row(&self, mark: &str, texts: [&str; 6]) -> String {
        let [cell, state, since, does, passed, host] = texts;
        let mut row = format!("{mark:2}");
        let mut add = |text: &str, width: usize| {
            let text = fitted(text, width);
            let room = width.saturating_sub(Span::raw(text.as_str()).width());
            row.push_str(&text);
            row.push_str(&" ".repeat(room + 2));
        };
        add(cell, self.cell);
        add(state, STATE);
        add(since, MINUTE);
        if let Some(width) = self.host {
            add(passed, MINUTE);
            add(host, width);
        }
        row.push_str(&fitted(does, self.does));
        row
    }
}

fn draw_list(frame: &mut Frame, area: Rect, shown: &Shown<'_>, theme: &Theme) {
    if shown.cells.is_empty() {
        let none = "No cell has shipped anything yet: `plumb ship --to ...` beside each cell does.";
        let lines: Vec<Line<'_>> =
            wrapped(none, usize::from(area.width)).into_iter().map(Line::from).collect();
        frame.render_widget(Paragraph::new(lines), area);
        return;
    }
    let columns = Columns::of(shown.cells, usize::from(area.width));
    let heads = ["cell", "state", "since, UTC", "what it does", "last passed", "host"];
    let mut lines = vec![Line::styled(columns.row("", heads), theme.heading)];
    let room = usize::from(area.height).saturating_sub(1).max(1);
    let (first, end) = seen(shown.cells.len(), shown.chosen, room);
    for (row, cell) in shown.cells.iter().enumerate().take(end).skip(first) {
        let is_chosen = row == shown.chosen;
        let style = if is_chosen { theme.chosen } else { style(cell, &shown.today, theme) };
        lines.push(Line::styled(cell_row(&columns, cell, is_chosen, &shown.today), style));
    }
    frame.render_widget(Paragraph::new(lines), area);
}

fn cell_row(columns: &Columns, cell: &CellState, is_chosen: bool, today: &str) -> String {
    let mark = if is_chosen { ">" } else { "" };
    let since = minute(cell.ended.as_deref().unwrap_or(&cell.started));
    let does = format!("{}{}{}", doing(cell), queued(cell.queued), calibration(cell, today));
    let passed = cell.last_passed.as_deref().map(minute).unwrap_or_default();
    columns.row(mark, [&cell.cell, &cell.state.replace('_', " "), &since, &does, &passed, &cell.host])
}

/// The rows that are seen of `count` where `room` are: the chosen one is among them, in the middle where that can be.
fn seen(count: usize, chosen: usize, room: usize) -> (usize, usize) {
    let first = chosen.saturating_sub(room / 2).min(count.saturating_sub(room));
    (first, (first + room).min(count))
}

/// What a cell wants of people; its words say the same.
fn style(cell: &CellState, today: &str, theme: &Theme) -> Style {
    let failed = !matches!(cell.state.as_str(), "running" | "passed");
    if is_silent(cell) || failed || due(cell.due.as_deref(), today) == Due::Over {
        theme.bad
    } else if cell.waits_for.is_some() {
        theme.warning
    } else {
        theme.text
    }
}

/// The chosen cell in full.
fn draw_chosen(frame: &mut Frame, area: Rect, shown: &Shown<'_>, theme: &Theme) {
    let Some(cell) = shown.cells.get(shown.chosen) else { return };
    let title = format!("{} ({} of {})", cell.cell, shown.chosen + 1, shown.cells.len());
    let inner = open(frame, area, theme, &title, false);
    let arm = cell.arm.as_ref().map(|arm| format!(", arm {arm}")).unwrap_or_default();
    let last = cell.last_passed.as_deref().map_or_else(|| "never".to_owned(), minute);
    let due = match (&cell.due, &cell.due_instrument) {
        (Some(day), Some(instrument)) => format!("; {instrument} calibrated until {day}"),
        _ => String::new(),
    };
    let text = format!(
        "{}\nRun {}, {}, {}{arm}; began {} UTC; last passed {last}{}{due}",
        doing(cell),
        cell.run,
        cell.procedure,
        cell.host,
        minute(&cell.started),
        queued(cell.queued)
    );
    let lines: Vec<Line<'_>> = wrapped(&text, usize::from(inner.width)).into_iter().map(Line::from).collect();
    frame.render_widget(Paragraph::new(lines), inner);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_chosen_row_is_always_seen() {
        for (count, chosen, room, expected) in [
            (3, 0, 10, (0, 3)),
            (20, 0, 10, (0, 10)),
            (20, 12, 10, (7, 17)),
            (20, 19, 10, (10, 20)),
            (20, 19, 1, (19, 20)),
        ] {
            assert_eq!(seen(count, chosen, room), expected, "{chosen} of {count} in {room}");
        }
    }

    #[test]
    fn a_narrow_terminal_shows_what_a_cell_does_and_leaves_the_host_out() {
        let narrow = Columns::of(&[], 80);
        assert!(narrow.host.is_none() && narrow.does >= 35, "{}", narrow.does);
        let row =
            narrow.row(">", ["cell-number-one-of-many", "passed", "2026-11-23 12:00", "WAITS", "x", "y"]);
        assert!(row.starts_with("> ") && row.contains('…') && row.ends_with("WAITS"), "{row}");
        assert!(Columns::of(&[], 120).host.is_some());
    }
}
