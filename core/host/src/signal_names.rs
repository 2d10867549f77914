//! The names of the signals between the orchestrator and a host: both sides make them here.

/// The signal that asks a device to stop.
pub(crate) fn stop_signal(device: &str) -> String {
    format!("stop/{device}")
}

/// The signal with which a device confirms that it has stopped.
pub(crate) fn stopped_signal(device: &str) -> String {
    format!("stopped/{device}")
}
