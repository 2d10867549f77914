//! Pauses, stops, losses and resumes of a run, and its log.

use rusqlite::params;
use serde::Serialize;

use crate::error::During;
use crate::record::timestamp;
use crate::{Record, RecordError, RunId};

/// What interrupted a run, or let it go on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Interruption {
    /// A program began to run it, at first or on resume.
    SittingBegan,
    /// Paused.
    Paused,
    /// Went on after a pause or stop.
    Resumed,
    /// All motion stopped.
    Stopped,
    /// Someone asked for its abortion.
    AbortAsked,
    /// Someone asked to finish it early.
    FinishAsked,
    /// Someone left it as it was, to be resumed later.
    Left,
    /// A device's process was lost.
    DeviceLost,
}

impl Interruption {
    fn name(self) -> &'static str {
        match self {
            Interruption::SittingBegan => "sitting_began",
            Interruption::Paused => "paused",
            Interruption::Resumed => "resumed",
            Interruption::Stopped => "stopped",
            Interruption::AbortAsked => "abort_asked",
            Interruption::FinishAsked => "finish_asked",
            Interruption::Left => "left",
            Interruption::DeviceLost => "device_lost",
        }
    }
}

/// An interruption as the record holds it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct StoredInterruption {
    /// When.
    pub time: String,
    /// What: `paused`, `device_lost`, ...
    pub kind: String,
    /// The step in hand.
    pub step: Option<String>,
    /// Who or why.
    pub reason: String,
}

/// A log line as the record holds it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct StoredLogLine {
    /// When.
    pub time: String,
    /// `debug`, `info`, `warning` or `error`.
    pub level: String,
    /// The device or part that said it.
    pub source: String,
    /// The step it served.
    pub step: Option<String>,
    /// The line.
    pub message: String,
}

impl Record {
    /// Notes an interruption of a run.
    ///
    /// # Errors
    /// When the record cannot be written.
    pub fn note_interruption(
        &mut self,
        run: RunId,
        kind: Interruption,
        step: Option<&str>,
        reason: &str,
    ) -> Result<(), RecordError> {
        self.connection
            .execute(
                "INSERT INTO interruptions (run, time, kind, step, reason) VALUES (?1, ?2, ?3, ?4, ?5)",
                params![run.0, timestamp(), kind.name(), step, reason],
            )
            .during("note an interruption")?;
        Ok(())
    }

    /// All interruptions of a run, in order.
    ///
    /// # Errors
    /// When the record cannot be read.
    pub fn interruptions(&self, run: RunId) -> Result<Vec<StoredInterruption>, RecordError> {
        let mut statement = self
            .connection
            .prepare("SELECT time, kind, step, reason FROM interruptions WHERE run = ?1 ORDER BY id")
            .during("read the interruptions of a run")?;
        let rows = statement
            .query_map(params![run.0], |row| {
                Ok(StoredInterruption {
                    time: row.get(0)?,
                    kind: row.get(1)?,
                    step: row.get(2)?,
                    reason: row.get(3)?,
                })
            })
            .during("read the interruptions of a run")?;
        rows.collect::<Result<_, _>>().during("read the interruptions of a run")
    }

    /// Notes a log line of a run.
    ///
    /// # Errors
    /// When the record cannot be written.
    pub fn note_log(
        &mut self,
        run: RunId,
        level: &str,
        source: &str,
        step: Option<&str>,
        message: &str,
    ) -> Result<(), RecordError> {
        self.connection
            .execute(
                "INSERT INTO log (run, time, level, source, step, message) VALUES (?1, ?2, ?3, ?4, ?5, ?6)",
                params![run.0, timestamp(), level, source, step, message],
            )
            .during("note a log line")?;
        Ok(())
    }

    /// The log of a run, in order.
    ///
    /// # Errors
    /// When the record cannot be read.
    pub fn log(&self, run: RunId) -> Result<Vec<StoredLogLine>, RecordError> {
        let mut statement = self
            .connection
            .prepare("SELECT time, level, source, step, message FROM log WHERE run = ?1 ORDER BY id")
            .during("read the log of a run")?;
        let rows = statement
            .query_map(params![run.0], |row| {
                Ok(StoredLogLine {
                    time: row.get(0)?,
                    level: row.get(1)?,
                    source: row.get(2)?,
                    step: row.get(3)?,
                    message: row.get(4)?,
                })
            })
            .during("read the log of a run")?;
        rows.collect::<Result<_, _>>().during("read the log of a run")
    }
}
