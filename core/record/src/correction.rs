//! Corrections: what runs found out about a machine, put in force revision by revision.

use rusqlite::{OptionalExtension as _, Row, Transaction, params};
use serde::{Deserialize, Serialize};

use crate::error::During;
use crate::record::timestamp;
use crate::{Budget, Record, RecordError, RunId};

/// What a correction is about.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct CorrectionKey {
    /// Device whose description changes.
    pub device: String,
    /// What changes: `joint_zero`.
    pub quantity: String,
    /// Where: a joint's name.
    #[serde(rename = "place")]
    pub site: String,
}

/// A correction a run proposes.
#[derive(Debug, Clone, PartialEq)]
pub struct NewCorrection {
    /// What it is about.
    pub key: CorrectionKey,
    /// Value in force.
    pub old: f64,
    /// Value found.
    pub new: f64,
    /// One standard uncertainty of the value found; none where it was not determined. It is never 0.
    pub uncertainty: Option<f64>,
    /// What the uncertainty is made of, where the run worked that out.
    pub budget: Option<Budget>,
    /// Unit of old, new and uncertainty.
    pub unit: String,
}

/// A correction as the record holds it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StoredCorrection {
    /// Its number.
    pub id: i64,
    /// The run that found it; none for a rollback.
    pub run: Option<RunId>,
    /// The step that proposed it.
    pub step: String,
    /// What it is about.
    #[serde(flatten)]
    pub key: CorrectionKey,
    /// Value that was in force.
    pub old: f64,
    /// Value found.
    pub new: f64,
    /// One standard uncertainty of the value found; none where it was not determined.
    pub uncertainty: Option<f64>,
    /// What the uncertainty is made of, where the run worked that out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub budget: Option<Budget>,
    /// Unit of old, new and uncertainty.
    pub unit: String,
    /// When it was proposed.
    pub proposed: String,
    /// The revision that put it in force; none while it is only a proposal.
    pub revision: Option<i64>,
}

/// A correction in force.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AppliedCorrection {
    /// What it is about.
    #[serde(flatten)]
    pub key: CorrectionKey,
    /// The value.
    pub value: f64,
    /// Its standard uncertainty; none where it was not determined.
    pub uncertainty: Option<f64>,
    /// Unit of both.
    pub unit: String,
    /// The revision that put it in force.
    pub revision: i64,
    /// The run that found it; none for a rollback.
    pub run: Option<RunId>,
}

const COLUMNS: &str =
    "id, run, step, device, quantity, place, old, new, uncertainty, unit, proposed, revision, budget";

impl Record {
    /// Notes corrections found by a step of a run, not yet in force; gives their numbers. What the step proposed before, when it was
    /// interrupted, keeps its number.
    ///
    /// # Errors
    /// When the record cannot be written.
    pub fn propose_corrections(
        &mut self,
        run: RunId,
        step: &str,
        cell: &str,
        corrections: &[NewCorrection],
    ) -> Result<Vec<i64>, RecordError> {
        let transaction = self.connection.transaction().during("note corrections")?;
        let mut numbers = Vec::new();
        for correction in corrections {
            let before = proposed_before(&transaction, run.0, step, cell, correction);
            if let Some(number) = before.during("note corrections")? {
                numbers.push(number);
                continue;
            }
            insert(&transaction, Some(run), step, cell, correction, None).during("note corrections")?;
            numbers.push(transaction.last_insert_rowid());
        }
        transaction.commit().during("note corrections")?;
        Ok(numbers)
    }

    /// The corrections of a device in force: the newest of each key.
    ///
    /// # Errors
    /// When the record cannot be read.
    pub fn corrections_in_force(
        &self,
        cell: &str,
        device: &str,
    ) -> Result<Vec<AppliedCorrection>, RecordError> {
        self.corrections_at(cell, device, i64::MAX)
    }

    /// The corrections of a device as they were in force at `revision`.
    pub(crate) fn corrections_at(
        &self,
        cell: &str,
        device: &str,
        revision: i64,
    ) -> Result<Vec<AppliedCorrection>, RecordError> {
        let mut statement = self
            .connection
            .prepare(
                "SELECT device, quantity, place, new, uncertainty, unit, revision, run FROM corrections AS found \
                 WHERE cell = ?1 AND device = ?2 AND revision = (SELECT max(revision) FROM corrections \
                 WHERE cell = found.cell AND device = found.device AND quantity = found.quantity \
                 AND place = found.place AND revision <= ?3) ORDER BY quantity, id",
            )
            .during("read the corrections in force")?;
        let rows = statement
            .query_map(params![cell, device, revision], |row| {
                Ok(AppliedCorrection {
                    key: CorrectionKey { device: row.get(0)?, quantity: row.get(1)?, site: row.get(2)? },
                    value: row.get(3)?,
                    uncertainty: row.get(4)?,
                    unit: row.get(5)?,
                    revision: row.get(6)?,
                    run: row.get::<_, Option<i64>>(7)?.map(RunId),
                })
            })
            .during("read the corrections in force")?;
        rows.collect::<Result<_, _>>().during("read the corrections in force")
    }

    /// All corrections a run proposed, in order.
    ///
    /// # Errors
    /// When the record cannot be read.
    pub fn corrections_of_run(&self, run: RunId) -> Result<Vec<StoredCorrection>, RecordError> {
        self.corrections_where("run = ?1 ORDER BY id", params![run.0])
    }

    /// Every value one quantity ever had in force, oldest first.
    ///
    /// # Errors
    /// When the record cannot be read.
    pub fn correction_history(
        &self,
        cell: &str,
        key: &CorrectionKey,
    ) -> Result<Vec<StoredCorrection>, RecordError> {
        self.corrections_where(
            "cell = ?1 AND device = ?2 AND quantity = ?3 AND place = ?4 AND revision IS NOT NULL ORDER BY revision",
            params![cell, key.device, key.quantity, key.site],
        )
    }

    /// Everything that ever had a value put in force: the cell and what of it, in the order of their first corrections.
    ///
    /// # Errors
    /// When the record cannot be read.
    pub fn corrected(&self) -> Result<Vec<(String, CorrectionKey)>, RecordError> {
        let mut statement = self
            .connection
            .prepare(
                "SELECT cell, device, quantity, place FROM corrections WHERE revision IS NOT NULL \
                 GROUP BY cell, device, quantity, place ORDER BY MIN(id)",
            )
            .during("list what was corrected")?;
        let rows = statement.query_map([], |row| {
            Ok((row.get(0)?, CorrectionKey { device: row.get(1)?, quantity: row.get(2)?, site: row.get(3)? }))
        });
        rows.and_then(Iterator::collect).during("list what was corrected")
    }

    pub(crate) fn corrections_where(
        &self,
        condition: &str,
        values: impl rusqlite::Params,
    ) -> Result<Vec<StoredCorrection>, RecordError> {
        let mut statement = self
            .connection
            .prepare(&format!("SELECT {COLUMNS} FROM corrections WHERE {condition}"))
            .during("read corrections")?;
        let rows = statement.query_map(values, stored).during("read corrections")?;
        rows.collect::<Result<_, _>>().during("read corrections")
    }
}

/// The proposal that this run made at this step before, when it was interrupted there; it is the same finding and is noted once.
fn proposed_before(
    transaction: &Transaction<'_>,
    run: i64,
    step: &str,
    cell: &str,
    correction: &NewCorrection,
) -> rusqlite::Result<Option<i64>> {
    let key = &correction.key;
    transaction
        .query_row(
            "SELECT id FROM corrections WHERE run = ?1 AND step = ?2 AND cell = ?3 AND device = ?4 AND quantity = ?5 AND place = ?6 \
             AND old = ?7 AND new = ?8 AND revision IS NULL",
            params![run, step, cell, key.device, key.quantity, key.site, correction.old, correction.new],
            |row| row.get(0),
        )
        .optional()
}

pub(crate) fn insert(
    transaction: &rusqlite::Transaction<'_>,
    run: Option<RunId>,
    step: &str,
    cell: &str,
    correction: &NewCorrection,
    revision: Option<i64>,
) -> rusqlite::Result<usize> {
    transaction.execute(
        "INSERT INTO corrections (run, step, cell, device, quantity, place, old, new, uncertainty, unit, proposed, revision, budget) \
         VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12, ?13)",
        params![
            run.map(|run| run.0),
            step,
            cell,
            correction.key.device,
            correction.key.quantity,
            correction.key.site,
            correction.old,
            correction.new,
            known(correction.uncertainty),
            correction.unit,
            timestamp(),
            revision,
            correction.budget.as_ref().map(|budget| serde_json::json!(budget).to_string()),
        ],
    )
}

fn stored(row: &Row<'_>) -> rusqlite::Result<StoredCorrection> {
    Ok(StoredCorrection {
        id: row.get(0)?,
        run: row.get::<_, Option<i64>>(1)?.map(RunId),
        step: row.get(2)?,
        key: CorrectionKey { device: row.get(3)?, quantity: row.get(4)?, site: row.get(5)? },
        old: row.get(6)?,
        new: row.get(7)?,
        uncertainty: row.get(8)?,
        unit: row.get(9)?,
        proposed: row.get(10)?,
        revision: row.get(11)?,
        budget: budget(row, 12)?,
    })
}

/// An uncertainty worth keeping: 0, an infinite one and none at all were not determined.
fn known(uncertainty: Option<f64>) -> Option<f64> {
    uncertainty.map(f64::abs).filter(|value| value.is_finite() && *value > 0.0)
}

fn budget(row: &Row<'_>, index: usize) -> rusqlite::Result<Option<Budget>> {
    let Some(text) = row.get::<_, Option<String>>(index)? else { return Ok(None) };
    serde_json::from_str(&text).map(Some).map_err(|error| {
        rusqlite::Error::FromSqlConversionFailure(index, rusqlite::types::Type::Text, Box::new(error))
    })
}
