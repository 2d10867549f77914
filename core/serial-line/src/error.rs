//! What can go wrong on a line whatever is said on it.

use std::io::ErrorKind;
use std::time::Duration;

/// Why a port cannot be opened.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum OpenFailure {
    /// There is no such file.
    #[error(
        "there is no such port; check that the adapter is plugged in, and its name (ls /dev/serial/by-id)"
    )]
    Missing,
    /// Another program has it.
    #[error("another program has it open; end that program (fuser {0} names it)")]
    Busy(String),
    /// The user may not.
    #[error("permission denied; add this user to the group that owns it (often dialout) and log in again")]
    Forbidden,
    /// It is no serial port.
    #[error("that is no serial port; check the name (ls /dev/serial/by-id)")]
    NotAPort,
    /// Anything else.
    #[error("{0}")]
    Other(String),
}

impl OpenFailure {
    /// What an error of opening the port of that name means.
    pub(crate) fn of(port: &str, error: serialport::Error) -> Self {
        match error.kind {
            serialport::ErrorKind::Io(ErrorKind::NotFound) => Self::Missing,
            serialport::ErrorKind::Io(ErrorKind::PermissionDenied) => Self::Forbidden,
            // The crate's word for a port that another process has locked.
            serialport::ErrorKind::NoDevice => Self::Busy(port.to_owned()),
            _ if matches!(error.description.as_str(), "Not a typewriter" | "Is a directory") => {
                Self::NotAPort
            }
            _ => Self::Other(error.description),
        }
    }

    /// Whether another port has to be named, rather than this one brought back.
    pub fn is_of_the_name(&self) -> bool {
        matches!(self, Self::NotAPort | Self::Other(_))
    }
}

/// The port is gone while it was open.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the port is gone ({cause}); check that the adapter is plugged in")]
pub struct Unplugged {
    /// What the system said.
    pub cause: String,
}

/// The line did not take all bytes of a write.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("it took {sent} bytes: {failure}")]
pub struct WriteError {
    /// How many it took.
    pub sent: usize,
    /// Why no more.
    pub failure: WriteFailure,
}

/// Why the line does not take bytes.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum WriteFailure {
    /// It took no more for too long.
    #[error("it took no more within {} ms; check the adapter, and that nothing holds the line back", waited.as_millis())]
    Full {
        /// For how long.
        waited: Duration,
    },
    /// The port is gone.
    #[error(transparent)]
    Unplugged(Unplugged),
}

impl WriteFailure {
    /// What an error of a write that may take `limit` means.
    pub(crate) fn of(error: &std::io::Error, limit: Duration) -> Self {
        match error.kind() {
            ErrorKind::TimedOut => Self::Full { waited: limit },
            _ => Self::Unplugged(Unplugged { cause: error.to_string() }),
        }
    }
}
