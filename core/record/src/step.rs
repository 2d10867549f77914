//! The plan of a run and what became of each step.

use rusqlite::{OptionalExtension as _, params};
use serde::Serialize;
use serde_json::Value;

use crate::error::During;
use crate::record::timestamp;
use crate::run::json_column;
use crate::{Record, RecordError, RunId};

/// One row of a plan.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PlannedRow {
    /// The step's path, unique in its run.
    pub step: String,
    /// For people.
    pub title: String,
    /// `move`, `search`, ...
    pub kind: String,
    /// How many repetitions it is in.
    pub depth: u32,
    /// Estimated time, seconds.
    pub estimate_s: Option<f64>,
}

/// How one attempt at a step ended.
#[derive(Debug, Clone, PartialEq)]
pub struct StepEnd<'a> {
    /// `passed`, `failed`, `error`, `skipped`, `not_needed` or `interrupted`.
    pub outcome: &'a str,
    /// One sentence.
    pub message: &'a str,
    /// What later steps refer to.
    pub result: &'a Value,
}

/// One attempt at a step as the record holds it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StoredStep {
    /// The step's path.
    pub step: String,
    /// 1 at first.
    pub attempt: u32,
    /// When it began.
    pub started: String,
    /// When it ended; none when the program was killed in it.
    pub ended: Option<String>,
    /// How it ended.
    pub outcome: Option<String>,
    /// One sentence.
    pub message: Option<String>,
    /// What later steps refer to.
    pub result: Value,
}

/// A step that goes on.
#[derive(Debug, Clone, PartialEq)]
pub struct OpenStep {
    /// Its row, unique in the record.
    pub row: i64,
    /// The step's path.
    pub step: String,
    /// When it began.
    pub started: String,
    /// How long it was planned to take, s.
    pub estimate_s: Option<f64>,
}

impl Record {
    /// Notes the plan of a run.
    ///
    /// # Errors
    /// When the record cannot be written.
    pub fn note_plan(&mut self, run: RunId, plan: &[PlannedRow]) -> Result<(), RecordError> {
        let transaction = self.connection.transaction().during("note a plan")?;
        for (position, row) in plan.iter().enumerate() {
            transaction
                .execute(
                    "INSERT INTO plan (run, position, step, title, kind, depth, estimate_s) VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7)",
                    params![run.0, position as i64, row.step, row.title, row.kind, row.depth, row.estimate_s],
                )
                .during("note a plan")?;
        }
        transaction.commit().during("note a plan")
    }

    /// The plan of a run.
    ///
    /// # Errors
    /// When the record cannot be read.
    pub fn plan(&self, run: RunId) -> Result<Vec<PlannedRow>, RecordError> {
        let mut statement = self
            .connection
            .prepare("SELECT step, title, kind, depth, estimate_s FROM plan WHERE run = ?1 ORDER BY position")
            .during("read a plan")?;
        let rows = statement
            .query_map(params![run.0], |row| {
                Ok(PlannedRow {
                    step: row.get(0)?,
                    title: row.get(1)?,
                    kind: row.get(2)?,
                    depth: row.get(3)?,
                    estimate_s: row.get(4)?,
                })
            })
            .during("read a plan")?;
        rows.collect::<Result<_, _>>().during("read a plan")
    }

    /// Begins a step; gives the row to end it by and which attempt this is.
    ///
    /// # Errors
    /// When the record cannot be written.
    pub fn start_step(&mut self, run: RunId, step: &str) -> Result<(i64, u32), RecordError> {
        let attempt: u32 = self
            .connection
            .query_row(
                "SELECT count(*) + 1 FROM steps WHERE run = ?1 AND step = ?2",
                params![run.0, step],
                |row| row.get(0),
            )
            .during("count the attempts at a step")?;
        self.connection
            .execute(
                "INSERT INTO steps (run, step, attempt, started) VALUES (?1, ?2, ?3, ?4)",
                params![run.0, step, attempt, timestamp()],
            )
            .during("start a step")?;
        Ok((self.connection.last_insert_rowid(), attempt))
    }

    /// Notes what the attempt begun as `row` sets out to do, before it does it: where a relative move will end, where a search begins.
    ///
    /// # Errors
    /// When the record cannot be written.
    pub fn note_intent(&mut self, row: i64, intent: &Value) -> Result<(), RecordError> {
        self.connection
            .execute("UPDATE steps SET intent = ?2 WHERE id = ?1", params![row, intent.to_string()])
            .during("note the intent of a step")?;
        Ok(())
    }

    /// What the latest attempt at a step that noted an intent set out to do.
    ///
    /// # Errors
    /// When the record cannot be read.
    pub fn intent(&self, run: RunId, step: &str) -> Result<Option<Value>, RecordError> {
        let found = self
            .connection
            .query_row(
                "SELECT intent FROM steps WHERE run = ?1 AND step = ?2 AND intent IS NOT NULL ORDER BY id DESC LIMIT 1",
                params![run.0, step],
                |row| json_column(row, 0),
            )
            .optional()
            .during("read the intent of a step")?;
        Ok(found)
    }

    /// Ends the attempt begun as `row`.
    ///
    /// # Errors
    /// When the record cannot be written.
    pub fn end_step(&mut self, row: i64, end: &StepEnd<'_>) -> Result<(), RecordError> {
        self.connection
            .execute(
                "UPDATE steps SET ended = ?2, outcome = ?3, message = ?4, result = ?5 WHERE id = ?1",
                params![row, timestamp(), end.outcome, end.message, end.result.to_string()],
            )
            .during("end a step")?;
        Ok(())
    }

    /// The step that goes on in a run, if one does: the innermost, where one holds others.
    ///
    /// # Errors
    /// When the record cannot be read.
    pub fn open_step(&self, run: RunId) -> Result<Option<OpenStep>, RecordError> {
        self.connection
            .query_row(
                "SELECT id, step, started, (SELECT estimate_s FROM plan WHERE plan.run = steps.run AND plan.step = steps.step) FROM steps \
                 WHERE run = ?1 AND ended IS NULL ORDER BY id DESC LIMIT 1",
                params![run.0],
                |row| {
                    Ok(OpenStep { row: row.get(0)?, step: row.get(1)?, started: row.get(2)?, estimate_s: row.get(3)? })
                },
            )
            .optional()
            .during("read the step that goes on")
    }

    /// Every attempt at every step of a run, in the order they began.
    ///
    /// # Errors
    /// When the record cannot be read.
    pub fn steps(&self, run: RunId) -> Result<Vec<StoredStep>, RecordError> {
        let mut statement = self
            .connection
            .prepare("SELECT step, attempt, started, ended, outcome, message, result FROM steps WHERE run = ?1 ORDER BY id")
            .during("read the steps of a run")?;
        let rows = statement
            .query_map(params![run.0], |row| {
                Ok(StoredStep {
                    step: row.get(0)?,
                    attempt: row.get(1)?,
                    started: row.get(2)?,
                    ended: row.get(3)?,
                    outcome: row.get(4)?,
                    message: row.get(5)?,
                    result: json_column(row, 6)?,
                })
            })
            .during("read the steps of a run")?;
        rows.collect::<Result<_, _>>().during("read the steps of a run")
    }
}
