//! What the host process offers a plugin.

use std::fmt;
use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::{Message, PluginError};

/// How important a log line is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum LogLevel {
    /// Something is wrong.
    Error,
    /// Something may be wrong.
    Warn,
    /// What the device does, for an operator.
    Info,
    /// What the device does, for its author.
    Debug,
}

/// The longest wait between two looks at [`Host::should_stop`].
const STOP_CHECK: Duration = Duration::from_millis(10);

/// What the host process offers a plugin. Cheap to clone; every function may be called from any thread of the plugin.
#[derive(Clone)]
pub struct Host {
    interface: Arc<dyn HostInterface>,
}

/// What is behind a [`Host`]: the C contract in a loaded plugin, a [`recording::RecordingHost`](crate::recording::RecordingHost) in a
/// plugin's own tests.
pub trait HostInterface: Send + Sync {
    /// See [`Host::log`].
    fn log(&self, level: LogLevel, text: &str);
    /// See [`Host::now_ns`].
    fn now_ns(&self) -> u64;
    /// See [`Host::should_stop`].
    fn should_stop(&self) -> bool;
    /// See [`Host::emit_bytes`].
    ///
    /// # Errors
    /// As there.
    fn emit(&self, stream: &str, message: &[u8]) -> Result<(), PluginError>;
    /// See [`Host::emit_in_place`].
    ///
    /// # Errors
    /// As there.
    fn emit_in_place(
        &self,
        stream: &str,
        length: usize,
        fill: &mut dyn FnMut(&mut [u8]) -> Result<(), PluginError>,
    ) -> Result<(), PluginError>;
    /// See [`Host::receive_bytes`].
    ///
    /// # Errors
    /// As there.
    fn receive(&self, input: &str, message: &mut [u8]) -> Result<Option<usize>, PluginError>;
    /// See [`Host::progress`].
    fn progress(&self, fraction: f64, text: &str);
}

impl Host {
    /// A handle on what is behind it.
    pub fn new(interface: Arc<dyn HostInterface>) -> Self {
        Self { interface }
    }

    /// Writes a line to the log, under the request being served.
    pub fn log(&self, level: LogLevel, text: &str) {
        self.interface.log(level, text);
    }

    /// The time of the cell's clock, ns, with which everything in the cell is dated. It is `CLOCK_MONOTONIC`, except in a cell with a simulated world that
    /// runs faster than the wall: there it is that world's time, which is stopped while nothing moves. So it dates, but does not measure how long a
    /// call takes: for that use [`Instant`].
    pub fn now_ns(&self) -> u64 {
        self.interface.now_ns()
    }

    /// Whether a stop has been asked for. A call that takes long looks at least every 50 ms, brings the device to rest when this is true and
    /// returns [`PluginError::Stopped`]. It stays true until the device is activated again.
    pub fn should_stop(&self) -> bool {
        self.interface.should_stop()
    }

    /// Waits, and ends early with [`PluginError::Stopped`] when a stop is asked for.
    ///
    /// # Errors
    /// [`PluginError::Stopped`].
    pub fn wait(&self, duration: Duration) -> Result<(), PluginError> {
        let end = Instant::now() + duration;
        loop {
            if self.should_stop() {
                return Err(PluginError::stopped());
            }
            let left = end.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Ok(());
            }
            std::thread::sleep(left.min(STOP_CHECK));
        }
    }

    /// Emits a message on one of the plugin's streams; its `sequence` is written by the host.
    ///
    /// # Errors
    /// [`PluginError::Refused`] when the manifest has no such stream or declares another layout for it.
    pub fn emit<M: Message>(&self, stream: &str, message: &M) -> Result<(), PluginError> {
        self.emit_bytes(stream, bytemuck::bytes_of(message))
    }

    /// Emits a message given as its bytes, a multiple of 8 of them, which begin with `time_ns` and `sequence`.
    ///
    /// # Errors
    /// [`PluginError::Refused`] when the manifest has no such stream or the length is not that of the layout.
    pub fn emit_bytes(&self, stream: &str, message: &[u8]) -> Result<(), PluginError> {
        self.interface.emit(stream, message)
    }

    /// Emits a large message that is built in shared memory: `fill` gets `length` bytes (a multiple of 8), aligned to 8, and the message is sent when it
    /// returns `Ok`.
    ///
    /// # Errors
    /// As [`Host::emit_bytes`], and whatever `fill` returns; then nothing is sent.
    pub fn emit_in_place(
        &self,
        stream: &str,
        length: usize,
        mut fill: impl FnMut(&mut [u8]) -> Result<(), PluginError>,
    ) -> Result<(), PluginError> {
        self.interface.emit_in_place(stream, length, &mut fill)
    }

    /// The next message of a wired input, or `None` when none waits.
    ///
    /// # Errors
    /// [`PluginError::InputLost`] once, when messages were lost; the next call goes on with what is there.
    /// [`PluginError::Refused`] for an input that the cell file does not wire, or a message of another length.
    pub fn receive<M: Message>(&self, input: &str) -> Result<Option<M>, PluginError> {
        let mut message = M::zeroed();
        match self.interface.receive(input, bytemuck::bytes_of_mut(&mut message))? {
            None => Ok(None),
            Some(length) if length == size_of::<M>() => Ok(Some(message)),
            Some(length) => Err(PluginError::Refused(format!(
                "a message of input '{input}' has {length} bytes; {} has {}",
                M::TYPE_NAME,
                size_of::<M>()
            ))),
        }
    }

    /// The bytes of the next message of a wired input written to `message`, and how many; `None` when none waits.
    ///
    /// # Errors
    /// As [`Host::receive`]; [`PluginError::Refused`] when the message is longer than `message`.
    pub fn receive_bytes(&self, input: &str, message: &mut [u8]) -> Result<Option<usize>, PluginError> {
        self.interface.receive(input, message)
    }

    /// Reports how far a long call has come: a fraction from 0 to 1, and what it does now.
    pub fn progress(&self, fraction: f64, text: &str) {
        self.interface.progress(fraction, text);
    }
}

impl fmt::Debug for Host {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("Host")
    }
}
