//! Why a world does not serve.

use std::io;
use std::path::PathBuf;

use crate::world_file::WorldFileError;

/// Why a world does not serve, or no longer.
#[derive(Debug, thiserror::Error)]
pub enum ServeError {
    /// The world file is wrong.
    #[error(transparent)]
    File(#[from] WorldFileError),
    /// Another world holds the address.
    #[error(
        "a world is already being served at {}: end it first, or choose another --socket",
        socket.display()
    )]
    Taken {
        /// The address.
        socket: PathBuf,
    },
    /// The address cannot be used.
    #[error(
        "cannot listen at {}: {source} (a socket's path has at most 103 bytes, and its directory must exist and be writable)",
        socket.display()
    )]
    Address {
        /// The address.
        socket: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// The file for the cell's time cannot be written.
    #[error("{}: the cell's time cannot be written there: {source}", file.display())]
    Clock {
        /// The file.
        file: PathBuf,
        /// What the system says.
        source: io::Error,
    },
}
