//! What keys do on the Model screen, and what the lab's answers change.

use super::lab::{LabAnswer, LabRequest};
use super::state::{ModelState, SCALES};
use crate::screens::keys::Command;
use crate::screens::message::Action;
use crate::screens::state::{Gravity, State};

/// Does what a key of the Model screen asks for.
pub(crate) fn obey(state: &mut State, command: Command) -> Vec<Action> {
    let now = state.now;
    let Some(model) = &mut state.model else { return Vec::new() };
    match command {
        Command::NextPlot => turn(model, 1),
        Command::PreviousPlot => turn(model, -1),
        Command::Scale => model.scale = Some((model.scale.unwrap_or(0) + 1) % SCALES.len()),
        Command::Preview if model.preview.is_some() => model.preview = None,
        Command::Preview | Command::Add | Command::Undo => {
            if let Some((doing, _)) = &model.busy {
                let text = format!("The lab is busy ({doing}); one thing at a time.");
                state.say(Gravity::Calm, text);
                return Vec::new();
            }
            let wanted = match command {
                Command::Undo => model.can_undo().then(|| (LabRequest::Undo, "undoing".to_owned())),
                Command::Add => model
                    .card()
                    .map(|card| (LabRequest::Add(card.key.clone()), format!("adding {}", card.key))),
                _ => model
                    .card()
                    .map(|card| (LabRequest::Preview(card.key.clone()), format!("previewing {}", card.key))),
            };
            let Some((request, doing)) = wanted else {
                let text = if command == Command::Undo {
                    "Nothing was added here that could be undone."
                } else {
                    "There is no candidate to take."
                };
                state.say(Gravity::Calm, text);
                return Vec::new();
            };
            model.busy = Some((doing, now));
            state.notice = None;
            return vec![Action::Lab(request)];
        }
        _ => {}
    }
    Vec::new()
}

/// Chooses another candidate; pages scroll the plots.
pub(crate) fn choose(state: &mut State, by: isize) -> Vec<Action> {
    let Some(model) = &mut state.model else { return Vec::new() };
    if by.abs() > 3 {
        let plots = model.standing.as_ref().map_or(0, |standing| standing.residuals.against.len());
        model.plots_scrolled = model.plots_scrolled.saturating_add_signed(by.signum()).min(plots);
        return Vec::new();
    }
    let count = model.standing.as_ref().map_or(0, |standing| standing.cards.len());
    let chosen = model.chosen.saturating_add_signed(by).min(count.saturating_sub(1));
    if chosen != model.chosen {
        model.chosen = chosen;
        model.preview = None;
    }
    Vec::new()
}

/// Takes an answer of the lab in.
pub(crate) fn take(state: &mut State, answer: LabAnswer) -> Vec<Action> {
    let Some(model) = &mut state.model else { return Vec::new() };
    match answer {
        LabAnswer::Doing(what) => model.busy = Some((what, state.now)),
        LabAnswer::Examined(standing) => {
            model.busy = None;
            model.take(*standing);
        }
        LabAnswer::Previewed(preview) => {
            model.busy = None;
            // The operator may have gone on to another candidate meanwhile.
            if model.card().is_some_and(|card| card.key == preview.candidate) {
                model.preview = Some(*preview);
            }
        }
        LabAnswer::Failed(reason) => {
            model.busy = None;
            state.say(Gravity::Fault, reason);
        }
    }
    Vec::new()
}

fn turn(model: &mut ModelState, by: isize) {
    let count = model.standing.as_ref().map_or(0, |standing| standing.residuals.directions.len());
    let count = isize::try_from(count).unwrap_or(0).max(1);
    let there = (isize::try_from(model.direction).unwrap_or(0) + by).rem_euclid(count);
    model.direction = usize::try_from(there).unwrap_or(0);
}
