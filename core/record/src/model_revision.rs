//! Model files as they were, revision by revision.

use rusqlite::params;
use serde::Serialize;

use crate::error::During;
use crate::loaded::sha256_hex;
use crate::record::timestamp;
use crate::{Record, RecordError, RunId};

/// A model file at one time.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct StoredModelRevision {
    /// Its number.
    pub revision: i64,
    /// The run that made or first used it.
    pub run: Option<RunId>,
    /// When.
    pub made: String,
    /// Why.
    pub note: String,
    /// Hash of the file.
    pub sha256: String,
    /// The file itself.
    pub content: String,
}

impl Record {
    /// Notes the model of a device where it differs from the last one noted; gives the revision that holds it.
    ///
    /// # Errors
    /// When the record cannot be read or written.
    pub fn note_model(
        &mut self,
        cell: &str,
        device: &str,
        run: Option<RunId>,
        content: &str,
        note: &str,
    ) -> Result<i64, RecordError> {
        let sha256 = sha256_hex(content.as_bytes());
        if let Some(last) = self.model_revisions(cell, device)?.pop()
            && last.sha256 == sha256
        {
            return Ok(last.revision);
        }
        self.connection
            .execute(
                "INSERT INTO model_revisions (cell, device, run, made, note, sha256, content) VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7)",
                params![cell, device, run.map(|run| run.0), timestamp(), note, sha256, content],
            )
            .during("note a model")?;
        Ok(self.connection.last_insert_rowid())
    }

    /// All models of a device, oldest first.
    ///
    /// # Errors
    /// When the record cannot be read.
    pub fn model_revisions(&self, cell: &str, device: &str) -> Result<Vec<StoredModelRevision>, RecordError> {
        let mut statement = self
            .connection
            .prepare(
                "SELECT id, run, made, note, sha256, content FROM model_revisions WHERE cell = ?1 AND device = ?2 ORDER BY id",
            )
            .during("read the models of a device")?;
        let rows = statement
            .query_map(params![cell, device], |row| {
                Ok(StoredModelRevision {
                    revision: row.get(0)?,
                    run: row.get::<_, Option<i64>>(1)?.map(RunId),
                    made: row.get(2)?,
                    note: row.get(3)?,
                    sha256: row.get(4)?,
                    content: row.get(5)?,
                })
            })
            .during("read the models of a device")?;
        rows.collect::<Result<_, _>>().during("read the models of a device")
    }
}
