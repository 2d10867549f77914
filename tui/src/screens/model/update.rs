//! What keys do on the Model screen, and what the lab's answers change.

use plumb_cell::event::LogLevel;
use ratatui::crossterm::event::KeyCode;

use super::names;
use super::request::{LabAnswer, LabRequest};
use super::residuals::PLANES;
use super::state::{Busy, CardStatus, Doubtful, FITTING, ModelState, SCALES};
use crate::screens::keys::Command;
use crate::screens::message::Action;
use crate::screens::state::{Overlay, Severity, State};

/// What the lab does while it looks for what could explain the rest.
const JUDGING: &str = "judging what could explain the rest";

/// Does what a key of the Model screen asks for.
pub(crate) fn obey(state: &mut State, command: Command) -> Vec<Action> {
    let Some(model) = &mut state.model else { return Vec::new() };
    match command {
        Command::NextPlane => model.plane = (model.plane + 1) % PLANES.len(),
        Command::PreviousPlane => model.plane = (model.plane + PLANES.len() - 1) % PLANES.len(),
        Command::NameEffect => model.naming = Some(String::new()),
        Command::CompleteName => {
            if let Some(name) = &model.naming {
                model.naming = Some(names::completed(model.summary.as_ref(), name));
            }
        }
        Command::Details if model.card().is_some() => state.overlay = Some(Overlay::Candidate),
        Command::NextWorst => point_beside(model, 1),
        Command::PreviousWorst => point_beside(model, -1),
        Command::Scale => {
            (model.scale, model.scale_kept) = ((model.scale + 1) % SCALES.len(), true);
        }
        Command::Cancel if model.busy.is_some() => return vec![Action::CancelLab],
        Command::Preview if model.preview.is_some() => model.preview = None,
        Command::Preview
        | Command::Add
        | Command::AddNow
        | Command::AddNamed
        | Command::Undo
        | Command::Judge => return ask(state, command),
        _ => {}
    }
    Vec::new()
}

/// Ends what is being named and pointed at, as the stop key does; whether the lab is at work.
pub(crate) fn give_up(state: &mut State) -> bool {
    state.model.as_mut().is_some_and(|model| {
        (model.naming, model.pointed) = (None, None);
        model.busy.is_some()
    })
}

/// Points out the row beside the one that is, in the order of the worst; past either end none.
fn point_beside(model: &mut ModelState, by: isize) {
    let worst = model.summary.as_ref().map_or_else(Vec::new, |summary| summary.residuals.worst());
    let here = model.pointed.and_then(|row| worst.iter().position(|other| *other == row));
    let there = match here {
        Some(index) => index.checked_add_signed(by),
        None if by > 0 => Some(0),
        None => worst.len().checked_sub(1),
    };
    model.pointed = there.and_then(|index| worst.get(index).copied());
}

/// Points out a row of the table; the same again points out none.
pub(crate) fn point_at(state: &mut State, row: usize) -> Vec<Action> {
    if let Some(model) = &mut state.model {
        model.pointed = if model.pointed == Some(row) { None } else { Some(row) };
    }
    Vec::new()
}

/// Why an effect should not be added without a question: the lab has judged and not named it.
fn doubts(model: &ModelState, effect: &str) -> Option<Doubtful> {
    let bare = |name: &str| name.split_whitespace().collect::<String>();
    let cards = &model.summary.as_ref()?.cards;
    let card = cards.iter().find(|card| bare(&card.key) == bare(effect))?;
    let reason = if card.reason.is_empty() { "the lab gives no reason" } else { card.reason.as_str() };
    let is_chosen = model.card().is_some_and(|chosen| chosen.key == card.key);
    let doubtful = Doubtful { effect: card.key.clone(), reason: reason.to_owned(), is_chosen };
    (card.status == CardStatus::Rejected).then_some(doubtful)
}

/// Gives the lab what a key asks for, unless it is at work or there is nothing to give.
fn ask(state: &mut State, command: Command) -> Vec<Action> {
    let now = state.now;
    let Some(model) = &mut state.model else { return Vec::new() };
    let named = model.naming.take();
    if let Some(busy) = model.busy.as_ref().filter(|busy| !busy.only_judges) {
        let text = format!("The lab is at work ({}); c gives that up.", busy.doing);
        state.notify(Severity::Info, text);
        return Vec::new();
    }
    let chosen = model.card().map(|card| card.key.clone());
    let doubtful = model.doubtful.take();
    let is_added = model.card().is_some_and(|card| card.status == CardStatus::InModel);
    if is_added && matches!(command, Command::Add | Command::Preview) {
        state.notify(Severity::Info, "That is in the model already; u takes what was added last away.");
        return Vec::new();
    }
    let request = match command {
        Command::Undo => model.can_undo().then_some(LabRequest::Undo),
        Command::Judge => model.can_judge().then_some(LabRequest::Judge),
        Command::Preview => chosen.map(LabRequest::Preview),
        Command::AddNow => {
            state.overlay = None;
            doubtful.map(|doubtful| LabRequest::Add(doubtful.effect))
        }
        Command::AddNamed => named.filter(|name| !name.trim().is_empty()).map(LabRequest::AddNamed),
        _ => chosen.map(LabRequest::Add),
    };
    let Some(request) = request else {
        let text = match command {
            Command::Undo => "Nothing was added that could be undone.",
            Command::Judge => "The candidates are judged, or being judged.",
            _ => "There is no candidate to take.",
        };
        state.notify(Severity::Info, text);
        return Vec::new();
    };
    if let (LabRequest::Add(effect) | LabRequest::AddNamed(effect), false) =
        (&request, command == Command::AddNow)
        && let Some(doubtful) = doubts(model, effect)
    {
        model.doubtful = Some(doubtful);
        state.overlay = Some(Overlay::AddRejected);
        return Vec::new();
    }
    let doing = match &request {
        LabRequest::Preview(effect) => format!("previewing {effect}"),
        LabRequest::Add(effect) | LabRequest::AddNamed(effect) => format!("adding {effect}"),
        LabRequest::Undo => "undoing".to_owned(),
        LabRequest::Judge => JUDGING.to_owned(),
    };
    // Where nothing is fitted yet, that comes first.
    model.busy = Some(match (&request, &model.summary) {
        (LabRequest::Judge, None) => Busy::with(FITTING, now, false),
        _ => Busy::with(&doing, now, request == LabRequest::Judge),
    });
    state.notice = None;
    vec![Action::Lab(request)]
}

/// Writes at the name of an effect.
pub(crate) fn write(state: &mut State, key: KeyCode) {
    let Some(name) = state.model.as_mut().and_then(|model| model.naming.as_mut()) else { return };
    match key {
        // Longer than the name of any effect.
        KeyCode::Char(letter) if name.chars().count() < 120 => name.push(letter),
        KeyCode::Backspace => {
            name.pop();
        }
        _ => {}
    }
}

/// Chooses another candidate; pages scroll the plots.
pub(crate) fn choose(state: &mut State, by: isize) -> Vec<Action> {
    let Some(model) = &mut state.model else { return Vec::new() };
    if by.abs() > 3 {
        let plots = model.summary.as_ref().map_or(0, |summary| summary.residuals.series.len());
        model.plots_scrolled = model.plots_scrolled.saturating_add_signed(by.signum()).min(plots);
        return Vec::new();
    }
    let chosen = model.chosen.saturating_add_signed(by);
    choose_at(state, chosen)
}

/// Chooses the candidate at an index of the list, or the last.
pub(crate) fn choose_at(state: &mut State, index: usize) -> Vec<Action> {
    let Some(model) = &mut state.model else { return Vec::new() };
    let count = model.summary.as_ref().map_or(0, |summary| summary.cards.len());
    let chosen = index.min(count.saturating_sub(1));
    if chosen != model.chosen {
        model.chosen = chosen;
        model.preview = None;
    }
    Vec::new()
}

/// Notes how far the lab is with what it does.
pub(crate) fn note_progress(state: &mut State, fraction: f64, doing: String) {
    if let Some(busy) = state.model.as_mut().and_then(|model| model.busy.as_mut()) {
        busy.progress = Some((fraction, doing));
    }
}

/// Takes an answer of the lab in.
pub(crate) fn take(state: &mut State, answer: LabAnswer) -> Vec<Action> {
    let Some(model) = &mut state.model else { return Vec::new() };
    match answer {
        LabAnswer::Compared(summary) => {
            model.take(*summary);
            model.busy = Some(Busy::with(JUDGING, state.now, true));
        }
        LabAnswer::Examined(summary) => {
            model.busy = None;
            let outcome = format!("{}: {}", summary.verdict, summary.sentence);
            let news = summary.warnings.iter().map(|warning| (LogLevel::Warning, warning.clone()));
            for (level, line) in news.chain([(LogLevel::Info, outcome)]) {
                state.log.note(level, "lab", line);
            }
            model.take(*summary);
        }
        LabAnswer::Doubted(doubtful) => {
            model.busy = None;
            model.doubtful = Some(doubtful);
            state.overlay = Some(Overlay::AddRejected);
        }
        LabAnswer::Previewed(preview) => {
            model.busy = None;
            // The operator may have gone on to another candidate meanwhile.
            if model.card().is_some_and(|card| card.key == preview.candidate) {
                model.preview = Some(*preview);
            }
        }
        LabAnswer::Did(news) => {
            for line in &news {
                state.log.note(LogLevel::Info, "lab", line.clone());
            }
            if let Some(first) = news.first() {
                let more = match news.len() - 1 {
                    0 => String::new(),
                    1 => " One fitted value moved: see Log.".to_owned(),
                    count => format!(" {count} fitted values moved: see Log."),
                };
                state.notify(Severity::Info, format!("{first}.{more}"));
            }
        }
        LabAnswer::GaveUp { judging } => {
            if model.busy.take_if(|busy| busy.only_judges == judging).is_some() {
                let text = match (judging, &model.summary) {
                    (true, _) => "Judging was given up; j takes it up again.",
                    (false, Some(_)) => "Given up; the model is as it was.",
                    (false, None) => "Given up before anything was fitted; j starts over.",
                };
                state.notify(Severity::Info, text);
            }
        }
        LabAnswer::Failed(reason) => {
            model.busy = None;
            state.notify(Severity::Error, reason);
        }
    }
    Vec::new()
}
