//! What a host says besides its answers: log lines, progress, output, its end.

use std::collections::VecDeque;
use std::io::{BufRead, BufReader, Read};
use std::sync::mpsc::Sender;
use std::sync::{Arc, Mutex, PoisonError};

use plumb_plugin::LogLevel;

use super::ExitReason;
use super::shared::Shared;
use crate::channel::FromHost;

/// What a host says besides its answers. Handed to the listener of [`HostCommand::on_event`](crate::HostCommand::on_event), within the
/// tracing span of the call it served.
#[derive(Clone, Debug, PartialEq)]
pub enum HostEvent {
    /// A log line of the plugin or the host.
    Log {
        /// How important.
        level: LogLevel,
        /// The line.
        text: String,
    },
    /// A line the plugin wrote to its standard output or error.
    Output {
        /// The line.
        text: String,
    },
    /// How far a long call has come.
    Progress {
        /// From 0 to 1.
        fraction: f64,
        /// What it does now.
        text: String,
    },
    /// The host process has ended.
    Ended {
        /// How.
        reason: ExitReason,
    },
}

/// Who is told.
pub(super) type Listener = dyn Fn(&str, &HostEvent) + Send + Sync;

/// How many lines of output are kept for the reason of an end.
const TAIL: usize = 20;

/// The longest line of output kept whole, in bytes.
const LONGEST_LINE: u64 = 4096;

/// The last lines of a host's output.
#[derive(Default)]
pub(super) struct Tail(Mutex<VecDeque<String>>);

impl Tail {
    fn push(&self, line: String) {
        let mut lines = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if lines.len() == TAIL {
            lines.pop_front();
        }
        lines.push_back(line);
    }

    pub(super) fn lines(&self) -> Vec<String> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).iter().cloned().collect()
    }
}

/// Reads a host's output until it ends.
pub(super) fn read_output(output: impl Read, shared: &Shared) {
    let mut output = BufReader::new(output);
    loop {
        let mut line = Vec::new();
        match output.by_ref().take(LONGEST_LINE).read_until(b'\n', &mut line) {
            Ok(0) | Err(_) => return,
            Ok(_) => {
                let text = String::from_utf8_lossy(&line).trim_end().to_owned();
                if !text.is_empty() {
                    shared.tail.push(text.clone());
                    shared.tell(shared.spans.under_way(), &HostEvent::Output { text });
                }
            }
        }
    }
}

/// Reads a host's lines until the connection ends; the first word that says how it started goes to `started`.
pub(super) fn read_lines(connection: impl Read, shared: &Arc<Shared>, started: &Sender<FromHost>) {
    for line in BufReader::new(connection).lines() {
        let Ok(line) = line else { return };
        match serde_json::from_str(&line) {
            Ok(FromHost::Log { level, text, span }) => shared.tell(span, &HostEvent::Log { level, text }),
            Ok(FromHost::Progress { fraction, text, span }) => {
                shared.tell(span, &HostEvent::Progress { fraction, text });
            }
            // Nobody waits for a second word on how it started.
            Ok(word) => drop(started.send(word)),
            Err(error) => {
                let text = format!("a line of the host of {} cannot be understood: {error}", shared.device);
                shared.tell(0, &HostEvent::Log { level: LogLevel::Warn, text });
            }
        }
    }
}
