//! A host for a plugin's own tests: no processes, everything the plugin says is kept.

use std::collections::{HashMap, VecDeque};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::{Duration, Instant};

use crate::message::{PREFIX_LENGTH, SEQUENCE_OFFSET};
use crate::{Host, HostInterface, LogLevel, Message, PluginError};

/// A host for a plugin's own tests.
///
/// ```
/// use plumb_plugin::recording::RecordingHost;
/// use plumb_plugin::{JointState, JointVector};
///
/// let recording = RecordingHost::new();
/// recording.host().emit("joints", &JointState::new(5, JointVector::zeros(2), false)).unwrap();
/// assert_eq!(recording.emitted::<JointState>("joints")[0].time_ns, 5);
/// ```
#[derive(Clone, Default)]
pub struct RecordingHost {
    shared: Arc<Shared>,
}

#[derive(Default)]
struct Shared {
    stop: AtomicBool,
    held_up: Mutex<Duration>,
    book: Mutex<Book>,
}

#[derive(Default)]
struct Book {
    emitted: HashMap<String, Vec<Vec<u8>>>,
    inputs: HashMap<String, VecDeque<Result<Vec<u8>, PluginError>>>,
    lines: Vec<(LogLevel, String)>,
}

impl RecordingHost {
    /// A host nobody has spoken to.
    pub fn new() -> Self {
        Self::default()
    }

    /// The handle to give to a plugin.
    pub fn host(&self) -> Host {
        Host::new(self.shared.clone())
    }

    /// Asks for a stop, or takes it back.
    pub fn set_stop(&self, stop: bool) {
        self.shared.stop.store(stop, Ordering::Release);
    }

    /// Holds the plugin up, as a busy computer does: its next look for a stop takes this long.
    pub fn hold_up(&self, time: Duration) {
        *self.shared.held_up.lock().unwrap_or_else(PoisonError::into_inner) = time;
    }

    /// The messages emitted on a stream so far that have the layout of `M`.
    pub fn emitted<M: Message>(&self, stream: &str) -> Vec<M> {
        let book = self.shared.book();
        let messages = book.emitted.get(stream).map(Vec::as_slice).unwrap_or_default();
        messages.iter().filter_map(|bytes| bytemuck::try_pod_read_unaligned(bytes).ok()).collect()
    }

    /// The bytes of the messages emitted on a stream so far.
    pub fn emitted_bytes(&self, stream: &str) -> Vec<Vec<u8>> {
        self.shared.book().emitted.get(stream).cloned().unwrap_or_default()
    }

    /// The streams something was emitted on, in order of name.
    pub fn streams(&self) -> Vec<String> {
        let mut names: Vec<String> = self.shared.book().emitted.keys().cloned().collect();
        names.sort();
        names
    }

    /// Puts a message on a wired input.
    pub fn feed<M: Message>(&self, input: &str, message: &M) {
        self.feed_bytes(input, bytemuck::bytes_of(message));
    }

    /// Puts a message on a wired input, given as its bytes.
    pub fn feed_bytes(&self, input: &str, message: &[u8]) {
        self.shared.book().inputs.entry(input.to_owned()).or_default().push_back(Ok(message.to_vec()));
    }

    /// Makes a wired input report that messages were lost.
    pub fn feed_loss(&self, input: &str) {
        let loss = PluginError::InputLost(format!("messages of input '{input}' were lost"));
        self.shared.book().inputs.entry(input.to_owned()).or_default().push_back(Err(loss));
    }

    /// The log lines so far.
    pub fn lines(&self) -> Vec<(LogLevel, String)> {
        self.shared.book().lines.clone()
    }
}

impl Shared {
    fn book(&self) -> MutexGuard<'_, Book> {
        self.book.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl HostInterface for Shared {
    fn log(&self, level: LogLevel, text: &str) {
        self.book().lines.push((level, text.to_owned()));
    }

    fn now_ns(&self) -> u64 {
        // Never 0, which no clock of a cell shows while anybody looks.
        const AT_THE_START: Duration = Duration::from_secs(1);
        static START: OnceLock<Instant> = OnceLock::new();
        (AT_THE_START + START.get_or_init(Instant::now).elapsed()).as_nanos() as u64
    }

    fn should_stop(&self) -> bool {
        let held_up = std::mem::take(&mut *self.held_up.lock().unwrap_or_else(PoisonError::into_inner));
        std::thread::sleep(held_up);
        self.stop.load(Ordering::Acquire)
    }

    fn emit(&self, stream: &str, message: &[u8]) -> Result<(), PluginError> {
        self.emit_in_place(stream, message.len(), &mut |buffer| {
            buffer.copy_from_slice(message);
            Ok(())
        })
    }

    fn emit_in_place(
        &self,
        stream: &str,
        length: usize,
        fill: &mut dyn FnMut(&mut [u8]) -> Result<(), PluginError>,
    ) -> Result<(), PluginError> {
        if length < PREFIX_LENGTH {
            return Err(PluginError::Refused(format!(
                "a message on '{stream}' has {length} bytes; every message begins with {PREFIX_LENGTH} for its time and number"
            )));
        }
        let mut bytes = vec![0; length];
        fill(&mut bytes)?;
        let mut book = self.book();
        let messages = book.emitted.entry(stream.to_owned()).or_default();
        let sequence = messages.len() as u64;
        bytes[SEQUENCE_OFFSET..PREFIX_LENGTH].copy_from_slice(&sequence.to_ne_bytes());
        messages.push(bytes);
        Ok(())
    }

    fn receive(&self, input: &str, message: &mut [u8]) -> Result<Option<usize>, PluginError> {
        let Some(next) = self.book().inputs.get_mut(input).and_then(VecDeque::pop_front) else {
            return Ok(None);
        };
        let bytes = next?;
        match message.get_mut(..bytes.len()) {
            Some(buffer) => buffer.copy_from_slice(&bytes),
            None => {
                return Err(PluginError::Refused(format!("a message of {} bytes does not fit", bytes.len())));
            }
        }
        Ok(Some(bytes.len()))
    }

    fn progress(&self, fraction: f64, text: &str) {
        self.log(LogLevel::Debug, &format!("{:.0} % {text}", fraction * 100.0));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{JointState, JointVector};

    #[test]
    fn the_host_numbers_the_messages_whatever_the_plugin_wrote() {
        let recording = RecordingHost::new();
        let mut state = JointState::new(1, JointVector::zeros(1), false);
        state.sequence = 99;
        for _ in 0..3 {
            recording.host().emit("joints", &state).unwrap();
        }
        let numbers: Vec<u64> =
            recording.emitted::<JointState>("joints").iter().map(|state| state.sequence).collect();
        assert_eq!(numbers, [0, 1, 2]);
    }

    #[test]
    fn a_wait_ends_early_with_a_stop() {
        let recording = RecordingHost::new();
        recording.set_stop(true);
        let result = recording.host().wait(std::time::Duration::from_secs(3600));
        assert_eq!(result, Err(PluginError::stopped()));
    }
}
