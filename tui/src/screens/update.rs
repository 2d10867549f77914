//! The one place where the screens' state changes: a message comes in, the state changes, actions go out. It touches
//! nothing outside, so that everything an operator can do is a test.

use std::time::Duration;

use plumb_cell::command::{Command as Tell, PauseWhen};
use plumb_cell::event::{Event, LogLevel, RunOutcome, StampedEvent, StepOutcome};
use plumb_cell::prompt::{Answer, Decision};
use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyModifiers};
use ratatui::layout::Position;

use super::history;
use super::hits::Hit;
use super::keys::{Command, command_for};
use super::message::{Action, Message};
use super::model;
use super::run::{OpenPrompt, Phase};
use super::scan;
use super::screen::Screen;
use super::state::{Gravity, Leaving, Overlay, State};
use super::view::command_at;

/// Lines a page key scrolls.
const PAGE: isize = 10;

/// How long the program waits for a run to come to rest before it closes all the same.
const LONGEST_LEAVING: Duration = Duration::from_secs(5);

/// Changes `state` as `message` asks and says what is to be done outside.
pub(crate) fn update(state: &mut State, message: Message) -> Vec<Action> {
    match message {
        Message::Key(event) => key(state, &event),
        Message::StopKey { leave } => note_stop(state, leave),
        Message::Click { column, row } => click(state, column, row),
        Message::Grab { column, row } => {
            scan::grab(state, column, row);
            Vec::new()
        }
        Message::Drag { column, row, moves } => {
            if state.screen == Screen::Scan && state.overlay.is_none() {
                scan::drag(state, column, row, moves);
            }
            Vec::new()
        }
        Message::PictureSaved(saved) => {
            match saved {
                Ok(name) => state.say(Gravity::Calm, format!("Picture saved: {name}")),
                Err(reason) => state.say(Gravity::Fault, format!("The picture was not saved: {reason}")),
            }
            Vec::new()
        }
        Message::Scroll(lines) => scroll(state, if lines < 0 { -3 } else { 3 }),
        Message::Resized { width, height } => {
            state.size = (width, height);
            Vec::new()
        }
        Message::Engine(event) => engine(state, &event),
        Message::Lab(answer) => model::take(state, answer),
        Message::LabProgress(fraction, doing) => {
            model::note_progress(state, fraction, doing);
            Vec::new()
        }
        Message::Archive(answer) => {
            history::take(state, answer);
            Vec::new()
        }
        Message::Tick(now) => {
            state.now = now;
            if let Some(prompt) = prompt(state) {
                prompt.pass_time(now);
            }
            leave_when_at_rest(state)
        }
    }
}

fn key(state: &mut State, event: &KeyEvent) -> Vec<Action> {
    if let Some(command) = command_for(&state.places(), event) {
        return obey(state, command);
    }
    if state.is_naming() {
        model::write(state, event.code);
    } else if state.is_filtering() {
        history::write(state, event.code);
    } else if state.is_typing()
        && !event.modifiers.intersects(KeyModifiers::CONTROL | KeyModifiers::ALT)
        && let Some(prompt) = prompt(state)
    {
        match event.code {
            KeyCode::Char(character) => {
                prompt.typed(character);
            }
            KeyCode::Backspace => prompt.erase(),
            _ => {}
        }
    }
    Vec::new()
}

fn click(state: &mut State, column: u16, row: u16) -> Vec<Action> {
    if let Some(command) = command_at(state, column, row) {
        return obey(state, command);
    }
    // What lies over the page takes no clicks but those on its keys.
    match state.hits.at(Position::new(column, row)).filter(|_| state.overlay.is_none()) {
        Some(Hit::Option(place)) => {
            if let Some(prompt) = prompt(state) {
                prompt.choose_at(place);
            }
        }
        Some(Hit::Answer) => return obey(state, Command::Answer),
        Some(Hit::Text { .. }) => scroll_prompt(state, PAGE),
        Some(Hit::Card(place)) => return model::choose_at(state, place),
        Some(Hit::Row(row)) => return model::point_at(state, row),
        Some(Hit::Run(place)) => history::choose(state, place),
        Some(Hit::Cloud) => return scan::click(state, column, row),
        Some(Hit::Views) | None => {}
    }
    Vec::new()
}

/// Does what a key or a click asks for.
pub(crate) fn obey(state: &mut State, command: Command) -> Vec<Action> {
    if command != Command::HandOver
        && let Some(prompt) = prompt(state)
    {
        prompt.keep_the_arm();
    }
    match command {
        Command::Stop | Command::StopAndLeave => {
            let mut actions = vec![Action::Stop];
            actions.extend(note_stop(state, command == Command::StopAndLeave));
            return actions;
        }
        Command::Help => {
            state.overlay = match state.overlay {
                Some(Overlay::Help { .. }) => None,
                _ => Some(Overlay::Help { scrolled: 0 }),
            };
        }
        Command::Close => state.overlay = None,
        Command::Leave if state.has_open_run() => state.overlay = Some(Overlay::Leave),
        Command::Leave | Command::LeaveNow => return leave(state, false),
        Command::AbortAndLeave => return leave(state, true),
        Command::Show(screen) => return show(state, screen),
        Command::NextScreen => return show_beside(state, 1),
        Command::PreviousScreen => return show_beside(state, -1),
        Command::Up => return scroll(state, -1),
        Command::Down => return scroll(state, 1),
        Command::PageUp => return scroll(state, -PAGE),
        Command::PageDown => return scroll(state, PAGE),
        Command::Preview
        | Command::Add
        | Command::AddNow
        | Command::Details
        | Command::NextWorst
        | Command::PreviousWorst
        | Command::CompleteName
        | Command::Undo
        | Command::NameEffect
        | Command::AddNamed
        | Command::NextPlane
        | Command::PreviousPlane
        | Command::Scale
        | Command::Cancel
        | Command::Judge => return model::obey(state, command),
        Command::Scan(command) => return scan::obey(state, command),
        Command::BringBack | Command::BringBackNow => return history::bring_back(state, command),
        Command::OpenRun
        | Command::CloseRun
        | Command::Filter
        | Command::FilterDone
        | Command::NextTrend
        | Command::PreviousTrend => return history::obey(state, command),
        _ => return obey_in_run(state, command),
    }
    Vec::new()
}

/// Does what concerns the run.
fn obey_in_run(state: &mut State, command: Command) -> Vec<Action> {
    if state.only_watches() && !matches!(command, Command::Large | Command::SwapViews) {
        state.say(Gravity::Calm, "Watching only: the run is controlled where it was started.");
        return Vec::new();
    }
    let paused = state.run.as_ref().is_some_and(|run| matches!(run.phase, Phase::Paused { .. }));
    match command {
        Command::Answer => return answer(state, |prompt| prompt.answer()),
        Command::LeaveToWorld => return leave_to_world(state),
        Command::Retry => return answer(state, |prompt| decided(prompt, Decision::Retry)),
        Command::MoveArm => return answer(state, |prompt| decided(prompt, Decision::Move)),
        Command::GoBack => return answer(state, |prompt| decided(prompt, Decision::Back)),
        Command::Skip => return answer(state, |prompt| decided(prompt, Decision::Skip)),
        Command::Pause if paused => state.say(Gravity::Calm, "The run is paused already: r goes on."),
        Command::Pause => {
            state.say(Gravity::Calm, "Pausing before the next step; Esc stops at once.");
            return vec![Action::Tell(Tell::Pause { when: PauseWhen::BeforeNextStep })];
        }
        Command::Resume if paused => return vec![Action::Tell(Tell::Resume)],
        Command::Resume => state.say(Gravity::Calm, "The run is not paused."),
        Command::Abort => state.overlay = Some(Overlay::Abort),
        Command::AbortNow => {
            state.overlay = None;
            return vec![Action::Tell(Tell::Abort)];
        }
        Command::Finish => return vec![Action::Tell(Tell::Finish)],
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
            vec![Action::Tell(Tell::Answer { prompt: prompt.prompt.id, answer, by })]
        }
        Err(reason) => {
            prompt.refuse(&reason);
            vec![Action::Bell]
        }
    }
}

/// Leaves the open prompt, and all later ones it can answer, to the simulated world.
fn leave_to_world(state: &mut State) -> Vec<Action> {
    let by = state.operator.clone();
    let Some(prompt) = prompt(state).filter(|prompt| !prompt.answered) else { return Vec::new() };
    prompt.answered = true;
    prompt.refused = None;
    vec![Action::Tell(Tell::LeaveToWorld { prompt: prompt.prompt.id, by })]
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
    prompt.jog(sign).map(Action::Tell).into_iter().collect()
}

fn hand_over(state: &mut State) -> Vec<Action> {
    let now = state.now;
    match prompt(state).map(|prompt| prompt.hand_over(now)) {
        Some(Ok(command)) => vec![Action::Tell(command)],
        Some(Err(reason)) => {
            if let Some(prompt) = prompt(state) {
                prompt.refuse(&reason);
            }
            vec![Action::Bell]
        }
        None => Vec::new(),
    }
}

fn prompt(state: &mut State) -> Option<&mut OpenPrompt> {
    state.run.as_mut().and_then(|run| run.prompt.as_mut())
}

fn show(state: &mut State, screen: Screen) -> Vec<Action> {
    if state.screens().contains(&screen) {
        state.screen = screen;
        state.overlay = None;
        state.notice = None;
        if screen == Screen::History {
            return history::asked();
        }
    } else {
        let text = match screen {
            Screen::Model => "No model and table are open: plumb model screen MODEL --data CSV opens them.",
            Screen::Scan => "No scan has begun: plumb stripe show CLOUD opens a stored cloud.",
            Screen::History => "No record is open: plumb history --screen opens it.",
            _ => "No cell is open: plumb run CELL opens one.",
        };
        state.say(Gravity::Calm, text);
    }
    Vec::new()
}

fn show_beside(state: &mut State, by: isize) -> Vec<Action> {
    let screens = state.screens();
    let here = screens.iter().position(|screen| *screen == state.screen).unwrap_or(0);
    let count = isize::try_from(screens.len()).unwrap_or(1).max(1);
    let there = (isize::try_from(here).unwrap_or(0) + by).rem_euclid(count);
    match usize::try_from(there).ok().and_then(|place| screens.get(place)) {
        Some(screen) => show(state, *screen),
        None => Vec::new(),
    }
}

fn scroll(state: &mut State, by: isize) -> Vec<Action> {
    if let Some(Overlay::Help { scrolled }) = &mut state.overlay {
        let by = i16::try_from(by).unwrap_or(0);
        *scrolled = scrolled.saturating_add_signed(by).min(super::help::lines());
        return Vec::new();
    }
    match state.screen {
        Screen::Run => scroll_prompt(state, by),
        Screen::Model => return model::choose(state, by),
        Screen::History => history::scroll(state, by),
        Screen::Log => state.log.scroll(by),
        Screen::Scan => scan::scroll(state, by),
        Screen::Cell => {}
    }
    Vec::new()
}

/// Scrolls the text of a prompt by pages where it is cut; otherwise the choice moves.
fn scroll_prompt(state: &mut State, by: isize) {
    let cut = state.hits.cut_text().filter(|_| by.abs() == PAGE);
    let Some(prompt) = prompt(state) else { return };
    match cut {
        Some((page, hidden)) => prompt.read_on(by > 0, page, hidden),
        None => prompt.choose(by),
    }
}

fn note_stop(state: &mut State, leave: bool) -> Vec<Action> {
    let works = state.model.as_mut().is_some_and(|model| {
        (model.naming, model.pointed) = (None, None);
        model.busy.is_some()
    });
    if let Some(history) = &mut state.history {
        history.filtering = false;
    }
    state.overlay = if !leave {
        None
    } else if state.has_open_run() {
        Some(Overlay::Leave)
    } else {
        state.overlay
    };
    if state.only_watches() && state.run.is_some() {
        state.say(Gravity::Attention, "Nothing was stopped: this program only watches.");
    } else if state.run.is_some() {
        let text = if state.cell.is_moving() {
            "Stop sent to every robot. Watch the arm until it rests."
        } else {
            "Stop sent to every robot; none reported that it was moving."
        };
        state.say(Gravity::Attention, text);
    }
    if works { vec![Action::CancelLab] } else { Vec::new() }
}

fn engine(state: &mut State, stamped: &StampedEvent) -> Vec<Action> {
    state.cell.take(&stamped.event);
    state.log.take(stamped);
    scan::take(state, &stamped.event);
    let now = state.now;
    let needed = state.run.as_mut().is_some_and(|run| run.take(&stamped.event, now));
    tell_news(state, &stamped.event);
    let mut actions = leave_when_at_rest(state);
    if needed {
        actions.push(Action::Bell);
    }
    let changed = matches!(
        stamped.event,
        Event::RunEnded { .. } | Event::CorrectionApplied { .. } | Event::CorrectionUndone { .. }
    );
    if changed && state.screen == Screen::History {
        actions.extend(history::asked());
    }
    actions
}

/// Stops the robots and closes the screens once the run is at rest; asked for twice, at once.
fn leave(state: &mut State, aborts: bool) -> Vec<Action> {
    let mut actions = vec![Action::Stop];
    if aborts {
        actions.push(Action::Tell(Tell::Abort));
    }
    if state.has_open_run() && state.leaving.is_none() {
        state.overlay = None;
        state.leaving = Some(Leaving { since: state.now, aborts });
        state.say(Gravity::Attention, "Leaving as soon as the robots are at rest.");
        actions.extend(leave_when_at_rest(state));
    } else {
        actions.push(Action::Leave);
    }
    actions
}

/// Closes the screens if that is wanted and the run is at rest, or has not come to rest in a time no run needs.
fn leave_when_at_rest(state: &State) -> Vec<Action> {
    let Some(leaving) = state.leaving else { return Vec::new() };
    let at_rest = match state.run.as_ref().map(|run| &run.phase) {
        None | Some(Phase::Ended { .. }) => true,
        Some(Phase::Paused { .. }) => !leaving.aborts,
        Some(Phase::Starting | Phase::Running) => false,
    };
    let waited = state.now.saturating_sub(leaving.since);
    if at_rest || waited > LONGEST_LEAVING { vec![Action::Leave] } else { Vec::new() }
}

/// Puts what an operator must not miss on the line above the footer, and shows the page that needs them.
fn tell_news(state: &mut State, event: &Event) {
    match event {
        Event::PromptAsked { .. } if state.screen != Screen::Run => {
            state.say(Gravity::Attention, "The run asks something: 2 shows it.");
        }
        Event::Stopped { reason } => state.say(Gravity::Attention, format!("Stopped: {reason}")),
        Event::Paused { reason, .. } => {
            state.say(Gravity::Attention, format!("Paused: {reason}. Nothing moves until r resumes."));
        }
        Event::Resumed => state.notice = None,
        // What went wrong before is mended once a step has passed again.
        Event::StepFinished { outcome: StepOutcome::Passed, .. } => {
            state.notice.take_if(|notice| notice.grave == Gravity::Fault);
        }
        Event::Log { level: LogLevel::Error, source, message, .. } => {
            state.say(Gravity::Fault, format!("{source}: {message}"));
        }
        Event::PromptAnswered { .. } => state.notice = None,
        Event::RunEnded { .. } if state.screen == Screen::Run => state.notice = None,
        Event::RunEnded { outcome, message, .. } => {
            let grave = match outcome {
                RunOutcome::Passed => Gravity::Calm,
                RunOutcome::Aborted | RunOutcome::NeedsOperator => Gravity::Attention,
                RunOutcome::Failed | RunOutcome::Error => Gravity::Fault,
            };
            state.say(grave, message.clone());
        }
        _ => {}
    }
}
