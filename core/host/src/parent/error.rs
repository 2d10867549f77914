//! What can go wrong with a device, as the orchestrator sees it.

use std::io;
use std::time::Duration;

use plumb_bus::{CallError, DomainError, OpenError};
use plumb_plugin::PluginError;

use super::ExitReason;

/// Why a host process could not be started.
#[derive(Debug, thiserror::Error)]
pub enum SpawnError {
    /// The process cannot be started.
    #[error("the host of {device} cannot be started: {cause}")]
    Start {
        /// The device.
        device: String,
        /// What the system said.
        cause: io::Error,
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

/// Why a device did not do what it was asked.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum DeviceError {
    /// The device said no.
    #[error("{device}: {error}")]
    Refused {
        /// The device.
        device: String,
        /// What was asked.
        request: &'static str,
        /// What it said.
        error: PluginError,
    },
    /// No answer in time. The device may still be at it.
    #[error("{device} did not answer '{request}' within {limit:?}")]
    TimedOut {
        /// The device.
        device: String,
        /// What was asked.
        request: &'static str,
        /// The time limit.
        limit: Duration,
    },
    /// Its host process has ended.
    #[error("the host of {device} {reason}")]
    HostDied {
        /// The device.
        device: String,
        /// How it ended.
        reason: ExitReason,
    },
    /// The answer cannot be understood, or shared memory failed.
    #[error(transparent)]
    Bus(CallError),
}

impl DeviceError {
    /// What the device itself said, when it was the device that said no.
    pub fn plugin_error(&self) -> Option<&PluginError> {
        match self {
            Self::Refused { error, .. } => Some(error),
            _ => None,
        }
    }

    /// Whether a stop ended or forbade it.
    pub fn is_stopped(&self) -> bool {
        matches!(self.plugin_error(), Some(PluginError::Stopped(_)))
    }

    pub(super) fn from_call(device: &str, request: &'static str, error: CallError) -> Self {
        match error {
            CallError::Refused(error) => Self::Refused { device: device.to_owned(), request, error },
            CallError::TimedOut { device, request, limit } => Self::TimedOut { device, request, limit },
            other => Self::Bus(other),
        }
    }
}
