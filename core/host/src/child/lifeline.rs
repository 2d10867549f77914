//! The connection to the orchestrator: how the host learns that it is to end, or that nobody is there any more.

use std::io::{BufRead, BufReader};
use std::os::fd::AsFd;
use std::os::unix::net::UnixStream;
use std::sync::atomic::{AtomicU8, Ordering};
use std::thread;
use std::time::Duration;

use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use nix::sys::signal::{SigSet, Signal as SystemSignal};
use nix::sys::signalfd::{SfdFlags, SignalFd};
use plumb_bus::Signal;
use plumb_plugin::LogLevel;

use super::Context;
use super::serve::end_at_once;
use crate::channel::{ToHost, exit_code};

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

/// How long an orphaned host has to bring its robot to rest.
const LAST_STOP: Duration = Duration::from_secs(3);

/// Blocks the signal that asks the process to end, in this thread and all it starts: the lifeline thread takes it instead.
pub(super) fn block_termination() -> nix::Result<()> {
    let mut set = SigSet::empty();
    set.add(SystemSignal::SIGTERM);
    set.thread_block()
}

/// Starts the thread that holds the line. `wake` rings the bell the main thread waits on.
pub(super) fn hold(
    context: &'static Context,
    ending: &'static EndingFlag,
    stream: BufReader<UnixStream>,
    wake: Signal,
) {
    thread::spawn(move || {
        let finish = wait_for_ending(stream) == Ending::Finish;
        if finish {
            ending.set(Ending::Finish);
        } else {
            context.stop.ask();
            ending.set(Ending::Orphaned);
        }
        if wake.ring().is_err() || !finish {
            thread::sleep(LAST_STOP);
            context.report(LogLevel::Error, "the orchestrator is gone and the plugin did not come to rest");
            end_at_once(context, exit_code::ORPHANED);
        }
    });
}

/// Waits for the word to finish, the end of the connection, or the signal to end.
fn wait_for_ending(mut stream: BufReader<UnixStream>) -> Ending {
    let mut set = SigSet::empty();
    set.add(SystemSignal::SIGTERM);
    let Ok(signals) = SignalFd::with_flags(&set, SfdFlags::SFD_CLOEXEC) else { return Ending::Orphaned };
    loop {
        if stream.buffer().is_empty() {
            let mut ready = [
                PollFd::new(stream.get_ref().as_fd(), PollFlags::POLLIN),
                PollFd::new(signals.as_fd(), PollFlags::POLLIN),
            ];
            match poll(&mut ready, PollTimeout::NONE) {
                Err(nix::errno::Errno::EINTR) => continue,
                Err(_) => return Ending::Orphaned,
                Ok(_) if ready[1].any().unwrap_or(true) => return Ending::Orphaned,
                Ok(_) => {}
            }
        }
        let mut line = String::new();
        match stream.read_line(&mut line) {
            Ok(0) | Err(_) => return Ending::Orphaned,
            Ok(_) if serde_json::from_str(&line).is_ok_and(|word: ToHost| word == ToHost::Finish) => {
                return Ending::Finish;
            }
            Ok(_) => {}
        }
    }
}
