//! Commands as the engine takes them in.

use std::collections::VecDeque;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::Duration;

use crate::command::{Command, PauseWhen};

/// What ends or interrupts what the engine does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Interrupt {
    /// Wait now; the step in hand begins again.
    Pause,
    /// All motion stopped; wait.
    Stop,
    /// End as aborted.
    Abort,
    /// End early, in good order.
    Finish,
    /// Leave the run as it stands, to be resumed.
    Keep,
}

/// More answers than this at once come from nobody who looks.
const MOST_PASSED_OVER: usize = 100;

/// The queue of commands.
pub(crate) struct Inbox {
    receiver: Receiver<Command>,
    /// What was passed over in a look for interrupts: it may be for a prompt that is open.
    passed_over: VecDeque<Command>,
    /// A pause before the next step was asked for.
    pub(crate) pause_before_next: bool,
}

impl Inbox {
    pub(crate) fn new(receiver: Receiver<Command>) -> Self {
        Self { receiver, passed_over: VecDeque::new(), pause_before_next: false }
    }

    /// Takes in what has come while the engine was busy. Answers and jogs are kept for who asks next; a resume of what runs is ignored.
    pub(crate) fn interrupt(&mut self) -> Option<Interrupt> {
        while let Ok(command) = self.receiver.try_recv() {
            if let Some(interrupt) = self.as_interrupt(&command) {
                return Some(interrupt);
            }
            let for_a_prompt =
                matches!(command, Command::Answer { .. } | Command::Jog { .. } | Command::HandOver { .. });
            if for_a_prompt && self.passed_over.len() < MOST_PASSED_OVER {
                self.passed_over.push_back(command);
            }
        }
        None
    }

    /// What a command interrupts, if it does.
    pub(crate) fn as_interrupt(&mut self, command: &Command) -> Option<Interrupt> {
        match command {
            Command::Pause { when: PauseWhen::Now } => Some(Interrupt::Pause),
            Command::Pause { when: PauseWhen::BeforeNextStep } => {
                self.pause_before_next = true;
                None
            }
            Command::Stop => Some(Interrupt::Stop),
            Command::Abort => Some(Interrupt::Abort),
            Command::Finish => Some(Interrupt::Finish),
            Command::Keep => Some(Interrupt::Keep),
            Command::Answer { .. } | Command::Jog { .. } | Command::HandOver { .. } | Command::Resume => None,
        }
    }

    /// The next command, or none when `time` has passed. When nobody can command any more, the time is waited out.
    pub(crate) fn next(&mut self, time: Duration) -> Option<Command> {
        if let Some(command) = self.passed_over.pop_front() {
            return Some(command);
        }
        match self.receiver.recv_timeout(time) {
            Ok(command) => Some(command),
            Err(RecvTimeoutError::Timeout) => None,
            Err(RecvTimeoutError::Disconnected) => {
                std::thread::sleep(time);
                None
            }
        }
    }
}
