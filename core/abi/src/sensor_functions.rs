//! What a sensor can be asked.

use crate::{Bytes, Instance, Sink, Status};

/// The name under which a sensor's functions are asked for.
pub const SENSOR_EXTENSION: &str = "plumb.sensor/1";

/// What a sensor can be asked. The host calls these one at a time, always from the thread that called `create`. A null function is one the
/// sensor does not have; `describe` and `read` must be there.
#[repr(C)]
#[derive(Debug)]
pub struct SensorFunctions {
    /// The size of this struct in bytes as the plugin knows it.
    pub size: u32,
    /// Zero.
    pub reserved: u32,
    /// Writes the sensor's description as JSON.
    pub describe: Option<unsafe extern "C" fn(*mut Instance, answer: *const Sink) -> Status>,
    /// Changes settings, given as JSON.
    pub configure: Option<unsafe extern "C" fn(*mut Instance, settings: Bytes) -> Status>,
    /// Forgets what was seen so far and watches from now on.
    pub arm: Option<unsafe extern "C" fn(*mut Instance) -> Status>,
    /// Takes in what has come on the wired inputs.
    pub poll: Option<unsafe extern "C" fn(*mut Instance) -> Status>,
    /// Writes a reading as JSON; [`Status::EMPTY`] when the inputs have not been seen up to `after_ns`.
    pub read: Option<unsafe extern "C" fn(*mut Instance, after_ns: u64, answer: *const Sink) -> Status>,
}
