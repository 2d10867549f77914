//! The outbox: what leaves the record for a central database.
//!
//! Every row that is written to another table, and every row that is changed, is appended to the table `outbox` as JSON by a
//! trigger of SQLite. So it happens in the same transaction as the change itself, no matter who makes it, and no writing method
//! can forget it. Sequence numbers grow with the order of the transactions, for SQLite has one writer at a time: anyone who has
//! seen number n has seen everything before it.

use rusqlite::{OptionalExtension as _, Row, params};

use crate::error::During;
use crate::outbox_triggers::send_what_is_there;
use crate::{Record, RecordError, sha256_hex};

/// Rows that are taken off at once: some milliseconds.
const TRIMMED_AT_ONCE: u32 = 2_000;

/// A row of the outbox.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OutboxRow {
    /// Its position in the order of everything that was written, from 1.
    pub sequence: i64,
    /// The table of the record it was written to: `runs`, `corrections`.
    pub kind: String,
    /// The row's number in that table. A row that changes comes again with the same number.
    pub number: i64,
    /// When it was written, UTC.
    pub made: String,
    /// The row as a JSON object.
    pub body: String,
}

impl OutboxRow {
    /// SHA-256 over everything it says, in hexadecimal: two rows that say the same have the same.
    pub fn digest(&self) -> String {
        let mut bytes = self.sequence.to_be_bytes().to_vec();
        for text in [&self.kind, &self.made, &self.body] {
            bytes.extend_from_slice(text.as_bytes());
            bytes.push(0);
        }
        sha256_hex(&bytes)
    }

    fn read(row: &Row<'_>) -> rusqlite::Result<Self> {
        Ok(Self {
            sequence: row.get(0)?,
            kind: row.get(1)?,
            number: row.get(2)?,
            made: row.get(3)?,
            body: row.get(4)?,
        })
    }
}

impl Record {
    /// What distinguishes this record from every other one: 32 hexadecimal digits, drawn when it was made.
    ///
    /// # Errors
    /// When the record cannot be read.
    pub fn identity(&self) -> Result<String, RecordError> {
        self.connection
            .query_row("SELECT id FROM identity", [], |row| row.get(0))
            .during("tell which record it is")
    }

    /// Gives the record a new identity. For one that was copied, or brought back from a copy, and went on: its rows are then
    /// sent anew, as those of another record. Where rows were taken off the outbox, it is filled anew from the tables.
    ///
    /// # Errors
    /// When the record cannot be written.
    pub fn renew_identity(&mut self) -> Result<String, RecordError> {
        self.on_the_disk(|record| {
            record
                .connection
                .execute("UPDATE identity SET id = lower(hex(randomblob(16)))", [])
                .during("take a new identity")?;
            if record.first_outbox_row()?.is_some_and(|first| first > 1) {
                let transaction = record.connection.transaction().during("fill its outbox")?;
                // Under a new name its rows are counted from 1 again: a gap would say that some are missing.
                transaction
                    .execute_batch("DELETE FROM outbox; DELETE FROM sqlite_sequence WHERE name = 'outbox'")
                    .during("fill its outbox")?;
                send_what_is_there(&transaction).during("fill its outbox")?;
                transaction.commit().during("fill its outbox")?;
            }
            record.identity()
        })
    }

    /// The rows of the outbox after number `after`, in their order, `limit` at most.
    ///
    /// # Errors
    /// When the record cannot be read.
    pub fn outbox_after(&self, after: i64, limit: u32) -> Result<Vec<OutboxRow>, RecordError> {
        let mut statement = self
            .connection
            .prepare_cached(
                "SELECT sequence, kind, number, made, body FROM outbox WHERE sequence > ?1 ORDER BY sequence LIMIT ?2",
            )
            .during("read its outbox")?;
        let rows = statement.query_map(params![after, limit], OutboxRow::read).during("read its outbox")?;
        rows.collect::<Result<_, _>>().during("read its outbox")
    }

    /// One row of the outbox.
    ///
    /// # Errors
    /// When the record cannot be read.
    pub fn outbox_row(&self, sequence: i64) -> Result<Option<OutboxRow>, RecordError> {
        self.connection
            .query_row(
                "SELECT sequence, kind, number, made, body FROM outbox WHERE sequence = ?1",
                params![sequence],
                OutboxRow::read,
            )
            .optional()
            .during("read its outbox")
    }

    /// The number of the oldest row of the outbox; none when it is empty.
    ///
    /// # Errors
    /// When the record cannot be read.
    pub fn first_outbox_row(&self) -> Result<Option<i64>, RecordError> {
        self.connection
            .query_row("SELECT min(sequence) FROM outbox", [], |row| row.get(0))
            .during("read its outbox")
    }

    /// Takes rows off the outbox that were sent, number `sent` the last, and are older than so many days; how many. The last that was
    /// sent stays, by which a copied record is recognised. The rows themselves stay in their tables.
    ///
    /// # Errors
    /// When the record cannot be written.
    pub fn trim_outbox(&mut self, sent: i64, days: u32) -> Result<usize, RecordError> {
        let mut trimmed = 0;
        // In parts, so that a run never waits long for its own rows to be written.
        loop {
            let part = self
                .connection
                .execute(
                    "DELETE FROM outbox WHERE sequence IN (SELECT sequence FROM outbox WHERE sequence < ?1 \
                     AND made < strftime('%Y-%m-%dT%H:%M:%fZ', 'now', ?2) ORDER BY sequence LIMIT ?3)",
                    params![sent, format!("-{days} days"), TRIMMED_AT_ONCE],
                )
                .during("take sent rows off its outbox")?;
            trimmed += part;
            if part == 0 {
                return Ok(trimmed);
            }
        }
    }

    /// The number of the newest row of the outbox; 0 when nothing was ever written.
    ///
    /// # Errors
    /// When the record cannot be read.
    pub fn newest_outbox_row(&self) -> Result<i64, RecordError> {
        self.connection
            .query_row("SELECT coalesce(max(sequence), 0) FROM outbox", [], |row| row.get(0))
            .during("read its outbox")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::outbox_triggers::sent_tables;
    use crate::{NewRun, RunEnd};

    fn new_record() -> (tempfile::TempDir, Record) {
        let directory = tempfile::tempdir().expect("a directory");
        let record = Record::open(directory.path()).expect("a new record");
        (directory, record)
    }

    #[test]
    fn a_run_goes_into_the_outbox_when_it_starts_and_again_when_it_ends() {
        let (_directory, mut record) = new_record();
        let run = record.start_run(&NewRun { cell: "bench".into(), ..NewRun::default() }).expect("started");
        record.end_run(run, RunEnd::Passed, "all steps passed").expect("ended");
        let rows = record.outbox_after(0, 100).expect("read");
        let runs: Vec<&OutboxRow> = rows.iter().filter(|row| row.kind == "runs").collect();
        let states: Vec<String> = runs
            .iter()
            .map(|row| {
                serde_json::from_str::<serde_json::Value>(&row.body).expect("JSON")["state"].to_string()
            })
            .collect();
        assert_eq!(states, ["\"running\"", "\"passed\""]);
        assert!(runs.iter().all(|row| row.number == run.0));
        assert!(rows.windows(2).all(|pair| pair[0].sequence < pair[1].sequence));
    }

    #[test]
    fn what_is_rolled_back_never_was_in_the_outbox() {
        let (_directory, mut record) = new_record();
        let transaction = record.connection.transaction().expect("begun");
        transaction
            .execute("INSERT INTO revisions (cell, device, made, reason) VALUES ('c', 'd', '', '')", [])
            .expect("written");
        transaction.rollback().expect("rolled back");
        assert_eq!(record.newest_outbox_row().expect("read"), 0);
    }

    #[test]
    fn every_table_but_the_records_own_has_both_triggers_with_all_its_columns() {
        let (_directory, record) = new_record();
        let tables = sent_tables(&record.connection).expect("read");
        assert!(tables.contains(&"runs".to_owned()) && tables.contains(&"zero_losses".to_owned()));
        for table in tables {
            let triggers: Vec<String> = record
                .connection
                .prepare("SELECT sql FROM sqlite_schema WHERE type = 'trigger' AND tbl_name = ?1")
                .and_then(|mut found| found.query_map([&table], |row| row.get(0))?.collect())
                .expect("read");
            assert_eq!(triggers.len(), 2, "{table}");
            let columns: Vec<String> = record
                .connection
                .prepare("SELECT name FROM pragma_table_info(?1) WHERE type <> 'BLOB'")
                .and_then(|mut found| found.query_map([&table], |row| row.get(0))?.collect())
                .expect("read");
            for column in columns {
                let part = format!("'{column}', NEW.{column}");
                assert!(triggers.iter().all(|trigger| trigger.contains(&part)), "{table}.{column}");
            }
        }
    }

    #[test]
    fn rows_of_a_record_from_before_the_outbox_are_in_it_once() {
        let (_directory, mut record) = new_record();
        record.start_run(&NewRun { cell: "bench".into(), ..NewRun::default() }).expect("started");
        // As an older program left it: rows, and no outbox of them.
        let transaction = record.connection.transaction().expect("begun");
        transaction.execute("DELETE FROM outbox", []).expect("emptied");
        send_what_is_there(&transaction).expect("sent");
        transaction.commit().expect("kept");
        let rows = record.outbox_after(0, 100).expect("read");
        assert_eq!(rows.iter().filter(|row| row.kind == "runs").count(), 1);
    }

    #[test]
    fn sent_rows_that_are_old_are_taken_off_but_the_last_and_a_new_identity_brings_everything_back() {
        let (_directory, mut record) = new_record();
        for _ in 0..4 {
            record.start_run(&NewRun { cell: "bench".into(), ..NewRun::default() }).expect("started");
        }
        let numbers = |record: &Record| -> Vec<i64> {
            record.outbox_after(0, 100).expect("read").iter().map(|row| row.sequence).collect()
        };
        assert_eq!(record.trim_outbox(3, 1).expect("trimmed"), 0, "none is a day old");
        record.connection.execute("UPDATE outbox SET made = '2020-01-01T00:00:00.000Z'", []).expect("aged");
        assert_eq!(record.trim_outbox(3, 1).expect("trimmed"), 2);
        assert_eq!(numbers(&record), [3, 4], "the last that was sent stays, and what was not sent");
        record.renew_identity().expect("renewed");
        let runs = record.outbox_after(0, 100).expect("read");
        assert_eq!(runs.iter().filter(|row| row.kind == "runs").count(), 4);
        assert!(
            runs.iter().zip(1..).all(|(row, number)| row.sequence == number),
            "from the beginning, with no gap"
        );
    }

    #[test]
    fn the_identity_stays_until_it_is_renewed_and_no_two_records_share_one() {
        let (directory, mut record) = new_record();
        let first = record.identity().expect("read");
        assert_eq!(first.len(), 32);
        assert_ne!(first, new_record().1.identity().expect("read"));
        assert_eq!(Record::open(directory.path()).expect("opened").identity().expect("read"), first);
        assert_ne!(record.renew_identity().expect("renewed"), first);
    }

    #[test]
    fn a_digest_distinguishes_rows_by_everything_they_say() {
        let row = OutboxRow {
            sequence: 4,
            kind: "runs".into(),
            number: 2,
            made: "2026-01-01T00:00:00.000Z".into(),
            body: "{}".into(),
        };
        let others = [
            OutboxRow { sequence: 5, ..row.clone() },
            OutboxRow { kind: "steps".into(), ..row.clone() },
            OutboxRow { body: "{\"a\":1}".into(), ..row.clone() },
        ];
        assert_eq!(row.digest(), row.clone().digest());
        assert!(others.iter().all(|other| other.digest() != row.digest()));
    }
}
