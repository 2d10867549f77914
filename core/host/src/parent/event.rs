//! What a host reports besides its answers.

use plumb_plugin::LogLevel;

use super::ExitReason;

/// What a host reports besides its answers. Handed to the listener of [`HostCommand::on_event`](crate::HostCommand::on_event), within the
/// tracing span of the call it served.
#[derive(Clone, Debug, PartialEq)]
pub enum HostEvent {
    /// A log line of the plugin or the host.
    Log {
        /// How important.
        level: LogLevel,
        /// The line.
        text: String,
    },
    /// A line the plugin wrote to its standard output or error.
    Output {
        /// The line.
        text: String,
    },
    /// How far a long call has come.
    Progress {
        /// From 0 to 1.
        fraction: f64,
        /// What it does now.
        text: String,
    },
    /// The host process has ended.
    Ended {
        /// How.
        reason: ExitReason,
    },
}

/// The listener of events.
pub(super) type Listener = dyn Fn(&str, &HostEvent) + Send + Sync;
