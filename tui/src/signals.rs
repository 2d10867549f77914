//! The signals that ask a run to end, with who sent them. They are nobody's wish at the keyboard, and the record says so.

use std::io;
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;

use nix::sys::signal::{SigSet, Signal};
use nix::sys::signalfd::{SfdFlags, SignalFd};
use plumb_cell::RunHandle;
use plumb_cell::command::Command;
use plumb_host::process_name;
use tokio::signal::unix;
use tokio::sync::mpsc::{UnboundedReceiver, unbounded_channel};

/// The signals that end a run.
const ENDING: [Signal; 3] = [Signal::SIGTERM, Signal::SIGHUP, Signal::SIGINT];

/// What the system writes where no process sent a signal: a key of the terminal, or the terminal's end.
const SENT_BY_THE_SYSTEM: i32 = 0x80;

/// The signals that end a run, taken over from the system.
pub struct EndingSignals(SignalFd);

impl EndingSignals {
    /// Takes them over. Called before any thread is started, since each thread would else be ended by them.
    ///
    /// # Errors
    /// When the system does not hand them over.
    pub fn take_over() -> io::Result<Self> {
        let signals: SigSet = ENDING.into_iter().collect();
        signals.thread_block()?;
        Ok(Self(SignalFd::with_flags(&signals, SfdFlags::SFD_CLOEXEC)?))
    }

    /// Informs the run of the first of them, and then anyone who holds the receiver. With `keep` the run is left to be resumed; Ctrl-C at a terminal
    /// without screens is the operator's own abort.
    pub fn watch(self, handle: RunHandle, keep: bool) -> UnboundedReceiver<()> {
        let (heard, receiver) = unbounded_channel();
        thread::spawn(move || {
            while let Ok(Some(signal)) = self.0.read_signal() {
                let number = i32::try_from(signal.ssi_signo).unwrap_or_default();
                let sender = (signal.ssi_code != SENT_BY_THE_SYSTEM).then_some(signal.ssi_pid);
                let _over = handle.send(command_of(number, sender, keep));
                // Nobody listens when there are no screens.
                let _unheard = heard.send(());
            }
        });
        receiver
    }

    /// Hears them for runs that go on one after the other.
    pub(crate) fn in_turn(self) -> SignalsInTurn {
        let state = Arc::new(Mutex::new(InTurn::default()));
        let heard = Arc::clone(&state);
        thread::spawn(move || {
            while let Ok(Some(signal)) = self.0.read_signal() {
                let number = i32::try_from(signal.ssi_signo).unwrap_or_default();
                let sender = (signal.ssi_code != SENT_BY_THE_SYSTEM).then_some(signal.ssi_pid);
                let mut state = heard.lock().unwrap_or_else(PoisonError::into_inner);
                state.received.get_or_insert((number, sender));
                if let Some(run) = &state.run {
                    let _over = run.send(command_in_turn((number, sender)));
                }
            }
        });
        SignalsInTurn { state }
    }
}

/// A signal as it was received: its number, and who sent it.
type Received = (i32, Option<u32>);

/// Informs whichever run goes on of the signals, where one program carries out several in turn.
pub(crate) struct SignalsInTurn {
    state: Arc<Mutex<InTurn>>,
}

#[derive(Default)]
struct InTurn {
    /// The run that goes on.
    run: Option<RunHandle>,
    /// The first signal.
    received: Option<Received>,
}

impl SignalsInTurn {
    /// Informs this run from here on; at once, where a signal came already.
    pub(crate) fn forward_to(&self, run: &RunHandle) {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(received) = state.received {
            let _over = run.send(command_in_turn(received));
        }
        state.run = Some(run.clone());
    }

    /// Whether the program was asked to end.
    pub(crate) fn ask_to_end(&self) -> bool {
        self.state.lock().unwrap_or_else(PoisonError::into_inner).received.is_some()
    }
}

/// A run of several is kept for later when the program is asked to end; Ctrl-C is the operator's own abort.
fn command_in_turn((number, sender): Received) -> Command {
    command_of(number, sender, number != Signal::SIGINT as i32)
}

/// What a signal means for a run.
fn command_of(number: i32, sender: Option<u32>, keep: bool) -> Command {
    let name = Signal::try_from(number).map_or("a signal", Signal::as_str);
    match sender {
        None if number == Signal::SIGINT as i32 && !keep => Command::Abort,
        None if number == Signal::SIGHUP as i32 => {
            Command::EndFromOutside { by: format!("{name}: its terminal was closed"), keep }
        }
        sender => Command::EndFromOutside {
            by: format!("{name} from {}", process_name(sender.unwrap_or_default())),
            keep,
        },
    }
}

/// The signals that ask screens to be left, where no run has taken them over.
pub(crate) struct LeavingSignals {
    terminate: unix::Signal,
    hang_up: unix::Signal,
    interrupt: unix::Signal,
}

impl LeavingSignals {
    /// Watches for them from here on.
    ///
    /// # Errors
    /// The system does not hand them over.
    pub(crate) fn watch() -> io::Result<Self> {
        Ok(Self {
            terminate: unix::signal(unix::SignalKind::terminate())?,
            hang_up: unix::signal(unix::SignalKind::hangup())?,
            interrupt: unix::signal(unix::SignalKind::interrupt())?,
        })
    }

    /// Waits for any of them.
    pub(crate) async fn any(&mut self) {
        tokio::select! {
            _ = self.terminate.recv() => {}
            _ = self.hang_up.recv() => {}
            _ = self.interrupt.recv() => {}
        }
    }
}

/// Lets every signal through again: a program that was started by one that took some over would never get them.
pub fn let_through() {
    // Where the system refuses this, signals stay as they were inherited.
    let _ = SigSet::empty().thread_set_mask();
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_signal_is_reported_as_what_it_is() {
        let own = std::process::id();
        let Command::EndFromOutside { by, keep: false } = command_of(15, Some(own), false) else { panic!() };
        assert!(by.starts_with(&format!("SIGTERM from process {own} (")), "{by}");
        assert_eq!(command_of(2, None, false), Command::Abort, "Ctrl-C is the operator's");
        assert!(
            matches!(command_of(2, Some(own), false), Command::EndFromOutside { .. }),
            "kill -INT is not"
        );
        let closed = Command::EndFromOutside { by: "SIGHUP: its terminal was closed".to_owned(), keep: true };
        assert_eq!(command_of(1, None, true), closed);
    }
}
