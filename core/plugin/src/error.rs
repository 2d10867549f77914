//! Why a plugin could not do what it was asked.

use plumb_abi::Status;

/// Why a plugin could not do what it was asked. Each kind is a status of the C contract, with a sentence for the operator.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PluginError {
    /// The configuration or an argument cannot be used; the text says what would be right.
    #[error("{0}")]
    Refused(String),
    /// A move would leave the robot's range or enter a kept-out region. Nothing moved.
    #[error("{0}")]
    OutOfRange(String),
    /// The device cannot do this at all.
    #[error("{0}")]
    Unsupported(String),
    /// A stop ended it. The robot is at rest.
    #[error("{0}")]
    Stopped(String),
    /// The device is not in a state that allows it.
    #[error("{0}")]
    NotReady(String),
    /// The device does not answer, or its cable is out.
    #[error("{0}")]
    Disconnected(String),
    /// It took longer than it may.
    #[error("{0}")]
    TimedOut(String),
    /// Messages of a wired input were lost, so that what was seen has a hole.
    #[error("{0}")]
    InputLost(String),
    /// Anything else.
    #[error("{0}")]
    Failed(String),
    /// The plugin panicked: a fault in its code. What it says about its device can no longer be trusted.
    #[error("{0}")]
    Panicked(String),
}

impl PluginError {
    /// The device cannot do `what`, such as "set output lines".
    pub fn unsupported(what: &str) -> Self {
        Self::Unsupported(format!("this device cannot {what}"))
    }

    /// A stop ended the call.
    pub fn stopped() -> Self {
        Self::Stopped("stopped".to_owned())
    }

    /// The kind as a status of the C contract.
    pub fn status(&self) -> Status {
        match self {
            Self::Refused(_) => Status::REFUSED,
            Self::OutOfRange(_) => Status::OUT_OF_RANGE,
            Self::Unsupported(_) => Status::UNSUPPORTED,
            Self::Stopped(_) => Status::STOPPED,
            Self::NotReady(_) => Status::NOT_READY,
            Self::Disconnected(_) => Status::DISCONNECTED,
            Self::TimedOut(_) => Status::TIMED_OUT,
            Self::InputLost(_) => Status::INPUT_LOST,
            Self::Failed(_) => Status::FAILED,
            Self::Panicked(_) => Status::PANICKED,
        }
    }

    /// The error of a status and its text. A status of no known meaning becomes [`PluginError::Failed`] and is named in the text.
    pub fn from_status(status: Status, text: String) -> Self {
        match status {
            Status::REFUSED => Self::Refused(text),
            Status::OUT_OF_RANGE => Self::OutOfRange(text),
            Status::UNSUPPORTED => Self::Unsupported(text),
            Status::STOPPED => Self::Stopped(text),
            Status::NOT_READY => Self::NotReady(text),
            Status::DISCONNECTED => Self::Disconnected(text),
            Status::TIMED_OUT => Self::TimedOut(text),
            Status::INPUT_LOST => Self::InputLost(text),
            Status::FAILED => Self::Failed(text),
            Status::PANICKED => Self::Panicked(text),
            Status(number) => {
                Self::Failed(format!("{text} (status {number}, which the contract does not know)"))
            }
        }
    }

    /// The sentence for the operator.
    pub fn text(&self) -> &str {
        match self {
            Self::Refused(text)
            | Self::OutOfRange(text)
            | Self::Unsupported(text)
            | Self::Stopped(text)
            | Self::NotReady(text)
            | Self::Disconnected(text)
            | Self::TimedOut(text)
            | Self::InputLost(text)
            | Self::Failed(text)
            | Self::Panicked(text) => text,
        }
    }
}

impl From<std::io::Error> for PluginError {
    fn from(error: std::io::Error) -> Self {
        use std::io::ErrorKind;
        match error.kind() {
            ErrorKind::TimedOut | ErrorKind::WouldBlock => Self::TimedOut(error.to_string()),
            ErrorKind::NotFound
            | ErrorKind::BrokenPipe
            | ErrorKind::ConnectionReset
            | ErrorKind::ConnectionAborted
            | ErrorKind::NotConnected
            | ErrorKind::ConnectionRefused => Self::Disconnected(error.to_string()),
            _ => Self::Failed(error.to_string()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_error_survives_the_way_through_its_status() {
        let text = || "why".to_owned();
        for error in [
            PluginError::Refused(text()),
            PluginError::OutOfRange(text()),
            PluginError::Unsupported(text()),
            PluginError::Stopped(text()),
            PluginError::NotReady(text()),
            PluginError::Disconnected(text()),
            PluginError::TimedOut(text()),
            PluginError::InputLost(text()),
            PluginError::Failed(text()),
            PluginError::Panicked(text()),
        ] {
            assert_eq!(PluginError::from_status(error.status(), error.text().to_owned()), error);
        }
    }

    #[test]
    fn an_unknown_status_is_named() {
        let error = PluginError::from_status(Status(77), "odd".to_owned());
        assert_eq!(error.to_string(), "odd (status 77, which the contract does not know)");
    }

    #[test]
    fn a_connection_that_is_gone_is_disconnected_however_the_system_calls_it() {
        use std::io::{Error, ErrorKind};
        for kind in [
            ErrorKind::BrokenPipe,
            ErrorKind::ConnectionReset,
            ErrorKind::ConnectionAborted,
            ErrorKind::ConnectionRefused,
            ErrorKind::NotConnected,
        ] {
            assert!(matches!(PluginError::from(Error::from(kind)), PluginError::Disconnected(_)), "{kind}");
        }
        assert!(matches!(PluginError::from(Error::from(ErrorKind::WouldBlock)), PluginError::TimedOut(_)));
        assert!(matches!(PluginError::from(Error::from(ErrorKind::InvalidData)), PluginError::Failed(_)));
    }
}
