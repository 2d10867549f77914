//! The orchestrator's side of a host process.

mod client;
mod error;
mod exit_reason;
mod lines;
mod process;
mod shared;
mod spans;
mod spawner;
mod stop_handle;

pub use client::{RobotClient, SensorClient};
pub use error::{DeviceError, SpawnError};
pub use exit_reason::ExitReason;
pub use lines::HostEvent;
pub use process::{HostCommand, HostProcess};
pub use stop_handle::{StopHandle, StopOutcome};

/// The bell that asks a device to stop.
pub(crate) fn stop_signal(device: &str) -> String {
    format!("stop/{device}")
}

/// The bell that says a device has stopped.
pub(crate) fn stopped_signal(device: &str) -> String {
    format!("stopped/{device}")
}
