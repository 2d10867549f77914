//! What keys do on the Run screen, and to a run from every other: answers, jogging, pausing, aborting.

use plumb_cell::command::{Command as RunCommand, PauseWhen};
use plumb_cell::prompt::{Answer, Decision};
use ratatui::crossterm::event::KeyCode;

use super::prompt::OpenPrompt;
use super::state::Phase;
use crate::screens::keys::Command;
use crate::screens::message::Action;
use crate::screens::screen::Screen;
use crate::screens::state::{Overlay, Severity, State};

/// Lines a page key scrolls.
pub(crate) const PAGE: isize = 10;

fn prompt(state: &mut State) -> Option<&mut OpenPrompt> {
    state.run.as_mut().and_then(|run| run.prompt.as_mut())
}

/// Gives the open prompt what time it is by the screens' clock.
pub(crate) fn pass_time(state: &mut State) {
    let now = state.now;
    if let Some(prompt) = prompt(state) {
        prompt.pass_time(now);
    }
}

/// Takes back that the arm was about to be handed over: any other key does.
pub(crate) fn keep_the_arm(state: &mut State) {
    if let Some(prompt) = prompt(state) {
        prompt.keep_the_arm();
    }
}

/// Writes at the answer.
pub(crate) fn write(state: &mut State, key: KeyCode) {
    let Some(prompt) = prompt(state) else { return };
    match key {
        KeyCode::Char(character) => {
            prompt.typed(character);
        }
        KeyCode::Backspace => prompt.erase(),
        _ => {}
    }
}

/// Chooses the option at an index of the list.
pub(crate) fn choose_at(state: &mut State, index: usize) {
    if let Some(prompt) = prompt(state) {
        prompt.choose_at(index);
    }
}

/// Scrolls the text of a prompt by pages where it is cut; otherwise the choice moves.
pub(crate) fn scroll(state: &mut State, by: isize) {
    let cut = state.hits.cut_text().filter(|_| by.abs() == PAGE);
    let Some(prompt) = prompt(state) else { return };
    match cut {
        Some((page, hidden)) => prompt.read_on(by > 0, page, hidden),
        None => prompt.choose(by),
    }
}

/// Does what a key that concerns the run asks for.
pub(crate) fn obey(state: &mut State, command: Command) -> Vec<Action> {
    if state.only_watches() && !matches!(command, Command::Large | Command::SwapViews) {
        state.notify(Severity::Info, "Watching only: the run is controlled where it was started.");
        return Vec::new();
    }
    let paused = state.run.as_ref().is_some_and(|run| matches!(run.phase, Phase::Paused { .. }));
    match command {
        Command::Answer => return answer(state, |prompt| prompt.answer()),
        Command::LeaveToWorld => return answer(state, |_| Ok(Answer::Simulated)),
        Command::Retry => return answer(state, |prompt| decided(prompt, Decision::Retry)),
        Command::MoveArm => return answer(state, |prompt| decided(prompt, Decision::Move)),
        Command::GoBack => return answer(state, |prompt| decided(prompt, Decision::Back)),
        Command::Skip => return answer(state, |prompt| decided(prompt, Decision::Skip)),
        Command::Pause if paused => state.notify(Severity::Info, "The run is paused already: r goes on."),
        Command::Pause => {
            state.notify(Severity::Info, "Pausing before the next step; Esc stops at once.");
            return vec![Action::Send(RunCommand::Pause { when: PauseWhen::BeforeNextStep })];
        }
        Command::Resume if paused => return vec![Action::Send(RunCommand::Resume)],
        Command::Resume => state.notify(Severity::Info, "The run is not paused."),
        Command::Abort => state.overlay = Some(Overlay::Abort),
        Command::AbortNow => {
            state.overlay = None;
            return vec![Action::Send(RunCommand::Abort)];
        }
        Command::Finish => return vec![Action::Send(RunCommand::Finish)],
        Command::SwapViews => {
            if let Some(run) = &mut state.run {
                run.views_swapped = !run.views_swapped;
            }
        }
        Command::Large => {
            let is_shown = state.screen == Screen::Run;
            if let Some(run) = &mut state.run {
                run.large = !(is_shown && run.large);
                state.screen = Screen::Run;
            }
        }
        Command::JogForwards => return jog(state, 1.0),
        Command::JogBackwards => return jog(state, -1.0),
        Command::HandOver => return hand_over(state),
        Command::JogMore | Command::JogLess => {
            if let Some(prompt) = prompt(state) {
                prompt.change_step(if command == Command::JogMore { 1 } else { -1 });
            }
        }
        _ => {}
    }
    Vec::new()
}

fn answer(state: &mut State, make: impl Fn(&mut OpenPrompt) -> Result<Answer, String>) -> Vec<Action> {
    let by = state.operator.clone();
    let Some(prompt) = prompt(state) else { return Vec::new() };
    if prompt.answered {
        return Vec::new();
    }
    match make(prompt) {
        Ok(answer) => {
            prompt.answered = true;
            prompt.refused = None;
            vec![Action::Send(RunCommand::Answer { prompt: prompt.prompt.id, answer, by })]
        }
        Err(reason) => {
            prompt.refuse(&reason);
            vec![Action::Bell]
        }
    }
}

fn decided(prompt: &mut OpenPrompt, decision: Decision) -> Result<Answer, String> {
    prompt.decide(decision).ok_or_else(|| match decision {
        Decision::Move => "no arm can be moved here".to_owned(),
        Decision::Back => "no step before this one asked anything".to_owned(),
        other => format!("{} is not offered here", other.name()),
    })
}

fn jog(state: &mut State, sign: f64) -> Vec<Action> {
    let Some(prompt) = prompt(state) else { return Vec::new() };
    prompt.refused = None;
    prompt.jog(sign).map(Action::Send).into_iter().collect()
}

fn hand_over(state: &mut State) -> Vec<Action> {
    let now = state.now;
    match prompt(state).map(|prompt| prompt.hand_over(now)) {
        Some(Ok(command)) => vec![Action::Send(command)],
        Some(Err(reason)) => {
            if let Some(prompt) = prompt(state) {
                prompt.refuse(&reason);
            }
            vec![Action::Bell]
        }
        None => Vec::new(),
    }
}
