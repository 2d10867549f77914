//! Joins the screens to the world: keys, the engine's events, the model lab's answers, signals and a slow tick come in;
//! frames, commands and stops go out. Draws when something changed, thirty times a second at most.
//!
//! Keys are read by a task of its own, which fires the stop itself: neither a slow terminal nor a queue full of events
//! is between the stop key and the robots.

use std::io::{self, Write as _};
use std::sync::mpsc::Sender;
use std::time::Duration;

use futures_util::StreamExt as _;
use plumb_cell::RunHandle;
use plumb_cell::command::Command as RunCommand;
use plumb_cell::event::StampedEvent;
use ratatui::crossterm::event::{
    Event, EventStream, KeyEventKind, KeyModifiers, MouseButton, MouseEventKind,
};
use tokio::sync::mpsc::{UnboundedReceiver, UnboundedSender, unbounded_channel};
use tokio::time::{Instant, MissedTickBehavior, interval, sleep_until};

use super::history::{Archive, ArchiveAnswer, ArchiveRequest};
use super::keys::{Command, Context, command_for};
use super::message::{Action, Message};
use super::model::{Desk, Lab, LabAnswer, LabRequest};
use super::state::State;
use super::terminal::OpenTerminal;
use super::update::{obey, update};
use super::view::view;
use crate::signals::LeavingSignals;

/// The shortest time between two frames.
const FRAME: Duration = Duration::from_millis(33);
/// How often clocks on the screen advance.
const TICK: Duration = Duration::from_millis(250);
/// Events of the engine taken in between two looks at the keys.
const BATCH: usize = 256;

/// What the screens are joined to.
#[derive(Default)]
pub(crate) struct Sources {
    /// What the engine says; closed when the run is over.
    pub events: Option<UnboundedReceiver<StampedEvent>>,
    /// Where commands go, stops first; none for who only watches.
    pub handle: Option<RunHandle>,
    /// The model lab.
    pub lab: Option<Lab>,
    /// The record.
    pub archive: Option<Archive>,
    /// Reports that a signal asks the program to end, where somebody else has taken the signals over.
    pub ended_by_signal: Option<UnboundedReceiver<()>>,
}

/// Shows the screens until the operator leaves or a signal ends the program; gives back the state they were left in.
///
/// # Errors
/// The terminal cannot be used, or was lost; robots were commanded to stop.
pub(crate) async fn show(mut state: State, mut sources: Sources) -> io::Result<State> {
    let outside = Outside {
        handle: sources.handle.take(),
        lab: sources.lab.as_ref().map(Lab::desk),
        archive: sources.archive.as_ref().map(Archive::desk),
    };
    let shown = run(&mut state, &mut sources, &outside).await;
    if shown.is_err() {
        outside.stop();
    }
    shown.map(|()| state)
}

async fn run(state: &mut State, sources: &mut Sources, outside: &Outside) -> io::Result<()> {
    let mut terminal = OpenTerminal::open("plumb")?;
    state.size = terminal.size()?;
    let (to_here, mut keys) = unbounded_channel();
    tokio::spawn(read_keys(outside.handle.clone(), to_here));
    let mut ends = LeavingSignals::watch()?;
    let mut tick = interval(TICK);
    tick.set_missed_tick_behavior(MissedTickBehavior::Skip);
    let opened = Instant::now();
    let mut drawn: Option<Instant> = None;
    let mut dirty = true;
    let mut events = Vec::new();
    loop {
        if dirty && drawn.is_none_or(|drawn| drawn.elapsed() >= FRAME) {
            terminal.draw(|frame| view(state, frame))?;
            (drawn, dirty) = (Some(Instant::now()), false);
        }
        let next_frame = drawn.unwrap_or_else(Instant::now) + FRAME;
        let actions = tokio::select! {
            biased;
            () = ends.any() => obey(state, Command::LeaveNow),
            Some(()) = asked_to_end(&mut sources.ended_by_signal), if sources.ended_by_signal.is_some() => {
                obey(state, Command::LeaveNow)
            }
            message = keys.recv() => match message {
                Some(message) => update(state, message),
                // Nobody can press a key any more: the terminal is gone.
                None => obey(state, Command::LeaveNow),
            },
            () = sleep_until(next_frame), if dirty => continue,
            count = heard(&mut sources.events, &mut events), if sources.events.is_some() => {
                if count == 0 {
                    sources.events = None;
                }
                events.drain(..).flat_map(|event| update(state, Message::Engine(Box::new(event)))).collect()
            },
            answer = answered(&mut sources.lab), if sources.lab.is_some() => match answer {
                Some(answer) => update(state, Message::Lab(answer)),
                None => {
                    sources.lab = None;
                    Vec::new()
                }
            },
            answer = read(&mut sources.archive), if sources.archive.is_some() => match answer {
                Some(answer) => update(state, Message::Archive(answer)),
                None => {
                    sources.archive = None;
                    Vec::new()
                }
            },
            _ = tick.tick() => on_tick(state, outside, opened.elapsed()),
        };
        dirty = true;
        for action in actions {
            if !act(action, state, outside, &mut terminal)? {
                return Ok(());
            }
        }
    }
}

/// How far the calibration is, and the time since the screens opened.
fn on_tick(state: &mut State, outside: &Outside, elapsed: Duration) -> Vec<Action> {
    if let Some((fraction, doing)) = outside.lab.as_ref().and_then(Desk::how_far) {
        update(state, Message::LabProgress(fraction, doing));
    }
    update(state, Message::Tick(elapsed))
}

/// Does what the state asks for. Says whether the screens stay open.
fn act(
    action: Action,
    state: &mut State,
    outside: &Outside,
    terminal: &mut OpenTerminal,
) -> io::Result<bool> {
    match action {
        Action::Leave => return Ok(false),
        Action::Bell => terminal.ring()?,
        Action::Stop => outside.stop(),
        Action::Send(command) => outside.send_command(command),
        Action::Lab(request) => outside.lab(request),
        Action::CancelLab => outside.cancel_lab(),
        Action::Archive(request) => outside.archive(request),
        Action::SavePicture { name, bytes } => {
            let saved =
                bytes.and_then(|bytes| save_picture(&name, &bytes).map_err(|cause| cause.to_string()));
            update(state, Message::PictureSaved(saved));
        }
    }
    Ok(true)
}

/// Writes a picture under a name that nothing has yet; gives the name.
fn save_picture(name: &str, bytes: &[u8]) -> io::Result<String> {
    for number in 1_u32.. {
        let name = format!("{name}-{number}.png");
        match std::fs::File::create_new(&name) {
            Ok(mut file) => return file.write_all(bytes).map(|()| name),
            Err(cause) if cause.kind() == io::ErrorKind::AlreadyExists => {}
            Err(cause) => return Err(cause),
        }
    }
    Err(io::Error::other("there are too many pictures here"))
}

/// Where actions go.
struct Outside {
    handle: Option<RunHandle>,
    lab: Option<Desk>,
    archive: Option<Sender<ArchiveRequest>>,
}

impl Outside {
    fn stop(&self) {
        self.send_command(RunCommand::Stop);
    }

    /// Passes a command on. A run that is over takes none, and has said so itself.
    fn send_command(&self, command: RunCommand) {
        if let Some(handle) = &self.handle {
            let _over = handle.send(command);
        }
    }

    fn lab(&self, request: LabRequest) {
        if let Some(lab) = &self.lab {
            lab.ask(request);
        }
    }

    fn cancel_lab(&self) {
        if let Some(lab) = &self.lab {
            lab.cancel();
        }
    }

    /// Asks the record. One whose reader has ended takes nothing, and has said why.
    fn archive(&self, request: ArchiveRequest) {
        if let Some(archive) = &self.archive {
            let _ended = archive.send(request);
        }
    }
}

async fn heard(from: &mut Option<UnboundedReceiver<StampedEvent>>, events: &mut Vec<StampedEvent>) -> usize {
    match from {
        Some(from) => from.recv_many(events, BATCH).await,
        None => 0,
    }
}

async fn asked_to_end(signal: &mut Option<UnboundedReceiver<()>>) -> Option<()> {
    match signal {
        Some(signal) => signal.recv().await,
        None => None,
    }
}

async fn read(archive: &mut Option<Archive>) -> Option<ArchiveAnswer> {
    match archive {
        Some(archive) => archive.answer().await,
        None => None,
    }
}

async fn answered(lab: &mut Option<Lab>) -> Option<LabAnswer> {
    match lab {
        Some(lab) => lab.answer().await,
        None => None,
    }
}

/// Reads keys and mouse until the terminal is gone or nobody listens.
async fn read_keys(handle: Option<RunHandle>, to: UnboundedSender<Message>) {
    let mut events = EventStream::new();
    while let Some(Ok(event)) = events.next().await {
        if let Some(message) = heard_from_terminal(&event, handle.as_ref())
            && to.send(message).is_err()
        {
            break;
        }
    }
}

/// What a terminal event means here. A stop key stops the robots before anything else is done with it.
fn heard_from_terminal(event: &Event, handle: Option<&RunHandle>) -> Option<Message> {
    match event {
        Event::Key(key) if key.kind != KeyEventKind::Release => {
            match command_for(&[Context::Everywhere], key) {
                Some(command @ (Command::Stop | Command::StopAndLeave)) => {
                    if let Some(handle) = handle {
                        let _over = handle.send(RunCommand::Stop);
                    }
                    Some(Message::StopKey { leave: command == Command::StopAndLeave })
                }
                _ => Some(Message::Key(*key)),
            }
        }
        Event::Mouse(mouse) => match mouse.kind {
            MouseEventKind::Down(MouseButton::Left) => {
                Some(Message::Click { column: mouse.column, row: mouse.row })
            }
            MouseEventKind::Down(MouseButton::Right) => {
                Some(Message::Grab { column: mouse.column, row: mouse.row })
            }
            MouseEventKind::Drag(button) => Some(Message::Drag {
                column: mouse.column,
                row: mouse.row,
                moves: button == MouseButton::Right || mouse.modifiers.contains(KeyModifiers::CONTROL),
            }),
            MouseEventKind::ScrollUp => Some(Message::Scroll(-1)),
            MouseEventKind::ScrollDown => Some(Message::Scroll(1)),
            _ => None,
        },
        Event::Resize(width, height) => Some(Message::Resized { width: *width, height: *height }),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;
    use std::sync::atomic::{AtomicU32, Ordering};

    use plumb_cell::StopActions;
    use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyModifiers};

    use super::*;

    #[test]
    fn the_stop_key_reaches_the_robots_although_nobody_draws_or_listens() {
        let (commands, _never_read) = std::sync::mpsc::channel();
        let stops = StopActions::default();
        let fired = Arc::new(AtomicU32::new(0));
        let counter = Arc::clone(&fired);
        stops.set(
            "arm",
            Box::new(move || {
                counter.fetch_add(1, Ordering::SeqCst);
            }),
        );
        let handle = RunHandle::new(commands, stops);
        for (times, (code, modifiers, leave)) in
            [(KeyCode::Esc, KeyModifiers::NONE, false), (KeyCode::Char('c'), KeyModifiers::CONTROL, true)]
                .into_iter()
                .enumerate()
        {
            let event = Event::Key(KeyEvent::new(code, modifiers));
            let message = heard_from_terminal(&event, Some(&handle));
            assert!(
                matches!(message, Some(Message::StopKey { leave: found }) if found == leave),
                "{message:?}"
            );
            assert_eq!(fired.load(Ordering::SeqCst) as usize, times + 1);
        }
    }
}
