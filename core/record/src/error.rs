//! What can go wrong with a record.

use std::path::PathBuf;

/// Why the record could not be opened, read or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RecordError {
    /// The directory is not there and cannot be made.
    #[error("the record's directory {path} cannot be made: {cause}; give another with --record DIR")]
    MakeDirectory {
        /// The directory.
        path: PathBuf,
        /// What the system says.
        cause: std::io::Error,
    },
    /// The database cannot be opened.
    #[error("the record {path} cannot be opened: {cause}")]
    Open {
        /// The database file.
        path: PathBuf,
        /// What SQLite says.
        cause: rusqlite::Error,
    },
    /// Written by a newer program.
    #[error(
        "the record {path} has schema {found}, this program knows up to {known}: use the newer plumb that wrote it"
    )]
    TooNew {
        /// The database file.
        path: PathBuf,
        /// Schema version found.
        found: i64,
        /// Newest version known here.
        known: i64,
    },
    /// A statement failed.
    #[error("the record could not {operation}: {cause}")]
    Statement {
        /// What was being done: "start a run".
        operation: &'static str,
        /// What SQLite says.
        cause: rusqlite::Error,
    },
    /// Something in the record does not read back.
    #[error("the record holds something unreadable while it should {operation}: {cause}")]
    Unreadable {
        /// What was being done.
        operation: &'static str,
        /// What is wrong with it.
        cause: serde_json::Error,
    },
    /// No run of this number.
    #[error("there is no run {run} in the record; `plumb history` lists those there are")]
    NoSuchRun {
        /// The number asked for.
        run: i64,
    },
    /// No such revision of corrections.
    #[error("there is no correction revision {revision} for {device} of cell {cell}")]
    NoSuchRevision {
        /// The cell.
        cell: String,
        /// The device.
        device: String,
        /// The number asked for.
        revision: i64,
    },
    /// Another program runs this cell.
    #[error(
        "cell {cell} is already run by another plumb (process {process}): let it end, or stop it, and try again"
    )]
    CellLocked {
        /// The cell.
        cell: String,
        /// Its process number, as it wrote it down.
        process: String,
    },
    /// The copy would overwrite something.
    #[error("{path} is there already: give a new file for the copy")]
    BackupExists {
        /// The file.
        path: PathBuf,
    },
    /// The copy cannot be written.
    #[error("the copy {path} cannot be written: {cause}")]
    Backup {
        /// The file.
        path: PathBuf,
        /// What SQLite says.
        cause: rusqlite::Error,
    },
    /// The lock file cannot be made.
    #[error("the lock {path} of the cell cannot be taken: {cause}")]
    Lock {
        /// The lock file.
        path: PathBuf,
        /// What the system says.
        cause: std::io::Error,
    },
    /// No place to keep a record is known.
    #[error("no place for the record: neither XDG_STATE_HOME nor HOME is set; give one with --record DIR")]
    NoDefaultDirectory,
}

/// Attaches the operation to an SQLite error.
pub(crate) trait During<T> {
    /// Says what was being done when it failed.
    fn during(self, operation: &'static str) -> Result<T, RecordError>;
}

impl<T> During<T> for Result<T, rusqlite::Error> {
    fn during(self, operation: &'static str) -> Result<T, RecordError> {
        self.map_err(|cause| RecordError::Statement { operation, cause })
    }
}

impl<T> During<T> for Result<T, serde_json::Error> {
    fn during(self, operation: &'static str) -> Result<T, RecordError> {
        self.map_err(|cause| RecordError::Unreadable { operation, cause })
    }
}
