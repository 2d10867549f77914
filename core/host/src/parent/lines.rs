//! What a host says besides its answers: log lines, progress, output, its end.

use std::collections::VecDeque;
use std::io::{BufRead, BufReader, ErrorKind, Read};
use std::os::fd::AsFd;
use std::os::unix::net::UnixStream;
use std::sync::mpsc::Sender;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use nix::poll::{PollFd, PollFlags, poll};
use plumb_plugin::LogLevel;

use super::ExitReason;
use super::shared::Shared;
use crate::channel::FromHost;
use crate::flood::{Allowance, Flood, LONGEST_ANSWER, LONGEST_TEXT, TELL_EVERY};
use crate::time_limits::{BEAT, HOST_SILENT, beats};

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
const TAIL: usize = 60;

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

/// Reads a host's output until it ends. It is always taken in, however much there is: a plugin that prints must not wait for a reader. What is
/// more than the log takes is left out and counted.
pub(super) fn read_output(output: impl Read + AsFd, shared: &Shared) {
    OutputReader {
        output: BufReader::with_capacity(OUTPUT_BUFFER, output),
        shared,
        flood: Flood::new(Allowance::OUTPUT, Instant::now()),
        told: Instant::now(),
    }
    .read_all();
}

/// A pipe holds this much; reading all of it at once keeps a plugin that prints running.
const OUTPUT_BUFFER: usize = 64 * 1024;

struct OutputReader<'a, R> {
    output: BufReader<R>,
    shared: &'a Shared,
    flood: Flood,
    /// When it was last said that lines were left out.
    told: Instant,
}

impl<R: Read + AsFd> OutputReader<'_, R> {
    fn read_all(mut self) {
        let mut line = Vec::new();
        loop {
            // What waits longer than a beat is shown, whether its line has ended or not.
            let waits = !line.is_empty() || self.flood.has_left_out();
            if waits && self.output.buffer().is_empty() && self.is_silent() {
                self.take(&mut line);
                self.tell_left_out();
            }
            let Ok(piece) = self.output.fill_buf() else { break };
            if piece.is_empty() {
                break;
            }
            let room = piece.len().min(LONGEST_TEXT - line.len());
            let (taken, ends) = match piece.iter().take(room).position(|byte| *byte == b'\n') {
                Some(end) => (end + 1, true),
                None => (room, false),
            };
            line.extend_from_slice(piece.get(..taken).unwrap_or_default());
            self.output.consume(taken);
            if ends || line.len() >= LONGEST_TEXT {
                self.take(&mut line);
            }
        }
        self.take(&mut line);
        self.tell_left_out();
    }

    /// Whether nothing comes for a beat.
    fn is_silent(&self) -> bool {
        let mut ready = [PollFd::new(self.output.get_ref().as_fd(), PollFlags::POLLIN)];
        matches!(poll(&mut ready, BEAT.as_millis() as u16), Ok(0))
    }

    fn take(&mut self, line: &mut Vec<u8>) {
        let now = Instant::now();
        let text = String::from_utf8_lossy(line.trim_ascii_end()).into_owned();
        line.clear();
        if text.is_empty() || !self.flood.lets_through(text.len(), now) {
            return;
        }
        if self.told.elapsed() >= TELL_EVERY {
            self.tell_left_out();
        }
        self.shared.tail.push(text.clone());
        self.shared.tell(self.shared.spans.under_way(), &HostEvent::Output { text });
    }

    fn tell_left_out(&mut self) {
        let left_out = self.flood.take_left_out();
        if !left_out.is_none() {
            self.told = Instant::now();
            self.shared.tell(self.shared.spans.under_way(), &HostEvent::Output { text: left_out.line() });
        }
    }
}

/// Reads a host's lines until the connection ends; the first word that says how it started goes to `started`. With `minds_silence` a host that
/// has begun to speak and then says nothing for [`HOST_SILENT`] is killed: it does not run.
pub(super) fn read_lines(
    connection: UnixStream,
    shared: &Arc<Shared>,
    started: &Sender<FromHost>,
    minds_silence: bool,
) {
    // Where the system sets no time limit, a frozen host is noticed by the time limit of what it is asked.
    let _ = connection.set_read_timeout(Some(BEAT));
    let mut connection = BufReader::new(connection);
    let (mut line, mut silent_beats, mut has_spoken) = (Vec::new(), 0, false);
    loop {
        match connection.by_ref().take(LONGEST_WORD).read_until(b'\n', &mut line) {
            Ok(0) => return,
            Ok(_) => {
                (silent_beats, has_spoken) = (0, true);
                if line.ends_with(b"\n") {
                    hear(&line, shared, started);
                    line.clear();
                } else if line.len() as u64 >= LONGEST_WORD {
                    line.clear();
                }
            }
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {
                silent_beats += 1;
                if has_spoken && minds_silence && silent_beats >= beats(HOST_SILENT) {
                    shared.kill(&format!(
                        "its process did not run for {HOST_SILENT:?} (frozen by a signal, held by a debugger, or without computing time)"
                    ));
                }
            }
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            Err(_) => return,
        }
    }
}

/// The longest line of a host: its description, with room.
const LONGEST_WORD: u64 = 4 * LONGEST_ANSWER as u64;

fn hear(line: &[u8], shared: &Arc<Shared>, started: &Sender<FromHost>) {
    match serde_json::from_slice(line) {
        Ok(FromHost::Alive) => {}
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
