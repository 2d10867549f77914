//! Corrections: what runs found out about a machine, put in force revision by revision.

use rusqlite::{Row, params};
use serde::{Deserialize, Serialize};

use crate::error::During;
use crate::record::timestamp;
use crate::{Record, RecordError, RunId};

/// What a correction is about.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct CorrectionKey {
    /// Device whose description changes.
    pub device: String,
    /// What changes: `joint_zero`.
    pub quantity: String,
    /// Where: a joint's name.
    pub place: String,
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
    /// One standard uncertainty of the value found.
    pub uncertainty: f64,
    /// Unit of all three.
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
    /// One standard uncertainty of the value found.
    pub uncertainty: f64,
    /// Unit of all three.
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
    /// Its standard uncertainty.
    pub uncertainty: f64,
    /// Unit of both.
    pub unit: String,
    /// The revision that put it in force.
    pub revision: i64,
    /// The run that found it; none for a rollback.
    pub run: Option<RunId>,
}

const COLUMNS: &str =
    "id, run, step, device, quantity, place, old, new, uncertainty, unit, proposed, revision";

impl Record {
    /// Notes corrections found by a step of a run, not yet in force; gives their numbers.
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
            insert(&transaction, Some(run), step, cell, correction, None).during("note corrections")?;
            numbers.push(transaction.last_insert_rowid());
        }
        transaction.commit().during("note corrections")?;
        Ok(numbers)
    }

    /// Puts proposed corrections of one device in force, together, as a new revision; gives its number.
    ///
    /// # Errors
    /// When the record cannot be written.
    pub fn apply_corrections(
        &mut self,
        cell: &str,
        device: &str,
        corrections: &[i64],
        reason: &str,
    ) -> Result<i64, RecordError> {
        self.on_the_disk(|record| {
            let transaction = record.connection.transaction().during("apply corrections")?;
            let revision = new_revision(&transaction, cell, device, reason).during("apply corrections")?;
            for correction in corrections {
                transaction
                    .execute(
                        "UPDATE corrections SET revision = ?2 WHERE id = ?1 AND revision IS NULL",
                        params![correction, revision],
                    )
                    .during("apply corrections")?;
            }
            transaction.commit().during("apply corrections")?;
            Ok(revision)
        })
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
    fn corrections_at(
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
                    key: CorrectionKey { device: row.get(0)?, quantity: row.get(1)?, place: row.get(2)? },
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

    /// Brings back what was in force at an earlier revision, as a new revision; gives its number. Corrections that first came into
    /// force after it go back to the value they replaced.
    ///
    /// # Errors
    /// [`RecordError::NoSuchRevision`], or when the record cannot be read or written.
    pub fn roll_back(
        &mut self,
        cell: &str,
        device: &str,
        revision: i64,
        reason: &str,
    ) -> Result<i64, RecordError> {
        let known: bool = self
            .connection
            .query_row(
                "SELECT count(*) FROM revisions WHERE id = ?1 AND cell = ?2 AND device = ?3",
                params![revision, cell, device],
                |row| row.get(0),
            )
            .during("look for a revision")?;
        if !known {
            return Err(RecordError::NoSuchRevision {
                cell: cell.to_owned(),
                device: device.to_owned(),
                revision,
            });
        }
        let then = self.corrections_at(cell, device, revision)?;
        let mut back = Vec::new();
        for now in self.corrections_in_force(cell, device)? {
            let (value, uncertainty) = match then.iter().find(|earlier| earlier.key == now.key) {
                Some(earlier) => (earlier.value, earlier.uncertainty),
                None => (self.first_old_value(cell, &now.key)?, 0.0),
            };
            if value != now.value {
                back.push(NewCorrection {
                    key: now.key,
                    old: now.value,
                    new: value,
                    uncertainty,
                    unit: now.unit,
                });
            }
        }
        self.on_the_disk(|record| {
            let transaction = record.connection.transaction().during("roll corrections back")?;
            let made = new_revision(&transaction, cell, device, reason).during("roll corrections back")?;
            for correction in &back {
                insert(&transaction, None, "roll_back", cell, correction, Some(made))
                    .during("roll corrections back")?;
            }
            transaction.commit().during("roll corrections back")?;
            Ok(made)
        })
    }

    fn first_old_value(&self, cell: &str, key: &CorrectionKey) -> Result<f64, RecordError> {
        self.connection
            .query_row(
                "SELECT old FROM corrections WHERE cell = ?1 AND device = ?2 AND quantity = ?3 AND place = ?4 \
                 AND revision IS NOT NULL ORDER BY revision LIMIT 1",
                params![cell, key.device, key.quantity, key.place],
                |row| row.get(0),
            )
            .during("read the first value of a correction")
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
            params![cell, key.device, key.quantity, key.place],
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
            Ok((
                row.get(0)?,
                CorrectionKey { device: row.get(1)?, quantity: row.get(2)?, place: row.get(3)? },
            ))
        });
        rows.and_then(Iterator::collect).during("list what was corrected")
    }

    fn corrections_where(
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

fn new_revision(
    transaction: &rusqlite::Transaction<'_>,
    cell: &str,
    device: &str,
    reason: &str,
) -> rusqlite::Result<i64> {
    transaction.execute(
        "INSERT INTO revisions (cell, device, made, reason) VALUES (?1, ?2, ?3, ?4)",
        params![cell, device, timestamp(), reason],
    )?;
    Ok(transaction.last_insert_rowid())
}

fn insert(
    transaction: &rusqlite::Transaction<'_>,
    run: Option<RunId>,
    step: &str,
    cell: &str,
    correction: &NewCorrection,
    revision: Option<i64>,
) -> rusqlite::Result<usize> {
    transaction.execute(
        "INSERT INTO corrections (run, step, cell, device, quantity, place, old, new, uncertainty, unit, proposed, revision) \
         VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12)",
        params![
            run.map(|run| run.0),
            step,
            cell,
            correction.key.device,
            correction.key.quantity,
            correction.key.place,
            correction.old,
            correction.new,
            correction.uncertainty,
            correction.unit,
            timestamp(),
            revision
        ],
    )
}

fn stored(row: &Row<'_>) -> rusqlite::Result<StoredCorrection> {
    Ok(StoredCorrection {
        id: row.get(0)?,
        run: row.get::<_, Option<i64>>(1)?.map(RunId),
        step: row.get(2)?,
        key: CorrectionKey { device: row.get(3)?, quantity: row.get(4)?, place: row.get(5)? },
        old: row.get(6)?,
        new: row.get(7)?,
        uncertainty: row.get(8)?,
        unit: row.get(9)?,
        proposed: row.get(10)?,
        revision: row.get(11)?,
    })
}
