//! Readings: numbers that steps measured or computed.

use rusqlite::params;
use serde::Serialize;

use crate::error::During;
use crate::{Record, RecordError, RunId};

/// A number worth keeping.
#[derive(Debug, Clone, PartialEq)]
pub struct Reading<'a> {
    /// The device it came from, or `computed`.
    pub source: &'a str,
    /// What it is.
    pub name: &'a str,
    /// The number.
    pub value: f64,
    /// Its unit.
    pub unit: &'a str,
    /// One standard uncertainty.
    pub uncertainty: Option<f64>,
}

/// A reading as the record holds it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StoredReading {
    /// The step that took it.
    pub step: String,
    /// The device it came from, or `computed`.
    pub source: String,
    /// What it is.
    pub name: String,
    /// The number.
    pub value: f64,
    /// Its unit.
    pub unit: String,
    /// One standard uncertainty.
    pub uncertainty: Option<f64>,
}

impl Record {
    /// Notes readings of one step.
    ///
    /// # Errors
    /// When the record cannot be written (a number that is not finite cannot).
    pub fn note_readings(
        &mut self,
        run: RunId,
        step: &str,
        readings: &[Reading<'_>],
    ) -> Result<(), RecordError> {
        let transaction = self.connection.transaction().during("note readings")?;
        for reading in readings {
            transaction
                .execute(
                    "INSERT INTO readings (run, step, source, name, value, unit, uncertainty) VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7)",
                    params![run.0, step, reading.source, reading.name, reading.value, reading.unit, reading.uncertainty],
                )
                .during("note readings")?;
        }
        transaction.commit().during("note readings")
    }

    /// All readings of a run, in the order they were taken.
    ///
    /// # Errors
    /// When the record cannot be read.
    pub fn readings(&self, run: RunId) -> Result<Vec<StoredReading>, RecordError> {
        let mut statement = self
            .connection
            .prepare("SELECT step, source, name, value, unit, uncertainty FROM readings WHERE run = ?1 ORDER BY id")
            .during("read the readings of a run")?;
        let rows = statement
            .query_map(params![run.0], |row| {
                Ok(StoredReading {
                    step: row.get(0)?,
                    source: row.get(1)?,
                    name: row.get(2)?,
                    value: row.get(3)?,
                    unit: row.get(4)?,
                    uncertainty: row.get(5)?,
                })
            })
            .during("read the readings of a run")?;
        rows.collect::<Result<_, _>>().during("read the readings of a run")
    }
}
