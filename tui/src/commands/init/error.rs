//! Why there is no example cell.

use std::io;
use std::path::{Path, PathBuf};

/// Why there is no example cell.
#[derive(Debug, thiserror::Error)]
pub(crate) enum InitError {
    /// The example cells are not where they belong.
    #[error(
        "the example cells are not found; looked in {}; name their folder (`workcells` of the source) with --from",
        list(looked_in)
    )]
    NotInstalled {
        /// Where they were looked for.
        looked_in: Vec<PathBuf>,
    },
    /// No example has this name.
    #[error("there is no example `{name}`: {help}")]
    Unknown {
        /// What was asked for.
        name: String,
        /// Which was meant, or which there are.
        help: String,
    },
    /// Something lies where it would be written.
    #[error(
        "{} is there already, and nothing is overwritten; name another folder, as in `plumb init DIR`, or remove it first",
        path.display()
    )]
    Exists {
        /// What lies there.
        path: PathBuf,
    },
    /// A file or folder cannot be read or written.
    #[error("{}: {source}", path.display())]
    Io {
        /// Which.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
}

impl InitError {
    /// For `map_err` after an operation on a file.
    pub(super) fn io(path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        move |source| Self::Io { path, source }
    }
}

fn list(paths: &[PathBuf]) -> String {
    paths.iter().map(|path| path.display().to_string()).collect::<Vec<_>>().join(", ")
}
