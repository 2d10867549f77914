//! The orchestrator's side of a host process.

mod client;
mod error;
mod event;
mod exit_reason;
mod lines;
mod process;
mod shared;
mod spans;
mod spawner;
mod stop_handle;
mod tail;

pub use client::{RobotClient, SensorClient};
pub use error::{DeviceError, SpawnError, StartError};
pub use event::HostEvent;
pub use exit_reason::ExitReason;
pub use process::{HostCommand, HostProcess};
pub use stop_handle::{StopHandle, StopOutcome};
