//! The one place where the screens' state changes: a message comes in, the state changes, actions go out. It touches
//! nothing outside, so that everything an operator can do is a test.

use std::time::Duration;

use plumb_cell::command::Command as RunCommand;
use plumb_cell::event::{Event, LogLevel, RunOutcome, StampedEvent, StepOutcome};
use ratatui::crossterm::event::{KeyEvent, KeyModifiers};
use ratatui::layout::Position;

use super::history;
use super::hits::Hit;
use super::keys::{Command, command_for};
use super::message::{Action, Message};
use super::model;
use super::run::{self, PAGE, Phase};
use super::scan;
use super::screen::Screen;
use super::state::{Leaving, Overlay, Severity, State};
use super::view::command_at;

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
                Ok(name) => state.notify(Severity::Info, format!("Picture saved: {name}")),
                Err(reason) => state.notify(Severity::Error, format!("The picture was not saved: {reason}")),
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
            run::pass_time(state);
            leave_when_at_rest(state)
        }
    }
}

fn key(state: &mut State, event: &KeyEvent) -> Vec<Action> {
    if let Some(command) = command_for(&state.contexts(), event) {
        return obey(state, command);
    }
    if state.is_naming() {
        model::write(state, event.code);
    } else if state.is_filtering() {
        history::write(state, event.code);
    } else if state.is_typing() && !event.modifiers.intersects(KeyModifiers::CONTROL | KeyModifiers::ALT) {
        run::write(state, event.code);
    }
    Vec::new()
}

fn click(state: &mut State, column: u16, row: u16) -> Vec<Action> {
    if let Some(command) = command_at(state, column, row) {
        return obey(state, command);
    }
    // What lies over the page takes no clicks but those on its keys.
    match state.hits.at(Position::new(column, row)).filter(|_| state.overlay.is_none()) {
        Some(Hit::Option(index)) => run::choose_at(state, index),
        Some(Hit::Answer) => return obey(state, Command::Answer),
        Some(Hit::Text { .. }) => run::scroll(state, PAGE),
        Some(Hit::Card(index)) => return model::choose_at(state, index),
        Some(Hit::Row(row)) => return model::point_at(state, row),
        Some(Hit::Run(index)) => history::choose(state, index),
        Some(Hit::Cloud) => return scan::click(state, column, row),
        Some(Hit::Views) | None => {}
    }
    Vec::new()
}

/// Does what a key or a click asks for.
pub(crate) fn obey(state: &mut State, command: Command) -> Vec<Action> {
    if command != Command::HandOver {
        run::keep_the_arm(state);
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
        _ => return run::obey(state, command),
    }
    Vec::new()
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
        state.notify(Severity::Info, text);
    }
    Vec::new()
}

fn show_beside(state: &mut State, by: isize) -> Vec<Action> {
    let screens = state.screens();
    let here = screens.iter().position(|screen| *screen == state.screen).unwrap_or(0);
    let count = isize::try_from(screens.len()).unwrap_or(1).max(1);
    let there = (isize::try_from(here).unwrap_or(0) + by).rem_euclid(count);
    match usize::try_from(there).ok().and_then(|index| screens.get(index)) {
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
        Screen::Run => run::scroll(state, by),
        Screen::Model => return model::choose(state, by),
        Screen::History => history::scroll(state, by),
        Screen::Log => state.log.scroll(by),
        Screen::Scan => scan::scroll(state, by),
        Screen::Cell => {}
    }
    Vec::new()
}

fn note_stop(state: &mut State, leave: bool) -> Vec<Action> {
    let works = model::give_up(state);
    history::give_up(state);
    state.overlay = if !leave {
        None
    } else if state.has_open_run() {
        Some(Overlay::Leave)
    } else {
        state.overlay
    };
    if state.run.is_some()
        && let Some(text) = stop_notice(state)
    {
        state.notify(Severity::Warning, text);
    }
    if works { vec![Action::CancelLab] } else { Vec::new() }
}

/// What a stop key says of a run; nothing where the run says more itself.
fn stop_notice(state: &State) -> Option<&'static str> {
    if state.only_watches() {
        Some("Nothing was stopped: this program only watches.")
    } else if state.cell.is_moving() {
        Some("Stop sent to every robot. Watch the arm until it rests.")
    } else if has_paused_with_news(state) {
        None
    } else {
        Some("Stop sent to every robot; none reported that it was moving.")
    }
}

/// Whether the run has paused and says so, or says what went wrong.
///
/// A stop reaches the run before this key reaches the screens, so that the run's own news of the stop can come
/// first. It says more than that a stop was sent.
fn has_paused_with_news(state: &State) -> bool {
    state.run.as_ref().is_some_and(|run| matches!(run.phase, Phase::Paused { .. }))
        && state.notice.as_ref().is_some_and(|notice| notice.severity != Severity::Info)
}

fn engine(state: &mut State, stamped: &StampedEvent) -> Vec<Action> {
    state.cell.take(&stamped.event);
    state.log.take(stamped);
    scan::take(state, &stamped.event);
    let now = state.now;
    let needed = state.run.as_mut().is_some_and(|run| run.take(&stamped.event, now));
    show_news(state, &stamped.event);
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
        actions.push(Action::Send(RunCommand::Abort));
    }
    if state.has_open_run() && state.leaving.is_none() {
        state.overlay = None;
        state.leaving = Some(Leaving { since: state.now, aborts });
        state.notify(Severity::Warning, "Leaving as soon as the robots are at rest.");
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
fn show_news(state: &mut State, event: &Event) {
    match event {
        Event::PromptAsked { .. } if state.screen != Screen::Run => {
            state.notify(Severity::Warning, "The run asks something: 2 shows it.");
        }
        Event::Stopped { reason } => state.notify(Severity::Warning, format!("Stopped: {reason}")),
        Event::Paused { reason, .. } => {
            state.notify(Severity::Warning, format!("Paused: {reason}. Nothing moves until r resumes."));
        }
        Event::Resumed => state.notice = None,
        // What went wrong before is mended once a step has passed again.
        Event::StepFinished { outcome: StepOutcome::Passed, .. } => {
            state.notice.take_if(|notice| notice.severity == Severity::Error);
        }
        Event::Log { level: LogLevel::Error, source, message, .. } => {
            state.notify(Severity::Error, format!("{source}: {message}"));
        }
        Event::PromptAnswered { .. } => state.notice = None,
        Event::RunEnded { .. } if state.screen == Screen::Run => state.notice = None,
        Event::RunEnded { outcome, message, .. } => {
            let severity = match outcome {
                RunOutcome::Passed => Severity::Info,
                RunOutcome::Aborted | RunOutcome::NeedsOperator => Severity::Warning,
                RunOutcome::Failed | RunOutcome::Error => Severity::Error,
            };
            state.notify(severity, message.clone());
        }
        _ => {}
    }
}
