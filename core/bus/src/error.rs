//! What can go wrong on the bus, one enum for each kind of operation.

use std::error::Error;
use std::path::PathBuf;
use std::time::Duration;

use plumb_plugin::{PluginError, WireError};

/// Why a domain cannot be used or removed.
#[derive(Debug, thiserror::Error)]
pub enum DomainError {
    /// The prefix cannot be the beginning of a file name in shared memory.
    #[error(
        "'{0}' cannot be the prefix of a cell's shared memory: use 1 to 32 lower-case letters, digits, '-' and '_'"
    )]
    Prefix(String),
    /// The directory cannot be used.
    #[error("{} cannot hold a cell's sockets: {right}", .directory.display())]
    Directory {
        /// The directory given.
        directory: PathBuf,
        /// What would be right.
        right: &'static str,
    },
    /// A process still uses it.
    #[error("the cell's shared memory is in use by {}", list(.0))]
    InUse(Vec<String>),
    /// A file cannot be removed.
    #[error("{}: cannot be removed: {cause}", .path.display())]
    Remove {
        /// The file or directory.
        path: PathBuf,
        /// The system's error.
        cause: std::io::Error,
    },
}

fn list(users: &[String]) -> String {
    users.join(", ")
}

/// The error of the layer below, as it was: an [`std::io::Error`], one of iceoryx2's, or a sentence. It can be asked for with `downcast_ref`.
pub type Cause = Box<dyn Error + Send + Sync>;

/// Why a port cannot be opened.
#[derive(Debug, thiserror::Error)]
#[error("{what} cannot be opened: {source}")]
pub struct OpenError {
    /// Which port or domain.
    pub what: String,
    /// Why.
    pub source: Cause,
}

impl OpenError {
    pub(crate) fn new(what: &str, source: impl Into<Cause>) -> Self {
        Self { what: what.to_owned(), source: source.into() }
    }
}

/// Why a message was not emitted.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum EmitError {
    /// The message has the wrong length.
    #[error("a message of {length} bytes cannot go on stream {stream}: {right}")]
    Length {
        /// `device/stream`.
        stream: String,
        /// The bytes given.
        length: usize,
        /// What would be right.
        right: String,
    },
    /// Shared memory failed.
    #[error("a message cannot go on stream {stream}: {cause}")]
    Broken {
        /// `device/stream`.
        stream: String,
        /// The error of the layer below.
        cause: String,
    },
}

/// Why no message was received.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ReceiveError {
    /// The receiver was too slow, and messages are gone. The next call goes on with what is there.
    #[error("{count} messages of stream {stream} were lost: it was not read fast enough")]
    Lost {
        /// `device/stream`.
        stream: String,
        /// How many.
        count: u64,
    },
    /// The message has another length than expected. It is skipped.
    #[error("a message of stream {stream} has {length} bytes instead of {expected}")]
    Length {
        /// `device/stream`.
        stream: String,
        /// The bytes received.
        length: usize,
        /// The bytes of the layout asked for.
        expected: usize,
    },
    /// Shared memory failed.
    #[error("stream {stream} cannot be read: {cause}")]
    Broken {
        /// `device/stream`.
        stream: String,
        /// The error of the layer below.
        cause: String,
    },
}

/// Why a request came back without the device's answer.
#[derive(Debug, thiserror::Error)]
pub enum CallError {
    /// The device itself refused.
    #[error(transparent)]
    Refused(PluginError),
    /// No answer within the time limit.
    #[error("{device} did not answer '{request}' within {limit:?}")]
    TimedOut {
        /// The device asked.
        device: String,
        /// The request's name.
        request: &'static str,
        /// The time limit.
        limit: Duration,
    },
    /// No process serves the device.
    #[error("{device} is not served: its host does not run")]
    NoHost {
        /// The device asked.
        device: String,
    },
    /// The request is longer than a request may be.
    #[error("'{request}' for {device} has {length} bytes; a request may have {limit}")]
    TooLong {
        /// The device asked.
        device: String,
        /// The request's name.
        request: &'static str,
        /// Its length.
        length: usize,
        /// The most a request may have.
        limit: usize,
    },
    /// The answer cannot be understood.
    #[error("{device} answered '{request}' with something else: {source}")]
    Answer {
        /// The device asked.
        device: String,
        /// The request's name.
        request: &'static str,
        /// What is wrong.
        source: AnswerError,
    },
    /// Shared memory failed.
    #[error("'{request}' cannot reach {device}: {source}")]
    Broken {
        /// The device asked.
        device: String,
        /// The request's name.
        request: &'static str,
        /// The error of the layer below.
        source: Cause,
    },
}

/// What is wrong with an answer.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum AnswerError {
    /// It is too short to be one.
    #[error("{0} words are not an answer")]
    TooShort(usize),
    /// Its bytes cannot be understood.
    #[error(transparent)]
    Wire(#[from] WireError),
    /// It is a reply to another request.
    #[error("the answer is {0}")]
    OtherReply(&'static str),
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_keeps_its_cause() {
        let full = std::io::Error::from(std::io::ErrorKind::StorageFull);
        let error = OpenError::new("the bus of 'x'", full);
        let cause = error.source().and_then(|cause| cause.downcast_ref::<std::io::Error>());
        assert_eq!(cause.map(std::io::Error::kind), Some(std::io::ErrorKind::StorageFull));
        assert!(error.to_string().starts_with("the bus of 'x' cannot be opened: "));
        let error = CallError::Answer {
            device: "arm".to_owned(),
            request: "jog",
            source: WireError::Operation(9).into(),
        };
        assert!(error.source().is_some_and(|cause| cause.downcast_ref::<AnswerError>().is_some()));
    }

    #[test]
    fn errors_are_small_enough_to_be_returned_by_value() {
        assert!(
            size_of::<CallError>() < 128 && size_of::<OpenError>() < 128 && size_of::<DomainError>() < 128
        );
    }
}
