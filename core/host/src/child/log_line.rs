//! The host's lines to the orchestrator: queued, so that a reader that stands still never holds up a device.

use std::io::Write;
use std::os::unix::net::UnixStream;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::thread;
use std::time::Duration;

use nix::time::{ClockId, clock_gettime};
use plumb_plugin::LogLevel;

use crate::channel::FromHost;

/// How many lines may wait for the orchestrator before further ones are dropped, and counted.
const QUEUE: usize = 1024;

/// How long an end waits for the last lines to be read.
const LAST_LINES: Duration = Duration::from_secs(1);

/// The sending end of the lines.
pub(super) struct Lines {
    queue: SyncSender<Entry>,
    dropped: AtomicU64,
}

enum Entry {
    Line(Box<FromHost>),
    Flush(SyncSender<()>),
}

impl Lines {
    /// Starts the thread that writes.
    pub(super) fn start(stream: UnixStream) -> Self {
        let (queue, entries) = sync_channel(QUEUE);
        thread::spawn(move || write_all(&entries, stream));
        Self { queue, dropped: AtomicU64::new(0) }
    }

    /// Sends a line, or drops it when too many wait.
    pub(super) fn send(&self, line: FromHost) {
        let dropped = self.dropped.swap(0, Ordering::Relaxed);
        if dropped > 0 {
            let text =
                format!("{dropped} lines before this one were dropped: they came faster than they were read");
            self.offer(FromHost::Log { level: LogLevel::Warn, text, span: 0 }, dropped);
        }
        self.offer(line, 1);
    }

    fn offer(&self, line: FromHost, weight: u64) {
        if let Err(TrySendError::Full(_)) = self.queue.try_send(Entry::Line(Box::new(line))) {
            self.dropped.fetch_add(weight, Ordering::Relaxed);
        }
    }

    /// Waits until everything so far has been written, within reason.
    pub(super) fn flush(&self) {
        let (done, written) = sync_channel(1);
        if self.queue.try_send(Entry::Flush(done)).is_ok() {
            // Too late or an orchestrator that is gone: either way there is nobody to tell.
            let _ = written.recv_timeout(LAST_LINES);
        }
    }
}

fn write_all(entries: &Receiver<Entry>, mut stream: UnixStream) {
    for entry in entries {
        match entry {
            Entry::Line(line) => {
                let Ok(mut text) = serde_json::to_vec(&line) else { continue };
                text.push(b'\n');
                if stream.write_all(&text).is_err() {
                    return;
                }
            }
            Entry::Flush(done) => {
                // A flush that nobody waits for any more is no matter.
                let _ = done.send(());
            }
        }
    }
}

/// `CLOCK_MONOTONIC`, ns; 0 where the system has no such clock.
pub(super) fn monotonic_ns() -> u64 {
    clock_gettime(ClockId::CLOCK_MONOTONIC)
        .map_or(0, |time| Duration::from(time).as_nanos().try_into().unwrap_or(u64::MAX))
}
