//! Runs that wait for their cell.
//!
//! An entry and the run that carries it out are tied in the transaction that begins the run. So a program that is killed at any
//! moment leaves an entry that either waits, or has its run: no entry is begun twice, and none is lost.

use rusqlite::{OptionalExtension as _, Row, Transaction, TransactionBehavior, params};
use serde::Serialize;
use serde_json::Value;

use crate::error::During;
use crate::record::timestamp;
use crate::run::{json_column, state_column};
use crate::{Record, RecordError, RunId, RunState};

/// What is to be run.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct NewQueueEntry {
    /// Name of the cell.
    pub cell: String,
    /// Path of its file, absolute. Entries of one file make one queue.
    pub cell_file: String,
    /// Name of the procedure.
    pub procedure: String,
    /// Parameters other than their defaults, an object of names and numbers.
    pub parameters: Value,
    /// Path of the file of answers, absolute; none: the cell's own.
    pub answers: Option<String>,
    /// Who put it there.
    pub author: String,
}

/// An entry of a queue.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct QueueEntry {
    /// Its number, unique in the record.
    pub id: i64,
    /// Name of the cell.
    pub cell: String,
    /// Path of its file.
    pub cell_file: String,
    /// Name of the procedure.
    pub procedure: String,
    /// Parameters other than their defaults.
    pub parameters: Value,
    /// Path of the file of answers.
    pub answers: Option<String>,
    /// Who put it there.
    pub author: String,
    /// When.
    pub added: String,
    /// When it was taken off, if it was.
    pub removed: Option<String>,
    /// The run that carries it out, once it has begun.
    pub run: Option<RunId>,
    /// How that run is.
    pub state: Option<RunState>,
    /// The sentence that run ended with.
    pub message: Option<String>,
}

impl QueueEntry {
    /// Whether its run has not begun.
    pub fn is_waiting(&self) -> bool {
        self.run.is_none() && self.removed.is_none()
    }
}

/// Where an entry goes, among those of its cell that wait.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum QueuePosition {
    /// Before all others.
    First,
    /// After all others.
    Last,
    /// Before the entry of this number.
    Before(i64),
    /// After the entry of this number.
    After(i64),
}

const COLUMNS: &str = "queue.id, queue.cell, queue.cell_file, queue.procedure, queue.parameters, answers, author, added, removed, run, \
                       runs.state, runs.message FROM queue LEFT JOIN runs ON runs.id = queue.run";

impl Record {
    /// Puts an entry at the end of its cell's queue, and gives its number.
    ///
    /// # Errors
    /// When the record cannot be written.
    pub fn add_to_queue(&mut self, entry: &NewQueueEntry) -> Result<i64, RecordError> {
        self.on_the_disk(|record| {
            record
                .connection
                .execute(
                    "INSERT INTO queue (place, cell, cell_file, procedure, parameters, answers, author, added) \
                     VALUES ((SELECT coalesce(max(place), 0) + 1 FROM queue), ?1, ?2, ?3, ?4, ?5, ?6, ?7)",
                    params![
                        entry.cell,
                        entry.cell_file,
                        entry.procedure,
                        entry.parameters.to_string(),
                        entry.answers,
                        entry.author,
                        timestamp()
                    ],
                )
                .during("queue a run")?;
            Ok(record.connection.last_insert_rowid())
        })
    }

    /// The entries that are not over, of one cell file or of all: first those whose run has begun and not passed, then those that
    /// wait, in the order in which they will be run.
    ///
    /// # Errors
    /// When the record cannot be read.
    pub fn queue(&self, cell_file: Option<&str>) -> Result<Vec<QueueEntry>, RecordError> {
        let mut statement = self
            .connection
            .prepare(&format!(
                "SELECT {COLUMNS} WHERE removed IS NULL AND (run IS NULL OR runs.state <> 'passed') \
                 AND (?1 IS NULL OR queue.cell_file = ?1) ORDER BY queue.cell_file, run IS NULL, place"
            ))
            .during("read the queue")?;
        let rows = statement.query_map(params![cell_file], entry).during("read the queue")?;
        rows.collect::<Result<_, _>>().during("read the queue")
    }

    /// One entry, over or not.
    ///
    /// # Errors
    /// [`RecordError::NoSuchQueueEntry`], or when the record cannot be read.
    pub fn queue_entry(&self, id: i64) -> Result<QueueEntry, RecordError> {
        self.connection
            .query_row(&format!("SELECT {COLUMNS} WHERE queue.id = ?1"), params![id], entry)
            .optional()
            .during("read the queue")?
            .ok_or(RecordError::NoSuchQueueEntry { entry: id })
    }

    /// Moves an entry that waits.
    ///
    /// # Errors
    /// [`RecordError::NotWaiting`] for it or for the one it is to be beside; or the record cannot be written.
    pub fn move_in_queue(&mut self, id: i64, to: QueuePosition) -> Result<(), RecordError> {
        self.queue_entry(id)?;
        self.on_the_disk(|record| {
            let transaction = record
                .connection
                .transaction_with_behavior(TransactionBehavior::Immediate)
                .during("reorder the queue")?;
            let before = waiting_beside(&transaction, id).during("reorder the queue")?;
            let order = moved(before.iter().map(|(id, _)| *id).collect(), id, to)?;
            // The same positions, given out anew: entries that stay where they are are not written.
            for ((was, position), now) in before.iter().zip(order) {
                if *was != now {
                    transaction
                        .execute("UPDATE queue SET place = ?2 WHERE id = ?1", params![now, position])
                        .during("reorder the queue")?;
                }
            }
            transaction.commit().during("reorder the queue")
        })
    }

    /// Takes an entry off. A run that was begun for it stays as it is.
    ///
    /// # Errors
    /// [`RecordError::NoSuchQueueEntry`], [`RecordError::NotWaiting`] where it is off already; or the record cannot be written.
    pub fn remove_from_queue(&mut self, id: i64) -> Result<(), RecordError> {
        self.queue_entry(id)?;
        self.on_the_disk(|record| {
            let changed = record.connection.execute(
                "UPDATE queue SET removed = ?2 WHERE id = ?1 AND removed IS NULL",
                params![id, timestamp()],
            );
            match changed.during("take a run off the queue")? {
                0 => Err(RecordError::NotWaiting { entry: id }),
                _ => Ok(()),
            }
        })
    }
}

/// The entries that wait for the same cell as `id`, and their positions, in their order.
fn waiting_beside(transaction: &Transaction<'_>, id: i64) -> rusqlite::Result<Vec<(i64, i64)>> {
    let mut statement = transaction.prepare(
        "SELECT id, place FROM queue WHERE run IS NULL AND removed IS NULL \
         AND cell_file = (SELECT cell_file FROM queue WHERE id = ?1) ORDER BY place",
    )?;
    let rows = statement.query_map(params![id], |row| Ok((row.get(0)?, row.get(1)?)))?;
    rows.collect()
}

/// The order with one entry moved.
fn moved(mut order: Vec<i64>, id: i64, to: QueuePosition) -> Result<Vec<i64>, RecordError> {
    let position_of = |order: &[i64], entry: i64| {
        order.iter().position(|one| *one == entry).ok_or(RecordError::NotWaiting { entry })
    };
    let from = position_of(&order, id)?;
    order.remove(from);
    let to = match to {
        QueuePosition::First => 0,
        QueuePosition::Last => order.len(),
        // Beside itself: it stays.
        QueuePosition::Before(other) | QueuePosition::After(other) if other == id => from,
        QueuePosition::Before(other) => position_of(&order, other)?,
        QueuePosition::After(other) => position_of(&order, other)? + 1,
    };
    order.insert(to, id);
    Ok(order)
}

fn entry(row: &Row<'_>) -> rusqlite::Result<QueueEntry> {
    Ok(QueueEntry {
        id: row.get(0)?,
        cell: row.get(1)?,
        cell_file: row.get(2)?,
        procedure: row.get(3)?,
        parameters: json_column(row, 4)?,
        answers: row.get(5)?,
        author: row.get(6)?,
        added: row.get(7)?,
        removed: row.get(8)?,
        run: row.get::<_, Option<i64>>(9)?.map(RunId),
        state: row.get::<_, Option<String>>(10)?.map(|text| state_column(&text)),
        message: row.get(11)?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{NewRun, RunEnd};

    fn record_with(entries: &[(&str, &str)]) -> (tempfile::TempDir, Record) {
        let directory = tempfile::tempdir().expect("a directory");
        let mut record = Record::open(directory.path()).expect("a new record");
        for (cell_file, procedure) in entries {
            let entry = NewQueueEntry {
                cell: "bench".into(),
                cell_file: (*cell_file).into(),
                procedure: (*procedure).into(),
                ..NewQueueEntry::default()
            };
            record.add_to_queue(&entry).expect("queued");
        }
        (directory, record)
    }

    fn order(record: &Record) -> Vec<i64> {
        record.queue(None).expect("read").iter().map(|entry| entry.id).collect()
    }

    #[test]
    fn entries_are_moved_within_their_cell_alone() {
        let (_directory, mut record) =
            record_with(&[("/a", "one"), ("/b", "two"), ("/a", "three"), ("/a", "four")]);
        assert_eq!(order(&record), [1, 3, 4, 2]);
        for (id, to, expected) in [
            (4, QueuePosition::First, [4, 1, 3, 2]),
            (4, QueuePosition::After(1), [1, 4, 3, 2]),
            (1, QueuePosition::Last, [4, 3, 1, 2]),
            (1, QueuePosition::Before(3), [4, 1, 3, 2]),
            (1, QueuePosition::Before(1), [4, 1, 3, 2]),
        ] {
            record.move_in_queue(id, to).expect("moved");
            assert_eq!(order(&record), expected, "{id} {to:?}");
        }
        let other_cell =
            record.move_in_queue(1, QueuePosition::Before(2)).expect_err("of another cell").to_string();
        assert!(other_cell.contains("entry 2"), "{other_cell}");
        assert!(matches!(
            record.move_in_queue(9, QueuePosition::First),
            Err(RecordError::NoSuchQueueEntry { entry: 9 })
        ));
    }

    #[test]
    fn an_entry_is_begun_once_with_its_run_or_not_at_all() {
        let (_directory, mut record) = record_with(&[("/a", "one"), ("/a", "two")]);
        let begin = |record: &mut Record, entry: i64| {
            record.start_run(&NewRun { cell: "bench".into(), queue_entry: Some(entry), ..NewRun::default() })
        };
        let run = begin(&mut record, 1).expect("begun");
        assert_eq!(record.queue_entry(1).expect("read").run, Some(run));
        assert!(matches!(begin(&mut record, 1), Err(RecordError::NotWaiting { entry: 1 })));
        record.remove_from_queue(2).expect("removed");
        assert!(matches!(begin(&mut record, 2), Err(RecordError::NotWaiting { entry: 2 })));
        assert!(matches!(record.remove_from_queue(2), Err(RecordError::NotWaiting { entry: 2 })));
        assert_eq!(
            record.number_of_runs().expect("read"),
            1,
            "a run that cannot take its entry is not begun"
        );
        assert!(matches!(
            record.move_in_queue(1, QueuePosition::Last),
            Err(RecordError::NotWaiting { entry: 1 })
        ));
        record.end_run(run, RunEnd::Passed, "all steps passed").expect("ended");
        assert_eq!(order(&record), Vec::<i64>::new(), "what has passed is over");
    }
}
