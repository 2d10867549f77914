//! Runs: one execution of a procedure in a cell, in one or more sittings.

use rusqlite::{OptionalExtension as _, Row, params};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::error::During;
use crate::location::record_option;
use crate::record::timestamp;
use crate::{Instrument, LoadedFile, Record, RecordError, RunId, instrument, loaded, note, queue_start};

/// What is known when a run starts.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct NewRun {
    /// Name of the cell.
    pub cell: String,
    /// Path of its file, absolute.
    pub cell_file: String,
    /// Name of the procedure.
    pub procedure: String,
    /// Path of its file, absolute.
    pub procedure_file: String,
    /// Its title.
    pub title: String,
    /// Who runs it.
    pub operator: String,
    /// Answers come from a file.
    pub unattended: bool,
    /// Parameters in force, an object of names and numbers.
    pub parameters: Value,
    /// What else a resume needs; the caller's own words.
    pub settings: Value,
    /// Version of the program.
    pub program: String,
    /// The files it is made of.
    pub loaded: Vec<LoadedFile>,
    /// What is measured with.
    pub instruments: Vec<Instrument>,
    /// What the operator wants remembered.
    pub notes: Vec<String>,
    /// The entry of the queue that it carries out.
    pub queue_entry: Option<i64>,
}

/// How a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RunEnd {
    /// All steps passed.
    Passed,
    /// A check did not hold.
    Failed,
    /// Something went wrong.
    Error,
    /// A person ended it.
    Aborted,
    /// It needs an answer nobody is there to give.
    NeedsOperator,
}

/// Whether and how a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RunState {
    /// Not ended: it runs now, or its program was killed.
    Running,
    /// It ended.
    #[serde(untagged)]
    Ended(RunEnd),
}

/// Whether and how a run ended, as its column says.
pub(crate) fn state_column(text: &str) -> RunState {
    match text {
        "passed" => RunState::Ended(RunEnd::Passed),
        "failed" => RunState::Ended(RunEnd::Failed),
        "aborted" => RunState::Ended(RunEnd::Aborted),
        "needs_operator" => RunState::Ended(RunEnd::NeedsOperator),
        "running" => RunState::Running,
        _ => RunState::Ended(RunEnd::Error),
    }
}

impl RunEnd {
    /// As the record and people write it.
    pub fn name(self) -> &'static str {
        match self {
            RunEnd::Passed => "passed",
            RunEnd::Failed => "failed",
            RunEnd::Error => "error",
            RunEnd::Aborted => "aborted",
            RunEnd::NeedsOperator => "needs_operator",
        }
    }
}

/// A run as the record holds it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RunSummary {
    /// Its number.
    pub run: RunId,
    /// Name of the cell.
    pub cell: String,
    /// Path of its file.
    pub cell_file: String,
    /// Name of the procedure.
    pub procedure: String,
    /// Path of its file.
    pub procedure_file: String,
    /// Title of the procedure.
    pub title: String,
    /// Who ran it.
    pub operator: String,
    /// Answers came from a file.
    pub unattended: bool,
    /// Parameters in force.
    pub parameters: Value,
    /// What else a resume needs.
    pub settings: Value,
    /// Version of the program that started it.
    pub program: String,
    /// Socket of its simulated world, while that may still live.
    pub world: Option<String>,
    /// When it started.
    pub started: String,
    /// When it ended.
    pub ended: Option<String>,
    /// Whether and how it ended.
    pub state: RunState,
    /// The sentence it ended with.
    pub message: Option<String>,
    /// Steps that were left out after an error, on request; those that were done later are not among them.
    pub skipped: Vec<String>,
}

/// Where a robot's drive last said it was.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StoredPose {
    /// The robot.
    pub device: String,
    /// When that was written down.
    pub time: String,
    /// The joints, in the writer's own words.
    pub joints: Value,
}

pub(crate) const COLUMNS: &str = "id, cell, cell_file, procedure, procedure_file, title, operator, unattended, parameters, settings, \
                       program, world, started, ended, state, message, \
                       (SELECT json_group_array(step) FROM steps AS attempt WHERE run = runs.id AND outcome = 'skipped' AND NOT EXISTS \
                       (SELECT 1 FROM steps WHERE run = attempt.run AND step = attempt.step AND id > attempt.id))";

impl Record {
    /// Begins a run, with everything that is known of it, and gives its number.
    ///
    /// # Errors
    /// When the record cannot be written; where another program keeps it locked, with its name.
    pub fn start_run(&mut self, run: &NewRun) -> Result<RunId, RecordError> {
        let started = self.insert_run(run);
        started.map_err(|error| self.with_holders(error))
    }

    fn insert_run(&mut self, run: &NewRun) -> Result<RunId, RecordError> {
        let transaction = self.connection.transaction().during("start a run")?;
        transaction
            .execute(
                "INSERT INTO runs (cell, cell_file, procedure, procedure_file, title, operator, unattended, parameters, \
                 settings, program, started, state) VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, 'running')",
                params![
                    run.cell,
                    run.cell_file,
                    run.procedure,
                    run.procedure_file,
                    run.title,
                    run.operator,
                    run.unattended,
                    run.parameters.to_string(),
                    run.settings.to_string(),
                    run.program,
                    timestamp()
                ],
            )
            .during("start a run")?;
        let id = RunId(transaction.last_insert_rowid());
        loaded::insert(&transaction, id, &run.loaded).during("start a run")?;
        instrument::insert(&transaction, id, &run.instruments).during("start a run")?;
        for note in &run.notes {
            note::insert(&transaction, id, &run.operator, note).during("start a run")?;
        }
        if let Some(entry) = run.queue_entry {
            queue_start::begin(&transaction, entry, id)?;
        }
        transaction.commit().during("start a run")?;
        Ok(id)
    }

    /// Notes the socket of the run's simulated world, or that it has gone.
    ///
    /// # Errors
    /// When the record cannot be written.
    pub fn set_world(&mut self, run: RunId, socket: Option<&str>) -> Result<(), RecordError> {
        self.connection
            .execute("UPDATE runs SET world = ?2 WHERE id = ?1", params![run.0, socket])
            .during("note the world of a run")?;
        Ok(())
    }

    /// Ends a run. A run that ended stays ended, but may be ended again after it was resumed.
    ///
    /// # Errors
    /// When the record cannot be written.
    pub fn end_run(&mut self, run: RunId, end: RunEnd, message: &str) -> Result<(), RecordError> {
        self.on_the_disk(|record| {
            let ended = record.connection.execute(
                "UPDATE runs SET ended = ?2, state = ?3, message = ?4 WHERE id = ?1",
                params![run.0, timestamp(), end.name(), message],
            );
            ended.during("end a run").map(drop)
        })
    }

    /// Marks an interrupted run as running again.
    ///
    /// # Errors
    /// When the record cannot be written.
    pub fn reopen_run(&mut self, run: RunId) -> Result<(), RecordError> {
        self.connection
            .execute(
                "UPDATE runs SET ended = NULL, state = 'running', message = NULL WHERE id = ?1",
                params![run.0],
            )
            .during("resume a run")?;
        Ok(())
    }

    /// One run.
    ///
    /// # Errors
    /// [`RecordError::NoSuchRun`], or when the record cannot be read.
    pub fn run(&self, run: RunId) -> Result<RunSummary, RecordError> {
        self.connection
            .query_row(&format!("SELECT {COLUMNS} FROM runs WHERE id = ?1"), params![run.0], summary)
            .optional()
            .during("read a run")?
            .ok_or_else(|| RecordError::NoSuchRun { run: run.0, option: record_option(self.directory()) })
    }

    /// The newest run of `cell` that has not ended, if any.
    ///
    /// # Errors
    /// When the record cannot be read.
    pub fn unfinished_run(&self, cell: &str) -> Result<Option<RunSummary>, RecordError> {
        self.connection
            .query_row(
                &format!("SELECT {COLUMNS} FROM runs WHERE cell = ?1 AND state = 'running' ORDER BY id DESC LIMIT 1"),
                params![cell],
                summary,
            )
            .optional()
            .during("look for an unfinished run")
    }

    /// Notes where a robot's drive says it is.
    ///
    /// # Errors
    /// When the record cannot be written.
    pub fn note_pose(&mut self, run: RunId, device: &str, joints: &Value) -> Result<(), RecordError> {
        self.connection
            .execute(
                // Replaced, not updated: the newest has the greatest row number, whatever the system's clock did meanwhile.
                "INSERT OR REPLACE INTO poses (run, device, time, joints) VALUES (?1, ?2, ?3, ?4)",
                params![run.0, device, timestamp(), joints.to_string()],
            )
            .during("note a pose")?;
        Ok(())
    }

    /// The last pose of each robot of a run.
    ///
    /// # Errors
    /// When the record cannot be read.
    pub fn poses(&self, run: RunId) -> Result<Vec<StoredPose>, RecordError> {
        let mut statement = self
            .connection
            .prepare("SELECT device, time, joints FROM poses WHERE run = ?1 ORDER BY device")
            .during("read the poses of a run")?;
        let rows = statement
            .query_map(params![run.0], |row| {
                Ok(StoredPose { device: row.get(0)?, time: row.get(1)?, joints: json_column(row, 2)? })
            })
            .during("read the poses of a run")?;
        rows.collect::<Result<_, _>>().during("read the poses of a run")
    }
}

pub(crate) fn summary(row: &Row<'_>) -> rusqlite::Result<RunSummary> {
    Ok(RunSummary {
        run: RunId(row.get(0)?),
        cell: row.get(1)?,
        cell_file: row.get(2)?,
        procedure: row.get(3)?,
        procedure_file: row.get(4)?,
        title: row.get(5)?,
        operator: row.get(6)?,
        unattended: row.get(7)?,
        parameters: json_column(row, 8)?,
        settings: json_column(row, 9)?,
        program: row.get(10)?,
        world: row.get(11)?,
        started: row.get(12)?,
        ended: row.get(13)?,
        state: state_column(&row.get::<_, String>(14)?),
        message: row.get(15)?,
        skipped: texts(&json_column(row, 16)?),
    })
}

/// The texts of a JSON list.
fn texts(list: &Value) -> Vec<String> {
    list.as_array().into_iter().flatten().filter_map(Value::as_str).map(str::to_owned).collect()
}

/// Reads a column that holds JSON; null where it is empty.
pub(crate) fn json_column(row: &Row<'_>, index: usize) -> rusqlite::Result<Value> {
    let Some(text) = row.get::<_, Option<String>>(index)? else { return Ok(Value::Null) };
    serde_json::from_str(&text).map_err(|error| {
        rusqlite::Error::FromSqlConversionFailure(index, rusqlite::types::Type::Text, Box::new(error))
    })
}
