//! The connection to the orchestrator: how the host learns that it is to end, or that the orchestrator is gone.

use std::io::{BufRead, BufReader};
use std::os::fd::AsFd;
use std::os::unix::net::UnixStream;
use std::sync::atomic::{AtomicU8, Ordering};
use std::thread;

use nix::poll::{PollFd, PollFlags, poll};
use nix::sys::signal::{SigSet, Signal as SystemSignal};
use nix::sys::signalfd::{SfdFlags, SignalFd};
use plumb_bus::Signal;
use plumb_plugin::LogLevel;

use super::ending::end_at_once;
use crate::channel::{ToHost, exit_code};
use crate::context::Context;
use crate::process_name::process_name;
use crate::time_limits::{BEAT, LAST_STOP, ORCHESTRATOR_SILENT, beats};

/// How the host is to end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Ending {
    /// In good order.
    Finish,
    /// The orchestrator is gone, or the system wants the host to end.
    Orphaned,
}

/// Whether the host is to end, read by the main thread.
#[derive(Default)]
pub(super) struct EndingFlag(AtomicU8);

impl EndingFlag {
    pub(super) fn get(&self) -> Option<Ending> {
        match self.0.load(Ordering::Acquire) {
            1 => Some(Ending::Finish),
            2 => Some(Ending::Orphaned),
            _ => None,
        }
    }

    fn set(&self, ending: Ending) {
        self.0.fetch_max(if ending == Ending::Finish { 1 } else { 2 }, Ordering::AcqRel);
    }
}

/// Blocks the signal that asks the process to end, in this thread and all it starts: the lifeline thread takes it instead.
pub(super) fn block_termination() -> nix::Result<()> {
    let mut set = SigSet::empty();
    set.add(SystemSignal::SIGTERM);
    set.thread_block()
}

/// Starts the thread that holds the line. `wake` is the signal the main thread waits for.
pub(super) fn hold(
    context: &'static Context,
    ending: &'static EndingFlag,
    stream: BufReader<UnixStream>,
    wake: Signal,
    under_debugger: bool,
) {
    let lifeline = Lifeline { context, stream, wake, minds_silence: !under_debugger, silent_beats: 0 };
    thread::spawn(move || lifeline.hold(ending));
}

/// The line to the orchestrator.
struct Lifeline {
    context: &'static Context,
    stream: BufReader<UnixStream>,
    wake: Signal,
    /// Whether a robot in motion is stopped when nothing is heard.
    minds_silence: bool,
    silent_beats: u32,
}

impl Lifeline {
    fn hold(mut self, ending: &'static EndingFlag) {
        let finish = self.wait_for_ending() == Ending::Finish;
        if finish {
            ending.set(Ending::Finish);
        } else {
            self.context.stop.ask();
            ending.set(Ending::Orphaned);
        }
        if self.wake.notify().is_err() || !finish {
            thread::sleep(LAST_STOP);
            let text = "the orchestrator is gone and the plugin did not come to rest";
            self.context.announce(LogLevel::Error, text);
            end_at_once(self.context, exit_code::ORPHANED);
        }
    }

    /// Waits for the word to finish, the end of the connection, or the signal to end.
    fn wait_for_ending(&mut self) -> Ending {
        let mut set = SigSet::empty();
        set.add(SystemSignal::SIGTERM);
        let Ok(signals) = SignalFd::with_flags(&set, SfdFlags::SFD_CLOEXEC) else { return Ending::Orphaned };
        loop {
            if self.stream.buffer().is_empty() {
                let mut ready = [
                    PollFd::new(self.stream.get_ref().as_fd(), PollFlags::POLLIN),
                    PollFd::new(signals.as_fd(), PollFlags::POLLIN),
                ];
                match poll(&mut ready, BEAT_MS) {
                    Err(nix::errno::Errno::EINTR) => continue,
                    Err(_) => return Ending::Orphaned,
                    Ok(0) => {
                        self.note_silence();
                        continue;
                    }
                    Ok(_) if ready[1].any().unwrap_or(true) => {
                        self.report_signal(&signals);
                        return Ending::Orphaned;
                    }
                    Ok(_) => {}
                }
            }
            let mut line = String::new();
            match self.stream.read_line(&mut line) {
                Ok(0) | Err(_) => return Ending::Orphaned,
                Ok(_) if serde_json::from_str(&line).is_ok_and(|word: ToHost| word == ToHost::Finish) => {
                    return Ending::Finish;
                }
                Ok(_) => self.silent_beats = 0,
            }
        }
    }

    /// Nothing was heard for another beat: a robot that moves without an orchestrator is stopped.
    fn note_silence(&mut self) {
        self.silent_beats = self.silent_beats.saturating_add(1);
        let is_frozen = self.silent_beats >= beats(ORCHESTRATOR_SILENT);
        if !is_frozen || !self.minds_silence || !self.context.is_in_motion() || self.context.stop.is_asked() {
            return;
        }
        self.context.stop.ask();
        let text = format!(
            "stopped: the program that runs the cell was not heard for {ORCHESTRATOR_SILENT:?} (frozen by a signal, held by a debugger, or without \
             computing time); to debug it, run it with --debugger"
        );
        self.context.announce(LogLevel::Error, &text);
        // A host whose signal fails ends in its next iteration.
        let _ = self.wake.notify();
    }

    /// Reports who sent the signal that ends the host.
    fn report_signal(&self, signals: &SignalFd) {
        if let Ok(Some(signal)) = signals.read_signal() {
            let text = format!("its host was told to end by SIGTERM from {}", process_name(signal.ssi_pid));
            self.context.announce(LogLevel::Error, &text);
        }
    }
}

/// A beat, for `poll`.
const BEAT_MS: u16 = BEAT.as_millis() as u16;
