//! Losses of zeros: a drive was switched off, or counts anew, so that the zeros found before no longer hold.

use rusqlite::{OptionalExtension as _, params};
use serde::Serialize;
use serde_json::Value;

use crate::error::During;
use crate::record::timestamp;
use crate::run::json_column;
use crate::{AppliedCorrection, Record, RecordError, RunId};

/// The last time a robot lost its zeros.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct StoredZeroLoss {
    /// The run that noticed.
    pub run: RunId,
    /// When.
    pub time: String,
    /// The newest revision of the device then: zeros of it and of earlier ones no longer hold.
    pub revision: i64,
    /// What was noticed.
    pub reason: String,
}

/// Where a robot's drive was last written down to be.
#[derive(Debug, Clone, PartialEq)]
pub struct LastPose {
    /// The run that wrote it down.
    pub run: RunId,
    /// When.
    pub time: String,
    /// The joints, as [`Record::note_pose`] took them.
    pub joints: Value,
    /// What the last attempt of that run at a step had set out to do, if it did not pass: the robot may be on its way.
    pub intent: Option<Value>,
}

impl Record {
    /// Notes that the zeros of a robot found so far no longer hold.
    ///
    /// # Errors
    /// When the record cannot be written.
    pub fn note_zero_loss(
        &mut self,
        cell: &str,
        device: &str,
        run: RunId,
        reason: &str,
    ) -> Result<(), RecordError> {
        self.connection
            .execute(
                "INSERT INTO zero_losses (cell, device, run, time, revision, reason) VALUES (?1, ?2, ?3, ?4, \
                 (SELECT coalesce(max(id), 0) FROM revisions WHERE cell = ?1 AND device = ?2), ?5)",
                params![cell, device, run.0, timestamp(), reason],
            )
            .during("note a loss of zeros")?;
        Ok(())
    }

    /// The last time a robot lost its zeros; none if it never did.
    ///
    /// # Errors
    /// When the record cannot be read.
    pub fn zero_loss(&self, cell: &str, device: &str) -> Result<Option<StoredZeroLoss>, RecordError> {
        self.connection
            .query_row(
                "SELECT run, time, revision, reason FROM zero_losses WHERE cell = ?1 AND device = ?2 \
                 ORDER BY id DESC LIMIT 1",
                params![cell, device],
                |row| {
                    Ok(StoredZeroLoss {
                        run: RunId(row.get(0)?),
                        time: row.get(1)?,
                        revision: row.get(2)?,
                        reason: row.get(3)?,
                    })
                },
            )
            .optional()
            .during("look for a loss of zeros")
    }

    /// Whether a value in force was found after the last loss of its device's zeros: by a run since then, or brought back from one.
    ///
    /// # Errors
    /// When the record cannot be read.
    pub fn was_found_since(
        &self,
        cell: &str,
        correction: &AppliedCorrection,
        loss: &StoredZeroLoss,
    ) -> Result<bool, RecordError> {
        if correction.revision <= loss.revision {
            return Ok(false);
        }
        if correction.run.is_some() {
            return Ok(true);
        }
        let history = self.correction_history(cell, &correction.key)?;
        let same = |value: f64| value.to_bits() == correction.value.to_bits();
        Ok(history.iter().any(|found| {
            found.run.is_some() && same(found.new) && found.revision.is_some_and(|made| made > loss.revision)
        }))
    }

    /// Where a robot's drive was last written down to be, in whichever run of the cell; none if it never was.
    ///
    /// # Errors
    /// When the record cannot be read.
    pub fn last_pose(&self, cell: &str, device: &str) -> Result<Option<LastPose>, RecordError> {
        let found = self
            .connection
            .query_row(
                "SELECT poses.run, poses.time, poses.joints FROM poses JOIN runs ON runs.id = poses.run \
                 WHERE runs.cell = ?1 AND poses.device = ?2 ORDER BY poses.rowid DESC LIMIT 1",
                params![cell, device],
                |row| Ok((RunId(row.get(0)?), row.get(1)?, json_column(row, 2)?)),
            )
            .optional()
            .during("read the last pose of a robot")?;
        let Some((run, time, joints)) = found else { return Ok(None) };
        let intent = self.open_intent(run)?;
        Ok(Some(LastPose { run, time, joints, intent }))
    }

    /// What the last attempt of a run that had set out to do something had set out to do, unless it passed.
    fn open_intent(&self, run: RunId) -> Result<Option<Value>, RecordError> {
        let last = self
            .connection
            .query_row(
                "SELECT intent, coalesce(outcome, '') FROM steps WHERE run = ?1 AND intent IS NOT NULL \
                 ORDER BY id DESC LIMIT 1",
                params![run.0],
                |row| Ok((json_column(row, 0)?, row.get::<_, String>(1)?)),
            )
            .optional()
            .during("read what a run had set out to do")?;
        Ok(last.filter(|(_, outcome)| outcome != "passed").map(|(intent, _)| intent))
    }
}
