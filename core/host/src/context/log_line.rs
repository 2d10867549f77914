//! The host's lines to the orchestrator: queued, so that a reader that does not read never holds up a device, and limited, so that a plugin
//! that talks without end fills no disk.

use std::io::Write;
use std::os::unix::net::UnixStream;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use nix::time::{ClockId, clock_gettime};
use plumb_plugin::LogLevel;

use crate::channel::FromHost;
use crate::flood::{Allowance, Flood, REPORT_EVERY};
use crate::time_limits::BEAT;

/// How many lines may wait for the orchestrator before further ones are left out, and counted.
const QUEUE: usize = 1024;

/// How long an end waits for the last lines to be read.
const LAST_LINES: Duration = Duration::from_secs(1);

/// How long a line that must not be lost waits for room in the queue.
const ROOM_WITHIN: Duration = Duration::from_millis(200);

/// The sending end of the lines.
pub(crate) struct Lines {
    queue: SyncSender<Entry>,
    flood: Arc<Mutex<Flood>>,
}

enum Entry {
    Line(Box<FromHost>),
    Flush(SyncSender<()>),
}

fn locked(flood: &Mutex<Flood>) -> MutexGuard<'_, Flood> {
    flood.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Lines {
    /// Starts the thread that writes.
    pub(crate) fn start(stream: UnixStream) -> Self {
        let (queue, entries) = sync_channel(QUEUE);
        let flood = Arc::new(Mutex::new(Flood::new(Allowance::LOG, Instant::now())));
        let counted = Arc::clone(&flood);
        thread::spawn(move || {
            Writer { stream, flood: counted, reported: Instant::now() }.write_all(&entries)
        });
        Self { queue, flood }
    }

    /// Sends a line of some bytes if there is room for it; counts it if there is not.
    pub(crate) fn send(&self, line: FromHost, bytes: usize) {
        let mut flood = locked(&self.flood);
        if flood.lets_through(bytes, Instant::now())
            && let Err(TrySendError::Full(_)) = self.queue.try_send(Entry::Line(Box::new(line)))
        {
            flood.leave_out(bytes);
        }
    }

    /// Sends a line whatever was sent before: the state of the host, not what its plugin reports.
    pub(crate) fn announce(&self, line: FromHost) {
        let end = Instant::now() + ROOM_WITHIN;
        let mut entry = Entry::Line(Box::new(line));
        while let Err(TrySendError::Full(back)) = self.queue.try_send(entry) {
            if Instant::now() >= end {
                return;
            }
            entry = back;
            thread::sleep(Duration::from_millis(1));
        }
    }

    /// Waits until everything so far has been written, within reason.
    pub(crate) fn flush(&self) {
        let (done, written) = sync_channel(1);
        if self.queue.try_send(Entry::Flush(done)).is_ok() {
            // Too late or an orchestrator that is gone: either way there is no reader.
            let _ = written.recv_timeout(LAST_LINES);
        }
    }
}

/// The thread that writes.
struct Writer {
    stream: UnixStream,
    flood: Arc<Mutex<Flood>>,
    /// When it was last reported that lines were left out.
    reported: Instant,
}

impl Writer {
    fn write_all(mut self, entries: &Receiver<Entry>) {
        // The first word: from here on silence means that the process does not run.
        if self.write(&FromHost::Alive).is_err() {
            return;
        }
        loop {
            let written = match entries.recv_timeout(BEAT) {
                Ok(Entry::Line(line)) => {
                    let reported =
                        if self.reported.elapsed() >= REPORT_EVERY { self.report_left_out() } else { Ok(()) };
                    reported.and_then(|()| self.write(&line))
                }
                Ok(Entry::Flush(done)) => {
                    let reported = self.report_left_out();
                    // A flush that nobody waits for any more is no matter.
                    let _ = done.send(());
                    reported
                }
                Err(RecvTimeoutError::Timeout) => {
                    self.report_left_out().and_then(|()| self.write(&FromHost::Alive))
                }
                Err(RecvTimeoutError::Disconnected) => return,
            };
            if written.is_err() {
                return;
            }
        }
    }

    fn report_left_out(&mut self) -> std::io::Result<()> {
        let left_out = locked(&self.flood).take_left_out();
        if left_out.is_none() {
            return Ok(());
        }
        self.reported = Instant::now();
        self.write(&FromHost::Log { level: LogLevel::Warn, text: left_out.line(), span: 0 })
    }

    fn write(&mut self, line: &FromHost) -> std::io::Result<()> {
        let Ok(mut text) = serde_json::to_vec(line) else { return Ok(()) };
        text.push(b'\n');
        self.stream.write_all(&text)
    }
}

/// `CLOCK_MONOTONIC`, ns; 0 where the system has no such clock.
pub(crate) fn monotonic_ns() -> u64 {
    clock_gettime(ClockId::CLOCK_MONOTONIC)
        .map_or(0, |time| Duration::from(time).as_nanos().try_into().unwrap_or(u64::MAX))
}
