//! The lines of JSON between a host and the orchestrator, beside the bus: what must work when shared memory does not.

use plumb_plugin::{Description, LogLevel, Manifest};
use serde::{Deserialize, Serialize};

/// What the orchestrator sends a host after its arguments. The end of the connection means that the orchestrator is gone.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum ToHost {
    /// The orchestrator runs: said again and again, so that a host notices when it does not.
    Alive,
    /// Put the device away and end.
    Finish,
}

/// What a host reports to the orchestrator.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum FromHost {
    /// The host runs: said again and again while it has nothing else to say.
    Alive,
    /// The device is ready, inactive.
    Ready {
        /// The manifest that was found.
        manifest: Box<Manifest>,
        /// What the device says about itself.
        description: Box<Description>,
    },
    /// The device cannot be had; the host ends.
    Failed {
        /// Why, for an operator.
        text: String,
    },
    /// A line for the log.
    Log {
        /// How important.
        level: LogLevel,
        /// What the plugin or the host says.
        text: String,
        /// The call it served; 0 for none.
        span: u64,
    },
    /// How far a long call has come.
    Progress {
        /// From 0 to 1.
        fraction: f64,
        /// What it does now.
        text: String,
        /// The call it served.
        span: u64,
    },
}

/// The exit codes of a host, beside 0 for an end in good order.
pub(crate) mod exit_code {
    /// The device could not be had; a `Failed` line says why.
    pub(crate) const FAILED: u8 = 70;
    /// A call was still running after its time.
    pub(crate) const WATCHDOG: u8 = 71;
    /// The orchestrator was gone: the robot was stopped.
    pub(crate) const ORPHANED: u8 = 72;
    /// Shared memory failed while serving.
    pub(crate) const BUS: u8 = 73;
    /// The process took more memory than it may.
    pub(crate) const MEMORY: u8 = 74;
}
