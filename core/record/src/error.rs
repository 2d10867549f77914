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
    /// Another program keeps the database locked.
    #[error(
        "the record {path} is locked by another program{}; waited {waited_s} s. Let that program end, or give another record with --record DIR",
        by(holders)
    )]
    Locked {
        /// The database file.
        path: PathBuf,
        /// How long it was waited for, s.
        waited_s: u64,
        /// Who has the file open, as the system says it: `4711 (sqlite3)`. Empty where it does not say.
        holders: Vec<String>,
    },
    /// A statement failed.
    #[error("the record could not {operation}: {}", what_to_do(cause))]
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
    #[error("there is no run {run} in the record; `plumb history{option}` lists those there are")]
    NoSuchRun {
        /// The number asked for.
        run: i64,
        /// What names the record in a command, as `record_option` writes it.
        option: String,
    },
    /// No entry of this number.
    #[error("there is no entry {entry} in the queue; `plumb queue list` shows those there are")]
    NoSuchQueueEntry {
        /// The number asked for.
        entry: i64,
    },
    /// An entry that has begun or was taken off, or is one of another cell.
    #[error(
        "entry {entry} does not wait in this queue any more: its run has begun, it was removed, or it is of another cell; `plumb queue list` shows how it is"
    )]
    NotWaiting {
        /// Its number.
        entry: i64,
    },
    /// No such revision of corrections.
    #[error(
        "there is no revision {revision} of the corrections of {device} in cell {cell}; `plumb record zeros {cell}{option}` lists them"
    )]
    NoSuchRevision {
        /// What names the record in a command, as `record_option` writes it.
        option: String,
        /// The cell.
        cell: String,
        /// The device.
        device: String,
        /// The number asked for.
        revision: i64,
    },
    /// What is to come into force is no open proposal.
    #[error(
        "correction {correction} cannot be put in force: it is in force already, or was never proposed for this device"
    )]
    NotProposed {
        /// The number of the correction.
        correction: i64,
    },
    /// A roll back that would change nothing.
    #[error("nothing to bring back: {device} of cell {cell} is corrected now as it was at revision {revision}{}", controller_keeps(*.kept_by_controller))]
    NothingToBringBack {
        /// The cell.
        cell: String,
        /// The device.
        device: String,
        /// The number asked for.
        revision: i64,
        /// Zeros that the controller keeps did change since.
        kept_by_controller: bool,
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

fn by(holders: &[String]) -> String {
    match holders {
        [] => String::new(),
        [only] => format!(", process {only}"),
        many => format!(", one of the processes {}", many.join(", ")),
    }
}

/// What SQLite says, and what helps where that is known.
fn what_to_do(cause: &rusqlite::Error) -> String {
    match cause.sqlite_error_code() {
        Some(rusqlite::ErrorCode::DiskFull) => {
            format!(
                "{cause}: make room on the disk it lies on, then try again; nothing that was written is lost"
            )
        }
        Some(rusqlite::ErrorCode::DatabaseBusy | rusqlite::ErrorCode::DatabaseLocked) => {
            format!("{cause}: another program has held it for too long; let that program end, then try again")
        }
        Some(rusqlite::ErrorCode::ReadOnly) => {
            format!("{cause}: you may read the record but not write it; give another with --record DIR")
        }
        _ => cause.to_string(),
    }
}

fn controller_keeps(kept: bool) -> &'static str {
    match kept {
        true => ", but for zeros that its controller keeps: bring the arm to the pose and declare them anew",
        false => "",
    }
}

impl RecordError {
    /// Whether the database is damaged, or no database at all.
    #[must_use]
    pub fn is_damage(&self) -> bool {
        let (Self::Statement { cause, .. } | Self::Open { cause, .. }) = self else { return false };
        matches!(
            cause.sqlite_error_code(),
            Some(rusqlite::ErrorCode::DatabaseCorrupt | rusqlite::ErrorCode::NotADatabase)
        )
    }

    /// Whether another program held the database when this happened.
    pub(crate) fn is_locked(&self) -> bool {
        let (Self::Statement { cause, .. } | Self::Open { cause, .. }) = self else { return false };
        matches!(
            cause.sqlite_error_code(),
            Some(rusqlite::ErrorCode::DatabaseBusy | rusqlite::ErrorCode::DatabaseLocked)
        )
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_full_disk_is_called_so_with_what_helps() {
        let full = rusqlite::ffi::Error::new(rusqlite::ffi::SQLITE_FULL);
        let cause = rusqlite::Error::SqliteFailure(full, None);
        let text = RecordError::Statement { operation: "resume a run", cause }.to_string();
        assert!(text.contains("could not resume a run") && text.contains("make room on the disk"), "{text}");
    }

    #[test]
    fn only_a_lock_is_waited_for() {
        let failure = |code| rusqlite::Error::SqliteFailure(rusqlite::ffi::Error::new(code), None);
        let error = |code| RecordError::Statement { operation: "look at its schema", cause: failure(code) };
        assert!(
            error(rusqlite::ffi::SQLITE_BUSY).is_locked() && error(rusqlite::ffi::SQLITE_LOCKED).is_locked()
        );
        assert!(!error(rusqlite::ffi::SQLITE_FULL).is_locked());
    }

    #[test]
    fn a_record_that_another_program_holds_says_so_and_who_it_is() {
        let failure = |code| rusqlite::Error::SqliteFailure(rusqlite::ffi::Error::new(code), None);
        for code in [rusqlite::ffi::SQLITE_BUSY, rusqlite::ffi::SQLITE_LOCKED] {
            assert!(what_to_do(&failure(code)).ends_with("let that program end, then try again"));
        }
        assert!(
            what_to_do(&failure(rusqlite::ffi::SQLITE_READONLY)).contains("give another with --record DIR")
        );
        let (one, two) = ("4711 (sqlite3)".to_owned(), "12 (plumb)".to_owned());
        assert_eq!(by(&[]), "");
        assert_eq!(by(std::slice::from_ref(&one)), ", process 4711 (sqlite3)");
        assert_eq!(by(&[one, two]), ", one of the processes 4711 (sqlite3), 12 (plumb)");
    }

    #[test]
    fn only_a_broken_database_or_none_at_all_is_damage() {
        let failure = |code| rusqlite::Error::SqliteFailure(rusqlite::ffi::Error::new(code), None);
        let at = |code| RecordError::Statement { operation: "read a run", cause: failure(code) };
        assert!(
            at(rusqlite::ffi::SQLITE_CORRUPT).is_damage() && at(rusqlite::ffi::SQLITE_NOTADB).is_damage()
        );
        assert!(!at(rusqlite::ffi::SQLITE_FULL).is_damage());
        let open = RecordError::Open { path: PathBuf::new(), cause: failure(rusqlite::ffi::SQLITE_NOTADB) };
        assert!(open.is_damage());
        assert!(!RecordError::NoDefaultDirectory.is_damage());
    }
}
