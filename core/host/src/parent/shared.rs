//! What the orchestrator's handles of one host share.

use std::process::Child;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use nix::sys::signal::{Signal, killpg};
use nix::sys::wait::{Id, WaitPidFlag, waitid};
use nix::unistd::Pid;
use plumb_bus::Bus;
use plumb_plugin::LogLevel;

use super::ExitReason;
use super::event::{HostEvent, Listener};
use super::spans::Spans;
use super::tail::Tail;
use crate::HostArguments;

/// What the orchestrator's handles of one host share.
pub(super) struct Shared {
    pub(super) device: String,
    /// Whether a debugger may hold the host or this program: nothing is too late then.
    pub(super) under_debugger: bool,
    pub(super) bus: Bus,
    pub(super) spans: Spans,
    pub(super) tail: Tail,
    listener: Box<Listener>,
    process: Pid,
    life: Mutex<Life>,
    ended: Condvar,
}

#[derive(Default)]
struct Life {
    killed_because: Option<String>,
    /// The process number may belong to somebody else from now on.
    reaped: bool,
    reason: Option<ExitReason>,
}

impl Shared {
    pub(super) fn new(
        arguments: &HostArguments,
        bus: Bus,
        child: &Child,
        listener: Box<Listener>,
    ) -> Arc<Self> {
        Arc::new(Self {
            device: arguments.device.clone(),
            under_debugger: arguments.under_debugger,
            bus,
            spans: Spans::default(),
            tail: Tail::default(),
            listener,
            process: Pid::from_raw(child.id().cast_signed()),
            life: Mutex::new(Life::default()),
            ended: Condvar::new(),
        })
    }

    fn life(&self) -> MutexGuard<'_, Life> {
        self.life.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Reports to the listener and the log, within the span of the call it served.
    pub(super) fn report(&self, span: u64, event: &HostEvent) {
        self.spans.get(span).in_scope(|| {
            let device = self.device.as_str();
            match event {
                HostEvent::Log { level, text } => match level {
                    LogLevel::Error => tracing::error!(device, "{text}"),
                    LogLevel::Warn => tracing::warn!(device, "{text}"),
                    LogLevel::Info => tracing::info!(device, "{text}"),
                    LogLevel::Debug => tracing::debug!(device, "{text}"),
                },
                HostEvent::Output { text } => tracing::info!(device, "wrote: {text}"),
                HostEvent::Progress { fraction, text } => tracing::trace!(device, fraction, "{text}"),
                HostEvent::Ended { reason } if reason.is_orderly() => {
                    tracing::info!(device, "its host {reason}")
                }
                HostEvent::Ended { reason } => tracing::error!(device, "its host {reason}"),
            }
            (self.listener)(device, event);
        });
    }

    /// The process number.
    pub(super) fn process(&self) -> u32 {
        self.process.as_raw().unsigned_abs()
    }

    /// How the process ended; `None` while it runs.
    pub(super) fn end(&self) -> Option<ExitReason> {
        self.life().reason.clone()
    }

    /// Waits for the process to end; how it did, or `None` when it still runs after `limit`.
    pub(super) fn wait_for_end(&self, limit: Duration) -> Option<ExitReason> {
        let until = Instant::now() + limit;
        let mut life = self.life();
        while life.reason.is_none() {
            let left = until.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return None;
            }
            life = self.ended.wait_timeout(life, left).unwrap_or_else(PoisonError::into_inner).0;
        }
        life.reason.clone()
    }

    /// Kills the process, unless it has ended.
    pub(super) fn kill(&self, why: &str) {
        let mut life = self.life();
        if !life.reaped {
            life.killed_because.get_or_insert_with(|| why.to_owned());
            // The process and what it started: it leads a group of its own. Fails only when it has just ended by itself.
            let _ = killpg(self.process, Signal::SIGKILL);
        }
    }

    /// Waits for the child's end, cleans up after it and reports it.
    pub(super) fn attend(&self, mut child: Child, output: &JoinHandle<()>) {
        let flags = WaitPidFlag::WEXITED | WaitPidFlag::WNOWAIT;
        // The child is left unreaped until its number can no longer be killed.
        while waitid(Id::Pid(self.process), flags) == Err(nix::errno::Errno::EINTR) {}
        let (status, killed_because) = {
            let mut life = self.life();
            // What a plugin started ends with its host. Fails when there is nothing.
            let _ = killpg(self.process, Signal::SIGKILL);
            life.reaped = true;
            (child.wait(), life.killed_because.clone())
        };
        // The last words are in the pipe; a grandchild that holds it open does not hold this up.
        wait_for_thread(output, LAST_WORDS);
        let reason = match status {
            Ok(status) => ExitReason::new(status, killed_because, self.tail.lines()),
            Err(_) => ExitReason { code: None, signal: None, killed_because, last_output: self.tail.lines() },
        };
        self.bus.clean_after_the_dead();
        self.life().reason = Some(reason.clone());
        self.ended.notify_all();
        // Anyone who waits for an answer learns now that none will come.
        if let Ok(signal) = self.bus.reply_signal(&self.device) {
            let _ = signal.notify();
        }
        self.report(0, &HostEvent::Ended { reason });
    }
}

/// How long the last words of an ended host may take to be read.
pub(super) const LAST_WORDS: Duration = Duration::from_millis(200);

/// Waits for a thread to end, at most for `limit`.
pub(super) fn wait_for_thread(thread: &JoinHandle<()>, limit: Duration) {
    let until = Instant::now() + limit;
    while !thread.is_finished() && Instant::now() < until {
        thread::sleep(Duration::from_millis(1));
    }
}
