//! Looking back: which runs there were, and how a correction went over time.

use rusqlite::params_from_iter;
use serde::Serialize;

use crate::error::During;
use crate::run::{COLUMNS, summary};
use crate::{Record, RecordError, RunId, RunSummary};

/// Which runs are wanted; everything left out is any.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct RunFilter {
    /// Of this cell.
    pub cell: Option<String>,
    /// Of this procedure.
    pub procedure: Option<String>,
    /// By this operator.
    pub operator: Option<String>,
    /// Ended so: `passed`, ..., or `running`.
    pub state: Option<String>,
    /// Started on this day or later: `2026-11-21`.
    pub since: Option<String>,
    /// Started on this day or earlier.
    pub until: Option<String>,
    /// At most so many, the newest.
    pub limit: u32,
}

/// One finding of a correction.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TrendPoint {
    /// The run that found it; none for a rollback.
    pub run: Option<RunId>,
    /// When.
    pub time: String,
    /// The cell.
    pub cell: String,
    /// What was found: `joint_zero`.
    pub quantity: String,
    /// Value that was in force.
    pub old: f64,
    /// Value found.
    pub new: f64,
    /// Its standard uncertainty; none where it was not determined.
    pub uncertainty: Option<f64>,
    /// Unit of all three.
    pub unit: String,
    /// The revision that put it in force; none where it never was.
    pub revision: Option<i64>,
    /// It is in force now: no later revision replaced it.
    pub in_force: bool,
}

impl Record {
    /// The newest runs first, at most `limit`.
    ///
    /// # Errors
    /// When the record cannot be read.
    pub fn history(&self, limit: u32) -> Result<Vec<RunSummary>, RecordError> {
        self.find_runs(&RunFilter { limit, ..RunFilter::default() })
    }

    /// The runs wanted, the newest first.
    ///
    /// # Errors
    /// When the record cannot be read.
    pub fn find_runs(&self, filter: &RunFilter) -> Result<Vec<RunSummary>, RecordError> {
        let conditions = [
            ("cell = ?", filter.cell.clone()),
            ("procedure = ?", filter.procedure.clone()),
            ("operator = ?", filter.operator.clone()),
            ("state = ?", filter.state.clone()),
            ("substr(started, 1, 10) >= ?", filter.since.clone()),
            ("substr(started, 1, 10) <= ?", filter.until.clone()),
        ];
        let requested: Vec<(&str, String)> =
            conditions.into_iter().filter_map(|(condition, value)| Some((condition, value?))).collect();
        let conditions: Vec<&str> = requested.iter().map(|(condition, _)| *condition).collect();
        let filter_text = match conditions.is_empty() {
            true => String::new(),
            false => format!("WHERE {}", conditions.join(" AND ")),
        };
        let mut statement = self
            .connection
            .prepare(&format!(
                "SELECT {COLUMNS} FROM runs {filter_text} ORDER BY id DESC LIMIT {}",
                filter.limit
            ))
            .during("list the runs")?;
        let rows = statement
            .query_map(params_from_iter(requested.iter().map(|(_, value)| value)), summary)
            .during("list the runs")?;
        rows.collect::<Result<_, _>>().during("list the runs")
    }

    /// What runs found for one site of a device over time, the oldest first; of one cell, or of all.
    ///
    /// # Errors
    /// When the record cannot be read.
    pub fn trend(
        &self,
        device: &str,
        site: &str,
        cell: Option<&str>,
    ) -> Result<Vec<TrendPoint>, RecordError> {
        let mut statement = self
            .connection
            .prepare(
                "SELECT run, proposed, cell, quantity, old, new, uncertainty, unit, revision, \
                 revision IS NOT NULL AND revision = (SELECT max(revision) FROM corrections WHERE cell = found.cell \
                 AND device = found.device AND quantity = found.quantity AND place = found.place) \
                 FROM corrections AS found WHERE device = ?1 AND place = ?2 AND (?3 IS NULL OR cell = ?3) ORDER BY id",
            )
            .during("read a trend")?;
        let rows = statement
            .query_map(rusqlite::params![device, site, cell], |row| {
                Ok(TrendPoint {
                    run: row.get::<_, Option<i64>>(0)?.map(RunId),
                    time: row.get(1)?,
                    cell: row.get(2)?,
                    quantity: row.get(3)?,
                    old: row.get(4)?,
                    new: row.get(5)?,
                    uncertainty: row.get(6)?,
                    unit: row.get(7)?,
                    revision: row.get(8)?,
                    in_force: row.get(9)?,
                })
            })
            .during("read a trend")?;
        rows.collect::<Result<_, _>>().during("read a trend")
    }

    /// The sites that corrections were found for, as DEVICE.PLACE.
    ///
    /// # Errors
    /// When the record cannot be read.
    pub fn corrected_sites(&self) -> Result<Vec<String>, RecordError> {
        let mut statement = self
            .connection
            .prepare("SELECT DISTINCT device || '.' || place FROM corrections ORDER BY 1")
            .during("list what was corrected")?;
        let rows = statement.query_map([], |row| row.get(0)).during("list what was corrected")?;
        rows.collect::<Result<_, _>>().during("list what was corrected")
    }
}
