//! What a sensor can be asked.

use crate::{Host, PluginError, Reading, SensorDescription, Value};

/// A sensor. The host calls these functions one at a time, always from the same thread.
pub trait Sensor: Sized + Send {
    /// Connects to the device. `config` is what the cell file gives under `config:`, or null.
    ///
    /// # Errors
    /// [`PluginError::Refused`] for a configuration that cannot be used, saying what would be right; [`PluginError::Disconnected`] for a
    /// device that does not answer.
    fn create(config: &Value, host: Host) -> Result<Self, PluginError>;

    /// What it measures, takes in and emits. Does not change while the plugin lives.
    fn describe(&self) -> SensorDescription;

    /// Changes settings while running: what the cell file's `config:` may hold, only the keys to be changed.
    ///
    /// # Errors
    /// [`PluginError::Refused`] for a setting that cannot be, [`PluginError::Unsupported`] for a sensor without settings.
    fn configure(&mut self, _settings: &Value) -> Result<(), PluginError> {
        Err(PluginError::unsupported("be configured while it runs"))
    }

    /// Forgets what was seen so far and watches from now on. Called before every search and measurement.
    ///
    /// # Errors
    /// When the device does not confirm.
    fn arm(&mut self) -> Result<(), PluginError> {
        Ok(())
    }

    /// Takes in what has come: called when a wired input has messages. Pulls them with [`Host::receive`] and emits the sensor's own streams.
    ///
    /// # Errors
    /// An error is kept by the host and returned by the next [`Sensor::read`].
    fn poll(&mut self) -> Result<(), PluginError> {
        Ok(())
    }

    /// What has been seen since the last reading, or since [`Sensor::arm`].
    ///
    /// `None` when the inputs have not yet been seen up to `after_ns` (ns of the cell's clock): the host takes in more and asks again until
    /// the request's time is up.
    ///
    /// # Errors
    /// Anything the device reports.
    fn read(&mut self, after_ns: u64) -> Result<Option<Reading>, PluginError>;
}
