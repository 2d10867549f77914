//! What can go wrong on the bus, one enum for each kind of operation.

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
        /// What the system said.
        cause: std::io::Error,
    },
}

fn list(users: &[String]) -> String {
    users.join(", ")
}

/// Why a port cannot be opened.
#[derive(Debug, thiserror::Error)]
#[error("{what} cannot be opened: {cause}")]
pub struct OpenError {
    /// Which port or domain.
    pub what: String,
    /// What stood in the way.
    pub cause: String,
}

impl OpenError {
    pub(crate) fn new(what: &str, cause: impl std::fmt::Display) -> Self {
        Self { what: what.to_owned(), cause: cause.to_string() }
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
        /// What the layer below said.
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
        /// What the layer below said.
        cause: String,
    },
}

/// Why a request came back without the device's answer.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum CallError {
    /// The device itself said no.
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
    #[error("nobody serves {device}: its host does not run")]
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
    #[error("{device} answered '{request}' with something else: {cause}")]
    Answer {
        /// The device asked.
        device: String,
        /// The request's name.
        request: &'static str,
        /// What is wrong.
        cause: String,
    },
    /// Shared memory failed.
    #[error("'{request}' cannot reach {device}: {cause}")]
    Broken {
        /// The device asked.
        device: String,
        /// The request's name.
        request: &'static str,
        /// What the layer below said.
        cause: String,
    },
}

impl CallError {
    pub(crate) fn wire(device: &str, request: &'static str, error: &WireError) -> Self {
        Self::Answer { device: device.to_owned(), request, cause: error.to_string() }
    }
}
