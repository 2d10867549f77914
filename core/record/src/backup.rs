//! A copy of the record, whole although it is being written meanwhile.

use std::path::Path;
use std::time::Duration;

use rusqlite::Connection;
use rusqlite::backup::Backup;

use crate::owner_only::create_owner_only_file;
use crate::{Record, RecordError};

/// Pages copied at a time.
const PAGES: i32 = 256;

impl Record {
    /// Copies the database into the file `to`, which must not be there yet.
    ///
    /// # Errors
    /// [`RecordError::BackupExists`], or [`RecordError::Backup`] when the copy cannot be written; what was begun is removed.
    pub fn back_up(&self, to: &Path) -> Result<(), RecordError> {
        if to.exists() {
            return Err(RecordError::BackupExists { path: to.to_owned() });
        }
        // For its owner alone, as the record itself. Where the file cannot be made, SQLite says why.
        let _ = create_owner_only_file(to);
        let copied = Connection::open(to).and_then(|mut copy| {
            Backup::new(&self.connection, &mut copy)?.run_to_completion(PAGES, Duration::from_millis(5), None)
        });
        copied.map_err(|cause| {
            // What is there is no copy.
            let _removed = std::fs::remove_file(to);
            RecordError::Backup { path: to.to_owned(), cause }
        })
    }
}
