//! Notes: what a person wants to be remembered with a run.

use rusqlite::{Connection, params};
use serde::Serialize;

use crate::error::During;
use crate::record::timestamp;
use crate::{Record, RecordError, RunId};

/// A note as the record holds it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct StoredNote {
    /// When it was written.
    pub time: String,
    /// Who wrote it.
    pub author: String,
    /// What.
    pub text: String,
}

pub(crate) fn insert(connection: &Connection, run: RunId, author: &str, text: &str) -> rusqlite::Result<()> {
    let statement = "INSERT INTO notes (run, time, author, text) VALUES (?1, ?2, ?3, ?4)";
    connection.execute(statement, params![run.0, timestamp(), author, text]).map(|_| ())
}

impl Record {
    /// Adds a note to a run.
    ///
    /// # Errors
    /// [`RecordError::NoSuchRun`], or when the record cannot be written.
    pub fn add_note(&mut self, run: RunId, author: &str, text: &str) -> Result<(), RecordError> {
        self.run(run)?;
        insert(&self.connection, run, author, text).during("add a note")
    }

    /// The notes of a run, in the order they were written.
    ///
    /// # Errors
    /// When the record cannot be read.
    pub fn notes(&self, run: RunId) -> Result<Vec<StoredNote>, RecordError> {
        let mut statement = self
            .connection
            .prepare("SELECT time, author, text FROM notes WHERE run = ?1 ORDER BY id")
            .during("read the notes of a run")?;
        let rows = statement
            .query_map(params![run.0], |row| {
                Ok(StoredNote { time: row.get(0)?, author: row.get(1)?, text: row.get(2)? })
            })
            .during("read the notes of a run")?;
        rows.collect::<Result<_, _>>().during("read the notes of a run")
    }
}
