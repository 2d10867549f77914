//! The names of the signals between the orchestrator and a host: both sides make them here.

/// The signal that asks a device to stop.
pub(crate) fn stop_signal(device: &str) -> String {
    format!("stop/{device}")
}

/// The signal with which a device confirms that it has stopped.
pub(crate) fn stopped_signal(device: &str) -> String {
    format!("stopped/{device}")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A host and an orchestrator of another version meet by these names.
    #[test]
    fn stops_are_asked_for_and_confirmed_by_signals_of_the_device() {
        assert_eq!((stop_signal("arm"), stopped_signal("arm")), ("stop/arm".into(), "stopped/arm".into()));
    }
}
