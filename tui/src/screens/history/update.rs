//! What keys do on the History screen, and what the record's answers change.

use ratatui::crossterm::event::KeyCode;

use super::archive::{ArchiveAnswer, ArchiveRequest};
use super::state::OpenedRun;
use crate::screens::keys::Command;
use crate::screens::message::Action;
use crate::screens::state::{Overlay, Severity, State};

/// Longer than anybody filters by.
const LONGEST_FILTER: usize = 60;

/// Asks the record for what the screen shows: when the screen is opened, and when a run has ended.
pub(crate) fn asked() -> Vec<Action> {
    vec![Action::Archive(ArchiveRequest::List)]
}

/// Does what a key of the History screen asks for.
pub(crate) fn obey(state: &mut State, command: Command) -> Vec<Action> {
    let Some(history) = &mut state.history else { return Vec::new() };
    let trends = history.trends.len().max(1);
    match command {
        Command::Filter => history.filtering = true,
        Command::FilterDone => history.filtering = false,
        Command::NextTrend => history.trend = (history.trend + 1) % trends,
        Command::PreviousTrend => history.trend = (history.trend + trends - 1) % trends,
        Command::CloseRun => history.opened = None,
        Command::OpenRun => {
            let Some(run) = history.run().map(|run| run.run.0) else { return Vec::new() };
            history.opened = Some(OpenedRun { run, lines: Vec::new(), scrolled: 0 });
            return vec![Action::Archive(ArchiveRequest::Open(run))];
        }
        _ => {}
    }
    Vec::new()
}

/// Asks whether to bring back the corrections of the chosen run, or has it done.
pub(crate) fn bring_back(state: &mut State, command: Command) -> Vec<Action> {
    let Some(history) = &mut state.history else { return Vec::new() };
    if command == Command::BringBackNow {
        state.overlay = None;
        return history
            .bring_back
            .take()
            .map(ArchiveRequest::BringBack)
            .map(Action::Archive)
            .into_iter()
            .collect();
    }
    match history.way_back() {
        Ok(back) => {
            history.bring_back = Some(back);
            state.overlay = Some(Overlay::BringBack);
        }
        Err(reason) => state.notify(Severity::Info, reason),
    }
    Vec::new()
}

/// Writes at the filter.
pub(crate) fn write(state: &mut State, key: KeyCode) {
    let Some(history) = &mut state.history else { return };
    match key {
        KeyCode::Char(letter) if history.filter.chars().count() < LONGEST_FILTER => {
            history.filter.push(letter);
        }
        KeyCode::Backspace => {
            history.filter.pop();
        }
        _ => {}
    }
    history.keep_choice_within();
}

/// Ends the filter, as the stop key does.
pub(crate) fn give_up(state: &mut State) {
    if let Some(history) = &mut state.history {
        history.filtering = false;
    }
}

/// Moves the choice, or the text of the run that is open.
pub(crate) fn scroll(state: &mut State, by: isize) {
    let Some(history) = &mut state.history else { return };
    if let Some(opened) = &mut history.opened {
        let last = opened.lines.len().saturating_sub(1);
        opened.scrolled = opened.scrolled.saturating_add_signed(by).min(last);
        return;
    }
    history.chosen = history.chosen.saturating_add_signed(by);
    history.keep_choice_within();
}

/// Chooses the run at an index of the list.
pub(crate) fn choose(state: &mut State, index: usize) {
    if let Some(history) = &mut state.history {
        history.chosen = index;
        history.keep_choice_within();
    }
}

/// Takes an answer of the record in.
pub(crate) fn take(state: &mut State, answer: ArchiveAnswer) {
    let Some(history) = &mut state.history else { return };
    match answer {
        ArchiveAnswer::Listed { runs, trends } => {
            (history.runs, history.trends, history.problem) = (Some(runs), trends, None);
            history.keep_choice_within();
        }
        ArchiveAnswer::Opened { run, lines } => {
            // The operator may have closed it again, or opened another.
            if let Some(opened) = history.opened.as_mut().filter(|opened| opened.run == run) {
                opened.lines = lines;
            }
        }
        ArchiveAnswer::BroughtBack(message) => state.notify(Severity::Info, message),
        ArchiveAnswer::NotBroughtBack(reason) => state.notify(Severity::Error, reason),
        ArchiveAnswer::Failed(reason) => history.problem = Some(reason),
    }
}
