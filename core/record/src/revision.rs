//! Revisions: corrections of one device come into force together, and are brought back together.

use rusqlite::{Transaction, params};
use serde::Serialize;

use crate::correction::insert;
use crate::error::During;
use crate::location::record_option;
use crate::quantity::CONTROLLER_ZERO;
use crate::record::timestamp;
use crate::{CorrectionKey, NewCorrection, Record, RecordError, RunId, StoredCorrection};

/// The revision before the first: nothing was corrected yet.
const BEFORE_THE_FIRST: i64 = 0;

/// The step that a rolled back value is said to be of.
const ROLL_BACK: &str = "roll_back";

/// Corrections of one device that came into force together.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Revision {
    /// Its number.
    pub revision: i64,
    /// The device.
    pub device: String,
    /// When it came into force.
    pub made: String,
    /// Why: the run and step, or who rolled back.
    pub reason: String,
    /// What it put in force.
    pub corrections: Vec<StoredCorrection>,
}

/// What a roll back did.
#[derive(Debug, Clone, PartialEq)]
pub struct RolledBack {
    /// The new revision it made.
    pub revision: i64,
    /// What it put back in force: `old` was in force until now.
    pub changed: Vec<NewCorrection>,
    /// What it could not bring back, since the controller keeps it.
    pub left: Vec<CorrectionKey>,
}

impl Record {
    /// Puts proposed corrections of one device in force, all of them or none, as a new revision; gives its number.
    ///
    /// # Errors
    /// [`RecordError::NotProposed`] when one of them is none of this device's proposals, or is in force already; or when the record cannot
    /// be written. Nothing is in force then that was not before.
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
                let applied = transaction
                    .execute(
                        "UPDATE corrections SET revision = ?2 WHERE id = ?1 AND revision IS NULL AND cell = ?3 AND device = ?4",
                        params![correction, revision, cell, device],
                    )
                    .during("apply corrections")?;
                if applied != 1 {
                    return Err(RecordError::NotProposed { correction: *correction });
                }
            }
            transaction.commit().during("apply corrections")?;
            Ok(revision)
        })
    }

    /// The revisions of a cell's corrections, the oldest first.
    ///
    /// # Errors
    /// When the record cannot be read.
    pub fn revisions(&self, cell: &str) -> Result<Vec<Revision>, RecordError> {
        let mut statement = self
            .connection
            .prepare("SELECT id, device, made, reason FROM revisions WHERE cell = ?1 ORDER BY id")
            .during("list the revisions")?;
        let rows = statement
            .query_map(params![cell], |row| {
                Ok(Revision {
                    revision: row.get(0)?,
                    device: row.get(1)?,
                    made: row.get(2)?,
                    reason: row.get(3)?,
                    corrections: Vec::new(),
                })
            })
            .during("list the revisions")?;
        let mut revisions: Vec<Revision> = rows.collect::<Result<_, _>>().during("list the revisions")?;
        for one in &mut revisions {
            one.corrections = self.corrections_where("revision = ?1 ORDER BY id", params![one.revision])?;
        }
        Ok(revisions)
    }

    /// The cells that have corrections, by name.
    ///
    /// # Errors
    /// When the record cannot be read.
    pub fn corrected_cells(&self) -> Result<Vec<String>, RecordError> {
        let mut statement = self
            .connection
            .prepare("SELECT DISTINCT cell FROM revisions ORDER BY cell")
            .during("list the cells")?;
        let rows = statement.query_map([], |row| row.get(0)).during("list the cells")?;
        rows.collect::<Result<_, _>>().during("list the cells")
    }

    /// Brings back what was in force at an earlier revision, as a new revision. Corrections that first came into force after it go back
    /// to the value they replaced. Revision 0 is what was before the first. What the controller keeps is left as it is, and reported.
    ///
    /// # Errors
    /// [`RecordError::NoSuchRevision`], [`RecordError::NothingToBringBack`], or when the record cannot be read or written.
    pub fn roll_back(
        &mut self,
        cell: &str,
        device: &str,
        revision: i64,
        reason: &str,
    ) -> Result<RolledBack, RecordError> {
        self.require_revision(cell, device, revision)?;
        let (changed, left) = self.way_back(cell, device, revision)?;
        if changed.is_empty() {
            return Err(RecordError::NothingToBringBack {
                cell: cell.to_owned(),
                device: device.to_owned(),
                revision,
                kept_by_controller: !left.is_empty(),
            });
        }
        self.on_the_disk(|record| {
            let transaction = record.connection.transaction().during("roll corrections back")?;
            let made = new_revision(&transaction, cell, device, reason).during("roll corrections back")?;
            for correction in &changed {
                insert(&transaction, None, ROLL_BACK, cell, correction, Some(made))
                    .during("roll corrections back")?;
            }
            transaction.commit().during("roll corrections back")?;
            Ok(RolledBack { revision: made, changed, left })
        })
    }

    /// The corrections of a run that were taken back before it ended, each with the revision that did so: its operator went back past the step
    /// that had applied them. What a rollback brought back, and what had been replaced before that, was not taken back. While a run goes on nobody else rolls back.
    ///
    /// # Errors
    /// When the record cannot be read.
    pub fn undone_in_run(&self, run: RunId) -> Result<Vec<(i64, i64)>, RecordError> {
        let mut statement = self
            .connection
            .prepare(
                "SELECT found.id, min(back.revision) FROM corrections AS found JOIN runs ON runs.id = found.run \
                 JOIN corrections AS back ON back.cell = found.cell AND back.device = found.device \
                 AND back.quantity = found.quantity AND back.place = found.place AND back.run IS NULL \
                 AND back.step = ?2 AND back.revision > found.revision \
                 WHERE found.run = ?1 AND (runs.ended IS NULL OR back.proposed <= runs.ended) \
                 AND found.revision > coalesce((SELECT max(kept.revision) FROM corrections AS kept \
                 WHERE kept.cell = back.cell AND kept.device = back.device AND kept.quantity = back.quantity \
                 AND kept.place = back.place AND kept.revision < back.revision AND kept.new = back.new), 0) \
                 GROUP BY found.id",
            )
            .during("look for corrections taken back")?;
        let rows = statement
            .query_map(params![run.0, ROLL_BACK], |row| Ok((row.get(0)?, row.get(1)?)))
            .during("look for corrections taken back")?;
        rows.collect::<Result<_, _>>().during("look for corrections taken back")
    }

    fn require_revision(&self, cell: &str, device: &str, revision: i64) -> Result<(), RecordError> {
        let known: bool = self
            .connection
            .query_row(
                "SELECT count(*) FROM revisions WHERE (id = ?1 OR ?1 = ?4) AND cell = ?2 AND device = ?3",
                params![revision, cell, device, BEFORE_THE_FIRST],
                |row| row.get(0),
            )
            .during("look for a revision")?;
        if known {
            return Ok(());
        }
        Err(RecordError::NoSuchRevision {
            option: record_option(self.directory()),
            cell: cell.to_owned(),
            device: device.to_owned(),
            revision,
        })
    }

    /// What has to change for a revision to be in force again, and what of it the record cannot change.
    fn way_back(
        &self,
        cell: &str,
        device: &str,
        revision: i64,
    ) -> Result<(Vec<NewCorrection>, Vec<CorrectionKey>), RecordError> {
        let then = self.corrections_at(cell, device, revision)?;
        let (mut changed, mut left) = (Vec::new(), Vec::new());
        for now in self.corrections_in_force(cell, device)? {
            let (value, uncertainty, budget) = match then.iter().find(|earlier| earlier.key == now.key) {
                Some(earlier) => {
                    (earlier.value, earlier.uncertainty, self.budget_of(cell, &now.key, earlier.revision)?)
                }
                None => (self.first_old_value(cell, &now.key)?, None, None),
            };
            if value == now.value {
                continue;
            }
            if now.key.quantity == CONTROLLER_ZERO {
                left.push(now.key);
                continue;
            }
            let (key, unit) = (now.key, now.unit);
            changed.push(NewCorrection { key, old: now.value, new: value, uncertainty, budget, unit });
        }
        Ok((changed, left))
    }

    fn budget_of(
        &self,
        cell: &str,
        key: &CorrectionKey,
        revision: i64,
    ) -> Result<Option<crate::Budget>, RecordError> {
        let found = self.corrections_where(
            "cell = ?1 AND device = ?2 AND quantity = ?3 AND place = ?4 AND revision = ?5",
            params![cell, key.device, key.quantity, key.site, revision],
        )?;
        Ok(found.into_iter().next().and_then(|one| one.budget))
    }

    fn first_old_value(&self, cell: &str, key: &CorrectionKey) -> Result<f64, RecordError> {
        self.connection
            .query_row(
                "SELECT old FROM corrections WHERE cell = ?1 AND device = ?2 AND quantity = ?3 AND place = ?4 \
                 AND revision IS NOT NULL ORDER BY revision LIMIT 1",
                params![cell, key.device, key.quantity, key.site],
                |row| row.get(0),
            )
            .during("read the first value of a correction")
    }
}

fn new_revision(
    transaction: &Transaction<'_>,
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::NewRun;

    const CELL: &str = "teachmover";

    fn record() -> (tempfile::TempDir, Record, RunId) {
        let directory = tempfile::tempdir().expect("a directory");
        let mut record = Record::open(directory.path()).expect("a record");
        let run = record.start_run(&NewRun { cell: CELL.into(), ..NewRun::default() }).expect("a run");
        (directory, record, run)
    }

    /// Proposes zeros of joints, each with the value it replaces; gives their numbers.
    fn proposed(record: &mut Record, run: RunId, step: &str, zeros: &[(&str, f64, f64)]) -> Vec<i64> {
        let zeros = zeros.iter().map(|(joint, old, new)| NewCorrection {
            key: CorrectionKey { device: "arm".into(), quantity: "joint_zero".into(), site: (*joint).into() },
            old: *old,
            new: *new,
            uncertainty: None,
            budget: None,
            unit: "deg".into(),
        });
        let zeros: Vec<NewCorrection> = zeros.collect();
        record.propose_corrections(run, step, CELL, &zeros).expect("proposals")
    }

    fn apply(record: &mut Record, numbers: &[i64]) -> Result<i64, RecordError> {
        record.apply_corrections(CELL, "arm", numbers, "found")
    }

    fn in_force_at(record: &Record, revision: i64) -> Vec<(String, f64)> {
        let found = record.corrections_at(CELL, "arm", revision).expect("read");
        found.into_iter().map(|one| (one.key.site, one.value)).collect()
    }

    #[test]
    fn a_write_that_fails_between_two_corrections_leaves_neither_in_force_and_no_revision() {
        let (_directory, mut record, run) = record();
        let numbers = proposed(&mut record, run, "zeros", &[("waist", 0.0, 1.0), ("elbow", 0.0, 2.0)]);
        // As a full disk would: the first correction is written, the second is not.
        record
            .connection
            .execute_batch(
                "CREATE TEMP TRIGGER full BEFORE UPDATE ON main.corrections WHEN NEW.place = 'elbow' \
                 BEGIN SELECT RAISE(FAIL, 'the disk is full'); END",
            )
            .expect("a trigger");
        let error = apply(&mut record, &numbers).expect_err("cannot be written").to_string();
        assert!(error.contains("the disk is full"), "{error}");
        assert_eq!(in_force_at(&record, i64::MAX), []);
        assert_eq!(record.revisions(CELL).expect("read"), []);
        record.connection.execute_batch("DROP TRIGGER full").expect("dropped");
        assert_eq!(apply(&mut record, &numbers).expect("applied now"), 1);
        assert_eq!(in_force_at(&record, 1).len(), 2);
    }

    #[test]
    fn corrections_come_into_force_once_and_not_with_one_that_is_none() {
        let (_directory, mut record, run) = record();
        let numbers = proposed(&mut record, run, "zeros", &[("waist", 0.0, 1.0)]);
        let with_another = [numbers[0], numbers[0] + 1];
        assert!(matches!(
            apply(&mut record, &with_another),
            Err(RecordError::NotProposed { correction }) if correction == with_another[1]
        ));
        assert_eq!(in_force_at(&record, i64::MAX), [], "all of them or none");
        let first = apply(&mut record, &numbers).expect("applied");
        assert!(matches!(apply(&mut record, &numbers), Err(RecordError::NotProposed { .. })), "twice");
        assert_eq!(record.revisions(CELL).expect("read").len(), 1);
        assert_eq!(in_force_at(&record, first), [("waist".to_owned(), 1.0)]);
        let of_another = record.apply_corrections(CELL, "other", &numbers, "found");
        assert!(matches!(of_another, Err(RecordError::NotProposed { .. })), "no proposal of that device");
    }

    #[test]
    fn at_a_revision_that_revision_counts_and_later_ones_do_not() {
        let (_directory, mut record, run) = record();
        let mut revisions = Vec::new();
        for (step, old, new) in [("first", 0.0, 1.0), ("second", 1.0, 2.0), ("third", 2.0, 3.0)] {
            let numbers = proposed(&mut record, run, step, &[("waist", old, new)]);
            revisions.push(apply(&mut record, &numbers).expect("applied"));
        }
        for (revision, value) in revisions.iter().zip([1.0, 2.0, 3.0]) {
            assert_eq!(in_force_at(&record, *revision), [("waist".to_owned(), value)]);
        }
        assert_eq!(in_force_at(&record, BEFORE_THE_FIRST), []);
        // The value before the first, not that before the last.
        let back = record.roll_back(CELL, "arm", BEFORE_THE_FIRST, "all wrong").expect("a rollback");
        assert_eq!((back.changed[0].old, back.changed[0].new), (3.0, 0.0));
        assert!(matches!(
            record.roll_back(CELL, "arm", BEFORE_THE_FIRST, "again"),
            Err(RecordError::NothingToBringBack { .. })
        ));
    }
}
