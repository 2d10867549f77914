//! What the plugin's calls to its host act on. One for the process, shared by its threads.

mod clock;
mod log_line;
mod stop_flag;

pub(crate) use clock::Clock;
pub(crate) use log_line::Lines;
pub(crate) use stop_flag::StopFlag;

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use plumb_abi::Status;
use plumb_bus::{EmitError, Loan, Publisher, ReceiveError, Subscriber};
use plumb_plugin::{LogLevel, Message};

use crate::channel::FromHost;

/// What the plugin's calls to its host act on.
pub(crate) struct Context {
    /// Whether a stop has been asked for.
    pub(crate) stop: StopFlag,
    /// The cell's clock.
    pub(crate) clock: Clock,
    /// The device's name in the cell.
    device: String,
    /// Why a message was refused for its time; the call under way, or the next one, fails with it.
    misdated: Mutex<Option<String>>,
    /// Whether a call is under way that may move the device.
    in_motion: AtomicBool,
    /// Why the host ends without being asked to: what is under way fails with it.
    ends_because: Mutex<Option<String>>,
    lines: Lines,
    /// The call being served, for log lines; 0 for none.
    span: AtomicU64,
    /// Why the call that is about to end failed.
    failure: Mutex<Option<String>>,
    publishers: Mutex<BTreeMap<String, Publisher>>,
    /// The last message of each stream whose messages have a fixed length.
    last: Mutex<BTreeMap<String, Vec<u8>>>,
    inputs: Mutex<BTreeMap<String, Subscriber>>,
    lent: Mutex<Option<Lent>>,
}

/// Shared memory the plugin builds a message in.
struct Lent {
    stream: String,
    loan: Loan,
}

/// The longest message that is kept as the last of its stream, in bytes: those of a robot's own streams are shorter.
const LONGEST_REMEMBERED: usize = 512;

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Context {
    /// A context without streams and inputs, of a device in a cell with that clock.
    pub(crate) fn new(lines: Lines, device: &str, clock: Clock) -> Self {
        Self {
            stop: StopFlag::default(),
            clock,
            device: device.to_owned(),
            misdated: Mutex::new(None),
            in_motion: AtomicBool::new(false),
            ends_because: Mutex::new(None),
            lines,
            span: AtomicU64::new(0),
            failure: Mutex::new(None),
            publishers: Mutex::new(BTreeMap::new()),
            last: Mutex::new(BTreeMap::new()),
            inputs: Mutex::new(BTreeMap::new()),
            lent: Mutex::new(None),
        }
    }

    /// Adds a stream the plugin may emit on.
    pub(crate) fn add_stream(&self, name: &str, publisher: Publisher) {
        locked(&self.publishers).insert(name.to_owned(), publisher);
    }

    /// Adds an input the plugin may receive from.
    pub(crate) fn add_input(&self, name: &str, subscriber: Subscriber) {
        locked(&self.inputs).insert(name.to_owned(), subscriber);
    }

    /// Does work that may move the device.
    pub(crate) fn while_moving<R>(&self, work: impl FnOnce() -> R) -> R {
        self.in_motion.store(true, Ordering::Release);
        let result = work();
        self.in_motion.store(false, Ordering::Release);
        result
    }

    /// Sets why the host is about to end.
    pub(crate) fn end_because(&self, why: &str) {
        *locked(&self.ends_because) = Some(why.to_owned());
    }

    /// Why the host is about to end, if it is.
    pub(crate) fn ends_because(&self) -> Option<String> {
        locked(&self.ends_because).clone()
    }

    /// Whether a call is under way that may move the device.
    pub(crate) fn is_in_motion(&self) -> bool {
        self.in_motion.load(Ordering::Acquire)
    }

    /// Names the call being served; 0 for none.
    pub(crate) fn serve_under(&self, span: u64) {
        self.span.store(span, Ordering::Relaxed);
    }

    /// A log line, the plugin's or the host's, under the call being served. Left out when the plugin has written too much.
    pub(crate) fn report(&self, level: LogLevel, text: &str) {
        let span = self.span.load(Ordering::Relaxed);
        self.lines.send(FromHost::Log { level, text: text.to_owned(), span }, text.len());
    }

    /// A log line that is never left out: how the host itself fares.
    pub(crate) fn announce(&self, level: LogLevel, text: &str) {
        let span = self.span.load(Ordering::Relaxed);
        self.send(FromHost::Log { level, text: text.to_owned(), span });
    }

    /// A line to the orchestrator that is never left out.
    pub(crate) fn send(&self, line: FromHost) {
        self.lines.announce(line);
    }

    /// Waits until the orchestrator has got every line, within reason.
    pub(crate) fn flush(&self) {
        self.lines.flush();
    }

    pub(crate) fn progress(&self, fraction: f64, text: &str) {
        let span = self.span.load(Ordering::Relaxed);
        let fraction = if fraction.is_finite() { fraction.clamp(0.0, 1.0) } else { 0.0 };
        self.lines.send(FromHost::Progress { fraction, text: text.to_owned(), span }, text.len());
    }

    /// Keeps why the call that is about to end failed.
    pub(crate) fn fail(&self, text: &str) {
        *locked(&self.failure) = Some(text.to_owned());
    }

    /// Why the call that has ended failed.
    pub(crate) fn take_failure(&self) -> Option<String> {
        locked(&self.failure).take()
    }

    /// Why the time (ns) of something the device reports is none of the cell's clock.
    ///
    /// # Errors
    /// A sentence that names both clocks.
    pub(crate) fn check_time(&self, what: &str, time_ns: u64) -> Result<(), String> {
        self.clock.mismatch(&self.device, what, time_ns).map_or(Ok(()), Err)
    }

    /// Why a message since the last call was refused for its time.
    pub(crate) fn take_misdated(&self) -> Option<String> {
        locked(&self.misdated).take()
    }

    /// Whether a message, which begins with its time, may go out on a stream.
    fn is_dated_by_the_cell(&self, stream: &str, message: &[u8]) -> bool {
        let Some(time_ns) = message.first_chunk().map(|time| u64::from_ne_bytes(*time)) else { return true };
        let Err(why) = self.check_time(&format!("a message on `{stream}`"), time_ns) else { return true };
        self.report(LogLevel::Error, &why);
        locked(&self.misdated).get_or_insert(why);
        false
    }

    pub(crate) fn emit(&self, stream: &str, message: &[u8]) -> Status {
        if !self.is_dated_by_the_cell(stream, message) {
            return Status::REFUSED;
        }
        let mut publishers = locked(&self.publishers);
        match publishers.get_mut(stream) {
            Some(publisher) => {
                let emitted = self.emitted(publisher.emit(message));
                if emitted == Status::OK {
                    self.remember(stream, message);
                }
                emitted
            }
            None => self.no_such("stream", stream, &publishers),
        }
    }

    /// Keeps the last message of a stream. Long ones, such as pictures, are not kept.
    fn remember(&self, stream: &str, message: &[u8]) {
        if message.len() > LONGEST_REMEMBERED {
            return;
        }
        let mut last = locked(&self.last);
        match last.get_mut(stream) {
            Some(kept) => {
                kept.clear();
                kept.extend_from_slice(message);
            }
            None => drop(last.insert(stream.to_owned(), message.to_vec())),
        }
    }

    /// The last message that was emitted on a stream; none when there was none, or of another layout.
    pub(crate) fn last_emitted<M: Message>(&self, stream: &str) -> Option<M> {
        bytemuck::try_pod_read_unaligned(locked(&self.last).get(stream)?).ok()
    }

    /// Lends memory for a message; its first byte.
    pub(crate) fn loan(&self, stream: &str, length: usize) -> Result<*mut u8, Status> {
        let publishers = locked(&self.publishers);
        let Some(publisher) = publishers.get(stream) else {
            return Err(self.no_such("stream", stream, &publishers));
        };
        let mut lent = locked(&self.lent);
        if lent.is_some() {
            self.report(
                LogLevel::Error,
                "the plugin asks for a second message to build before it published the first",
            );
            return Err(Status::REFUSED);
        }
        let mut loan = publisher.loan(length).map_err(|error| self.emitted(Err(error)))?;
        let first = loan.bytes_mut().as_mut_ptr();
        *lent = Some(Lent { stream: stream.to_owned(), loan });
        Ok(first)
    }

    /// Sends what was lent, or takes it back.
    pub(crate) fn publish(&self, message: *mut u8, send: bool) -> Status {
        let Some(mut lent) = locked(&self.lent).take() else {
            self.report(LogLevel::Error, "the plugin publishes a message it was not lent");
            return Status::REFUSED;
        };
        if lent.loan.bytes_mut().as_mut_ptr() != message {
            self.report(LogLevel::Error, "the plugin publishes another message than the one it was lent");
            return Status::REFUSED;
        }
        if !send {
            return Status::OK;
        }
        if !self.is_dated_by_the_cell(&lent.stream, lent.loan.bytes_mut()) {
            return Status::REFUSED;
        }
        let mut publishers = locked(&self.publishers);
        match publishers.get_mut(&lent.stream) {
            Some(publisher) => {
                self.remember(&lent.stream, lent.loan.bytes_mut());
                self.emitted(publisher.send(lent.loan))
            }
            None => self.no_such("stream", &lent.stream, &publishers),
        }
    }

    /// Copies the next message of an input to `target`; how long it is.
    pub(crate) fn receive(&self, input: &str, target: &mut [u8]) -> Result<usize, Status> {
        let mut inputs = locked(&self.inputs);
        let Some(subscriber) = inputs.get_mut(input) else {
            return Err(self.no_such("input", input, &inputs));
        };
        let received = subscriber.receive_with(|message| {
            target
                .get_mut(..message.len())
                .map(|target| target.copy_from_slice(message))
                .ok_or(message.len())?;
            Ok::<usize, usize>(message.len())
        });
        match received {
            Ok(None) => Err(Status::EMPTY),
            Ok(Some(Ok(length))) => Ok(length),
            Ok(Some(Err(length))) => {
                let capacity = target.len();
                let text =
                    format!("a message of input '{input}' has {length} bytes; the plugin takes {capacity}");
                self.report(LogLevel::Error, &text);
                Err(Status::REFUSED)
            }
            Err(error) => {
                self.report(LogLevel::Warn, &format!("input '{input}': {error}"));
                Err(if matches!(error, ReceiveError::Lost { .. }) {
                    Status::INPUT_LOST
                } else {
                    Status::FAILED
                })
            }
        }
    }

    fn emitted(&self, result: Result<(), EmitError>) -> Status {
        match result {
            Ok(()) => Status::OK,
            Err(error) => {
                self.report(LogLevel::Error, &error.to_string());
                if matches!(error, EmitError::Length { .. }) { Status::REFUSED } else { Status::FAILED }
            }
        }
    }

    fn no_such<T>(&self, what: &str, name: &str, known: &BTreeMap<String, T>) -> Status {
        let known = known.keys().map(String::as_str).collect::<Vec<_>>().join(", ");
        self.report(LogLevel::Error, &format!("the plugin uses {what} '{name}'; it has {known}"));
        Status::REFUSED
    }
}

#[cfg(test)]
pub(crate) mod tests;
