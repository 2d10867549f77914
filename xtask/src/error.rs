//! Why there is no package.

use std::io;
use std::path::{Path, PathBuf};

/// Why there is no package.
#[derive(Debug, thiserror::Error)]
pub enum PackageError {
    /// A file or folder cannot be read or written.
    #[error("{}: {source}", path.display())]
    Io {
        /// Which.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// A program that is needed cannot be started.
    #[error("`{program}` cannot be started: {source}; {help}")]
    NoProgram {
        /// Which.
        program: String,
        /// Why.
        source: io::Error,
        /// What brings it.
        help: &'static str,
    },
    /// A program failed.
    #[error("`{command}` failed ({status}): {message}")]
    Failed {
        /// What was called.
        command: String,
        /// How it ended.
        status: String,
        /// What it wrote to standard error.
        message: String,
    },
    /// Something that was built is not there.
    #[error("{} is not there; build it first: cargo build --release --locked", .0.display())]
    NotBuilt(PathBuf),
    /// A file holds something else than it should.
    #[error("{}: {what}", path.display())]
    Unexpected {
        /// Which.
        path: PathBuf,
        /// What is wrong.
        what: String,
    },
}

impl PackageError {
    /// For `map_err` after an operation on a file.
    pub(crate) fn io(path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        move |source| Self::Io { path, source }
    }
}
