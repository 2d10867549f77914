//! Draws the state: header, page, notice, keys, stop bar, and what lies over them. Lays out from the frame's own area.

use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Position, Rect};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Clear, Paragraph, Wrap};

use super::history::BringBack;
use super::keys::Command;
use super::run::Phase;
use super::screen::Screen;
use super::state::{Overlay, Severity, State};
use super::{cell, footer, help, history, log, model, pane, run, scan};

/// Below this width or height there is room for the stop key and no page.
const SMALLEST: (u16, u16) = (24, 6);

/// The rows of the terminal.
struct Rows {
    header: Rect,
    body: Rect,
    notice: Rect,
    hints: Rect,
    stop: Rect,
}

fn rows(state: &State, area: Rect) -> Rows {
    let [header, body, notice, hints, stop] = Layout::vertical([
        Constraint::Length(1),
        Constraint::Fill(1),
        Constraint::Length(u16::from(state.notice.is_some())),
        Constraint::Length(1),
        Constraint::Length(u16::from(state.run.is_some())),
    ])
    .areas(area);
    Rows { header, body, notice, hints, stop }
}

/// Draws everything.
pub(crate) fn view(state: &State, frame: &mut Frame) {
    state.hits.clear();
    let area = frame.area();
    if area.width < SMALLEST.0 || area.height < SMALLEST.1 {
        too_small(state, frame, area);
        return;
    }
    let rows = rows(state, area);
    header(state, frame, rows.header);
    match state.screen {
        Screen::Cell => cell::view(state, frame, rows.body),
        Screen::Run => run::view(state, frame, rows.body),
        Screen::Model => model::view(state, frame, rows.body),
        Screen::History => history::view(state, frame, rows.body),
        Screen::Log => log::view(state, frame, rows.body),
        Screen::Scan => scan::view(state, frame, rows.body),
    }
    if let Some(notice) = &state.notice {
        let (sign, style) = match notice.severity {
            Severity::Info => (" \u{b7} ", state.theme.text),
            Severity::Warning => (" ! ", state.theme.warning),
            Severity::Error => (" \u{2717} ", state.theme.bad),
        };
        let text = pane::fitted(&notice.text, usize::from(area.width).saturating_sub(3));
        frame.render_widget(Line::styled(format!("{sign}{text}"), style), rows.notice);
    }
    footer::hints(state, frame, rows.hints);
    footer::stop_bar(state, frame, rows.stop);
    match state.overlay {
        Some(Overlay::Help { scrolled }) => help::view(state, frame, rows.body, scrolled),
        Some(Overlay::Leave) => question(state, frame, rows.body, "Leave?", &leaving(state)),
        Some(Overlay::Abort) => question(state, frame, rows.body, "Abort the run?", ABORT),
        Some(Overlay::BringBack) => {
            let asked = state.history.as_ref().and_then(|history| history.bring_back.as_ref());
            let text = asked.map(BringBack::question).unwrap_or_default();
            question(state, frame, rows.body, "Bring earlier corrections back?", &text);
        }
        Some(Overlay::Candidate) => model::details(state, frame, rows.body),
        Some(Overlay::AddRejected) => {
            let asked = state.model.as_ref().and_then(|model| model.doubtful.as_ref());
            let text = asked.map(model::Doubtful::question).unwrap_or_default();
            question(state, frame, rows.body, "Add what was not named?", &text);
        }
        None => {}
    }
}

/// What leaving an open run comes to, with the command that takes it up again.
fn leaving(state: &State) -> String {
    let run = state.run.as_ref().and_then(|run| run.number).map_or_else(String::new, |run| format!(" {run}"));
    format!(
        "A run is open.\n\n  k  keep it and leave; what takes it up again:\n     plumb run --resume{run}{}\n  a  abort it and leave\n  s  stay",
        state.record_option
    )
}

const ABORT: &str = "The run ends here. What was found so far stays in the record; corrections that are not in force \
                     yet are dropped.\n\n  y  abort the run\n  n  go back; nothing moves by going back";

/// What a click at a position of the terminal asks for.
pub(crate) fn command_at(state: &State, column: u16, row: u16) -> Option<Command> {
    let area = Rect::new(0, 0, state.size.0, state.size.1);
    if area.width < SMALLEST.0 || area.height < SMALLEST.1 {
        return None;
    }
    let (rows, position) = (rows(state, area), Position::new(column, row));
    if rows.stop.contains(position) {
        return Some(Command::Stop);
    }
    let tab = || tabs(state, rows.header).into_iter().find(|(_, area)| area.contains(position));
    footer::command_at(state, rows.hints, position).or_else(|| tab().map(|(screen, _)| Command::Show(screen)))
}

/// The name of the cell or model, the tabs, and the state of the run.
fn header(state: &State, frame: &mut Frame, area: Rect) {
    frame.render_widget(Line::styled(title(state, area), state.theme.heading), area);
    for (screen, area) in tabs(state, area) {
        let style = if screen == state.screen { state.theme.chosen } else { state.theme.text };
        let number = Screen::ALL.iter().position(|other| *other == screen).map_or(0, |index| index + 1);
        frame.render_widget(Line::styled(format!(" {number} {} ", screen.name()), style), area);
    }
    let (word, style) = run_status(state);
    let width = u16::try_from(Span::raw(word.as_str()).width()).unwrap_or(0).saturating_add(1);
    let tabs_end = tabs(state, area).last().map_or(0, |(_, tab)| tab.right());
    if area.width > tabs_end.saturating_add(width) {
        let status_area = Rect::new(area.right().saturating_sub(width), area.y, width, 1);
        frame.render_widget(Line::styled(word, style), status_area);
    }
}

/// Columns kept free at the right of the header for the state of the run.
const STATUS_WIDTH: u16 = 24;

/// The program and the name of what it shows, cut where tabs and status need the room.
fn title(state: &State, area: Rect) -> String {
    let name = match (&state.run, &state.model) {
        (Some(_), _) => state.cell.name.as_str(),
        (None, Some(model)) => model.arm.as_str(),
        (None, None) if state.scan.is_some() => "a cloud",
        (None, None) => return of_record(state, area),
    };
    titled(name, state, area)
}

/// The same where nothing but the record is open: whose it is.
fn of_record(state: &State, area: Rect) -> String {
    let whose = state.history.as_ref().and_then(history::HistoryState::whose);
    let name = whose.map_or_else(|| "the record".to_owned(), |whose| format!("the record of {whose}"));
    titled(&name, state, area)
}

fn titled(name: &str, state: &State, area: Rect) -> String {
    let tabs: u16 = state.screens().iter().map(|screen| tab_width(*screen)).sum();
    let run_status = if state.run.is_some() { STATUS_WIDTH } else { 0 };
    let room = area.width.saturating_sub(tabs.saturating_add(run_status).saturating_add(2));
    pane::fitted(&format!(" plumb \u{b7} {name}"), usize::from(room))
}

/// The tabs and where they are; only as many as fit.
fn tabs(state: &State, area: Rect) -> Vec<(Screen, Rect)> {
    let title = u16::try_from(Span::raw(title(state, area)).width()).unwrap_or(0);
    let mut left = area.left().saturating_add(title).saturating_add(2);
    let widths: u16 = state.screens().iter().map(|screen| tab_width(*screen)).sum();
    if left.saturating_add(widths) > area.right() {
        left = area.right().saturating_sub(widths).max(area.left());
    }
    let mut tabs = Vec::new();
    for screen in state.screens() {
        let width = tab_width(screen);
        if left.saturating_add(width) > area.right() {
            break;
        }
        tabs.push((screen, Rect::new(left, area.y, width, 1)));
        left = left.saturating_add(width);
    }
    tabs
}

fn tab_width(screen: Screen) -> u16 {
    u16::try_from(screen.name().len()).unwrap_or(0).saturating_add(4)
}

/// The state of the run, in a sign, a word and the time it has taken.
fn run_status(state: &State) -> (String, ratatui::style::Style) {
    let Some(run) = &state.run else { return (String::new(), state.theme.text) };
    let elapsed = run.elapsed(state.now).as_secs();
    let time = format!("{}:{:02}", elapsed / 60, elapsed % 60);
    match &run.phase {
        Phase::Starting => ("\u{25cc} starting".to_owned(), state.theme.warning),
        Phase::Running if run.prompt.is_some() => (format!("? waits for you {time}"), state.theme.focus),
        Phase::Running if state.cell.is_moving() => (format!("\u{25b8} moving {time}"), state.theme.good),
        Phase::Running => (format!("\u{25b8} running {time}"), state.theme.good),
        Phase::Paused { .. } => (format!("\u{2016} paused {time}"), state.theme.warning),
        Phase::Ended { outcome, .. } => {
            let (sign, word, style) = run::outcome_look(*outcome, &state.theme);
            (format!("{sign} {word} {time}"), style)
        }
    }
}

/// Columns of a question, its frame included.
const QUESTION_WIDTH: u16 = 66;

/// Rows that a question takes, its frame included.
fn rows_of(text: &str) -> u16 {
    let room = usize::from(QUESTION_WIDTH - 2);
    let rows: usize = text.lines().map(|line| Span::raw(line).width().div_ceil(room).max(1)).sum();
    u16::try_from(rows + 2).unwrap_or(u16::MAX)
}

/// A question over the page, its answers listed by their keys.
fn question(state: &State, frame: &mut Frame, area: Rect, title: &str, text: &str) {
    let area = area.centered(Constraint::Max(QUESTION_WIDTH), Constraint::Max(rows_of(text).max(9)));
    frame.render_widget(Clear, area);
    let inner = pane::open(frame, area, &state.theme, title, true);
    frame.render_widget(Paragraph::new(text).wrap(Wrap { trim: false }), inner);
}

/// The page when there is no room for one.
fn too_small(state: &State, frame: &mut Frame, area: Rect) {
    let text =
        if state.run.is_some() { "Esc STOP\nThis window is too small." } else { "This window is too small." };
    frame.render_widget(Paragraph::new(text).style(state.theme.stop).wrap(Wrap { trim: true }), area);
}
