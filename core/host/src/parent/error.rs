//! What can go wrong with a device, as the orchestrator sees it.

use std::io;
use std::sync::Arc;
use std::time::Duration;

use plumb_bus::{CallError, DomainError, OpenError};
use plumb_plugin::PluginError;

use super::ExitReason;
use crate::CatalogueError;

/// Why a host process could not be started.
#[derive(Debug, thiserror::Error)]
pub enum SpawnError {
    /// The process cannot be started.
    #[error("the host of {device} cannot be started: {source}")]
    Start {
        /// The device.
        device: String,
        /// The system's error.
        source: io::Error,
    },
    /// The plugin or its device cannot be had.
    #[error("{device}: {text}")]
    Failed {
        /// The device.
        device: String,
        /// What the host or the plugin said.
        text: String,
    },
    /// The host ended before its device was ready.
    #[error("the host of {device} {reason} before the device was ready")]
    Died {
        /// The device.
        device: String,
        /// How it ended.
        reason: ExitReason,
    },
    /// The device was not ready in time.
    #[error("{device} was not ready within {limit:?}; its host was killed")]
    TimedOut {
        /// The device.
        device: String,
        /// The time limit.
        limit: Duration,
    },
    /// The orchestrator's own end of the bus cannot be opened.
    #[error(transparent)]
    Bus(#[from] OpenError),
    /// The domain cannot be used.
    #[error(transparent)]
    Domain(#[from] DomainError),
}

impl SpawnError {
    /// Whether the host was killed because it did not get on: frozen, hung, or without computing time.
    pub fn is_frozen(&self) -> bool {
        match self {
            Self::TimedOut { .. } => true,
            Self::Died { reason, .. } => reason.killed_because.is_some(),
            _ => false,
        }
    }
}

/// Why a device cannot be started.
#[derive(Debug, thiserror::Error)]
pub enum StartError {
    /// Its plugin cannot be used.
    #[error(transparent)]
    Plugin(#[from] CatalogueError),
    /// The orchestrator's own end of the bus cannot be opened.
    #[error(transparent)]
    Bus(#[from] OpenError),
    /// Its host does not serve.
    #[error("{}", without_device(.0))]
    Host(#[from] SpawnError),
    /// The program that is to be its host cannot be found.
    #[error("this program cannot be found on the disk: {0}")]
    Program(#[source] io::Error),
    /// Its host ended as soon as it was ready.
    #[error("its host {0}")]
    Ended(Box<ExitReason>),
    /// It does not fit what the cell says of it, or the simulated world has no such device; the text says what would be right.
    #[error("{0}")]
    Unsuitable(String),
}

impl StartError {
    /// Whether its process did not run.
    pub fn is_frozen(&self) -> bool {
        matches!(self, Self::Host(error) if error.is_frozen())
    }
}

/// The error of a host without the name of its device, which the sentence around it has already.
fn without_device(error: &SpawnError) -> String {
    match error {
        SpawnError::Failed { text, .. } => text.clone(),
        other => other.to_string(),
    }
}

/// Why a device did not do what it was asked: one type from the host's clients to the engine.
#[derive(Debug, thiserror::Error)]
pub enum DeviceError {
    /// It answered that it could not.
    #[error("{device}: {source}")]
    Refused {
        /// The device.
        device: String,
        /// What was asked.
        operation: &'static str,
        /// Its answer.
        source: PluginError,
    },
    /// No answer in time. The device may still be at it.
    #[error("{device} did not answer '{operation}' within {limit:?}")]
    TimedOut {
        /// The device.
        device: String,
        /// What was asked.
        operation: &'static str,
        /// The time limit.
        limit: Duration,
    },
    /// Its host process has ended.
    #[error("the host of {device} {reason}")]
    HostDied {
        /// The device.
        device: String,
        /// What was asked.
        operation: &'static str,
        /// How it ended.
        reason: Box<ExitReason>,
    },
    /// The answer cannot be understood, or shared memory failed.
    #[error("{source}")]
    Bus {
        /// The device.
        device: String,
        /// What was asked.
        operation: &'static str,
        /// What went wrong.
        source: Box<CallError>,
    },
    /// It cannot be started.
    #[error("{device} cannot be started: {source}")]
    Start {
        /// The device.
        device: String,
        /// Why, and what would be right. Shared, because several devices may wait for the same one.
        source: Arc<StartError>,
    },
}

impl DeviceError {
    /// A device that answered with an error.
    pub fn refused(device: &str, operation: &'static str, source: PluginError) -> Self {
        Self::Refused { device: device.to_owned(), operation, source }
    }

    /// A device that cannot be started.
    pub fn start(device: &str, source: impl Into<Arc<StartError>>) -> Self {
        Self::Start { device: device.to_owned(), source: source.into() }
    }

    /// The device.
    pub fn device(&self) -> &str {
        match self {
            Self::Refused { device, .. }
            | Self::TimedOut { device, .. }
            | Self::HostDied { device, .. }
            | Self::Bus { device, .. }
            | Self::Start { device, .. } => device,
        }
    }

    /// What the device itself answered, when it was the device that refused.
    pub fn plugin_error(&self) -> Option<&PluginError> {
        match self {
            Self::Refused { source, .. } => Some(source),
            _ => None,
        }
    }

    /// Whether a stop ended or forbade it: a stop from here, or by a hand on its pendant.
    pub fn is_stop(&self) -> bool {
        matches!(self.plugin_error(), Some(PluginError::Stopped(_)))
    }

    /// Whether the device has to be started again before it can be used: it answers no more, or its plugin panicked.
    pub fn is_loss(&self) -> bool {
        self.plugin_error().is_none_or(|error| matches!(error, PluginError::Panicked(_)))
    }

    /// Whether it answers no more although it had been started.
    pub fn is_silence(&self) -> bool {
        matches!(self, Self::TimedOut { .. } | Self::HostDied { .. } | Self::Bus { .. })
    }

    /// The error of a request that came back without an answer.
    pub(super) fn from_call(device: &str, operation: &'static str, error: CallError) -> Self {
        let device = device.to_owned();
        match error {
            CallError::Refused(source) => Self::Refused { device, operation, source },
            CallError::TimedOut { limit, .. } => Self::TimedOut { device, operation, limit },
            other => Self::Bus { device, operation, source: Box::new(other) },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::error::Error as _;

    fn host_died() -> DeviceError {
        let reason = ExitReason {
            code: None,
            signal: Some("SIGKILL".to_owned()),
            killed_because: None,
            last_output: vec![],
        };
        DeviceError::HostDied { device: "arm".to_owned(), operation: "jog", reason: Box::new(reason) }
    }

    #[test]
    fn a_stop_is_no_loss_and_a_panic_is() {
        let refused = |source| DeviceError::refused("arm", "move joints", source);
        let stopped = refused(PluginError::stopped());
        assert!(stopped.is_stop() && !stopped.is_loss() && !stopped.is_silence());
        let panicked = refused(PluginError::Panicked("at lib.rs".to_owned()));
        assert!(panicked.is_loss() && !panicked.is_stop() && !panicked.is_silence());
        let out_of_range = refused(PluginError::OutOfRange("too far".to_owned()));
        assert!(!out_of_range.is_loss() && !out_of_range.is_stop());
        assert!(host_died().is_loss() && host_died().is_silence() && !host_died().is_stop());
    }

    #[test]
    fn the_cause_of_an_error_is_its_source() {
        let error = DeviceError::refused("arm", "jog", PluginError::unsupported("jog"));
        let cause = error.source().and_then(|cause| cause.downcast_ref::<PluginError>());
        assert_eq!(cause, Some(&PluginError::unsupported("jog")));
        let call = CallError::NoHost { device: "arm".to_owned() };
        let error = DeviceError::from_call("arm", "jog", call);
        assert!(
            error
                .source()
                .is_some_and(|cause| cause.to_string() == "arm is not served: its host does not run")
        );
        let start = StartError::Unsuitable("no such joint".to_owned());
        let error = DeviceError::start("arm", start);
        assert_eq!(error.to_string(), "arm cannot be started: no such joint");
        assert!(error.is_loss() && !error.is_silence() && error.source().is_some());
        assert_eq!(error.device(), "arm");
    }

    #[test]
    fn a_device_that_cannot_be_had_is_named_once() {
        let failed = SpawnError::Failed { device: "arm".to_owned(), text: "no cable".to_owned() };
        assert_eq!(
            DeviceError::start("arm", StartError::from(failed)).to_string(),
            "arm cannot be started: no cable"
        );
    }

    #[test]
    fn a_host_that_hangs_is_frozen_and_one_that_fails_is_not() {
        let late = SpawnError::TimedOut { device: "arm".to_owned(), limit: Duration::from_secs(15) };
        assert!(StartError::from(late).is_frozen());
        let failed = SpawnError::Failed { device: "arm".to_owned(), text: "no cable".to_owned() };
        assert!(!StartError::from(failed).is_frozen());
        assert!(!StartError::Unsuitable(String::new()).is_frozen());
    }

    #[test]
    fn errors_are_small_enough_to_be_returned_by_value() {
        assert!(
            size_of::<DeviceError>() < 128 && size_of::<StartError>() < 128 && size_of::<SpawnError>() < 128
        );
    }
}
