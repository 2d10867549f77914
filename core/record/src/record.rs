//! The open record.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use rusqlite::Connection;

use crate::error::During as _;
use crate::owner_only::{create_owner_only_directory, create_owner_only_file};
use crate::{RecordError, lock_holders, schema};

/// How long another program that has the record locked is waited for. A writer holds it for milliseconds; a copy of a large record takes
/// seconds.
pub const LONGEST_WAIT: Duration = Duration::from_secs(10);

/// How long between two tries to open a record that is locked.
const BETWEEN_TRIES: Duration = Duration::from_millis(100);

/// An open record. What a writing method wrote outlives the program, however it ends, when the method returns.
///
/// It is with the system then, which writes it to the disk a little later: `kill -9` loses nothing, a power cut may lose the last seconds, never
/// the soundness of the file. What nobody can measure again is waited for until it is on the disk: answers, corrections, and the end of a run.
pub struct Record {
    pub(crate) connection: Connection,
    directory: PathBuf,
}

impl Record {
    /// The file of the record in `directory`. To open a record makes one: who only asks whether there is one looks for this file.
    #[must_use]
    pub fn file_in(directory: &Path) -> PathBuf {
        directory.join("plumb.sqlite3")
    }

    /// Opens the record in `directory`, making both where they are missing.
    ///
    /// Another program that has it locked is waited for, [`LONGEST_WAIT`] at most.
    ///
    /// # Errors
    /// When the directory cannot be made, the database not opened, another program keeps it locked, or a newer program wrote it.
    pub fn open(directory: &Path) -> Result<Self, RecordError> {
        Self::open_within(directory, LONGEST_WAIT)
    }

    fn open_within(directory: &Path, longest_wait: Duration) -> Result<Self, RecordError> {
        create_owner_only_directory(directory)
            .map_err(|cause| RecordError::MakeDirectory { path: directory.to_owned(), cause })?;
        let path = Self::file_in(directory);
        // SQLite gives its log the rights of the database. Where the file cannot be made, SQLite says why.
        let _ = create_owner_only_file(&path);
        let began = Instant::now();
        loop {
            match Self::open_once(directory, &path, longest_wait) {
                // Some locks are reported at once, however long one is willing to wait.
                Err(error) if error.is_locked() && began.elapsed() < longest_wait => {
                    std::thread::sleep(BETWEEN_TRIES);
                }
                Err(error) if error.is_locked() => {
                    let holders = lock_holders::holders_of(&path);
                    return Err(RecordError::Locked { path, waited_s: longest_wait.as_secs(), holders });
                }
                opened => return opened,
            }
        }
    }

    fn open_once(directory: &Path, path: &Path, longest_wait: Duration) -> Result<Self, RecordError> {
        let open = |cause| RecordError::Open { path: path.to_owned(), cause };
        let mut connection = Connection::open(path).map_err(open)?;
        connection.busy_timeout(longest_wait).map_err(open)?;
        connection.pragma_update(None, "journal_mode", "WAL").map_err(open)?;
        connection.pragma_update(None, "synchronous", "NORMAL").map_err(open)?;
        connection.pragma_update(None, "foreign_keys", "ON").map_err(open)?;
        schema::migrate(&mut connection, path)?;
        Ok(Self { connection, directory: directory.to_owned() })
    }

    /// The same error; where another program held the database for too long, with who that is.
    pub(crate) fn with_holders(&self, error: RecordError) -> RecordError {
        if !error.is_locked() {
            return error;
        }
        let path = Self::file_in(&self.directory);
        let holders = lock_holders::holders_of(&path);
        RecordError::Locked { path, waited_s: LONGEST_WAIT.as_secs(), holders }
    }

    /// Writes something and waits until the disk has it, with everything written before: not even a power cut takes it away.
    pub(crate) fn on_the_disk<T>(
        &mut self,
        write: impl FnOnce(&mut Self) -> Result<T, RecordError>,
    ) -> Result<T, RecordError> {
        self.connection.pragma_update(None, "synchronous", "FULL").during("wait for the disk")?;
        let written = write(self);
        self.connection.pragma_update(None, "synchronous", "NORMAL").during("wait for the disk")?;
        written
    }

    /// What SQLite finds wrong with the database; nothing when it is sound.
    ///
    /// # Errors
    /// When the record cannot be read.
    pub fn damage(&self) -> Result<Vec<String>, RecordError> {
        let mut statement = self.connection.prepare("PRAGMA integrity_check").during("check itself")?;
        let rows = statement.query_map([], |row| row.get::<_, String>(0)).during("check itself")?;
        let found: Vec<String> = rows.collect::<Result<_, _>>().during("check itself")?;
        Ok(found.into_iter().filter(|line| line != "ok").collect())
    }

    /// How many runs it holds.
    ///
    /// # Errors
    /// When the record cannot be read.
    pub fn number_of_runs(&self) -> Result<u64, RecordError> {
        let count: i64 = self
            .connection
            .query_row("SELECT count(*) FROM runs", [], |row| row.get(0))
            .during("count the runs")?;
        Ok(count.unsigned_abs())
    }

    /// The directory it lies in.
    pub fn directory(&self) -> &Path {
        &self.directory
    }
}

/// Now by the wall clock, RFC 3339 with milliseconds, UTC.
pub fn timestamp() -> String {
    jiff::Timestamp::now().strftime("%Y-%m-%dT%H:%M:%S%.3fZ").to_string()
}

/// How long ago a time of the record is, s; none where the text is no time. Less than 0 where the clock was put back since.
pub fn seconds_since(time: &str) -> Option<f64> {
    let then: jiff::Timestamp = time.parse().ok()?;
    Some((jiff::Timestamp::now().as_millisecond() - then.as_millisecond()) as f64 / 1000.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn how_long_ago_a_time_is_follows_the_wall_clock_and_what_is_no_time_is_none() {
        assert!((0.0..60.0).contains(&seconds_since(&timestamp()).expect("a time")));
        let ago = seconds_since("2001-09-09T01:46:40.000Z").expect("the billionth second since 1970");
        let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).expect("after 1970");
        assert!((ago + 1e9 - now.as_secs_f64()).abs() < 60.0, "{ago}");
        assert_eq!(seconds_since("yesterday"), None);
    }

    #[test]
    fn a_record_of_a_newer_program_is_refused_with_both_versions() {
        let directory = tempfile::tempdir().expect("a directory");
        let record = Record::open(directory.path()).expect("a new record");
        record.connection.pragma_update(None, "user_version", 99).expect("a newer version");
        drop(record);
        let error = Record::open(directory.path()).err().expect("refused").to_string();
        let known = format!("knows up to {}:", schema::KNOWN);
        assert!(error.contains("schema 99") && error.contains(&known), "{error}");
    }

    #[test]
    fn only_what_nobody_can_measure_again_waits_for_the_disk() {
        const WITH_THE_SYSTEM: i64 = 1;
        const ON_THE_DISK: i64 = 2;
        let synchronous = |record: &Record| -> i64 {
            record.connection.pragma_query_value(None, "synchronous", |row| row.get(0)).expect("answered")
        };
        let directory = tempfile::tempdir().expect("a directory");
        let mut record = Record::open(directory.path()).expect("a new record");
        assert_eq!(synchronous(&record), WITH_THE_SYSTEM);
        let meanwhile = record.on_the_disk(|record| Ok(synchronous(record))).expect("written");
        assert_eq!(meanwhile, ON_THE_DISK);
        assert_eq!(synchronous(&record), WITH_THE_SYSTEM);
    }

    #[test]
    fn a_record_that_another_program_keeps_locked_is_waited_for_and_then_reported_with_who_holds_it() {
        let directory = tempfile::tempdir().expect("a directory");
        drop(Record::open(directory.path()).expect("a new record"));
        let other = Connection::open(directory.path().join("plumb.sqlite3")).expect("opened");
        other.pragma_update(None, "locking_mode", "EXCLUSIVE").expect("answered");
        other
            .execute_batch(
                "BEGIN EXCLUSIVE; INSERT INTO revisions (cell, device, made, reason) VALUES ('', '', '', '')",
            )
            .expect("locked");
        let wait = Duration::from_millis(300);
        let began = Instant::now();
        let error = Record::open_within(directory.path(), wait).err().expect("locked");
        assert!(began.elapsed() >= wait, "it was waited for");
        let text = error.to_string();
        let me = std::process::id().to_string();
        assert!(text.contains("is locked by another program") && text.contains(&me), "{text}");
        drop(other);
        Record::open(directory.path()).expect("free again");
    }

    #[test]
    fn a_record_that_needs_no_new_tables_is_opened_without_writing() {
        let directory = tempfile::tempdir().expect("a directory");
        drop(Record::open(directory.path()).expect("a new record"));
        let other = Connection::open(directory.path().join("plumb.sqlite3")).expect("opened");
        other.execute_batch("BEGIN IMMEDIATE").expect("somebody writes");
        Record::open_within(directory.path(), Duration::from_millis(100))
            .expect("a reader does not wait for a writer");
    }

    #[test]
    fn a_file_that_is_no_database_is_refused_by_name() {
        let directory = tempfile::tempdir().expect("a directory");
        std::fs::write(
            directory.path().join("plumb.sqlite3"),
            "shopping list, quite long enough to be no database at all, \n".repeat(50),
        )
        .expect("a file");
        let error = Record::open(directory.path()).err().expect("refused").to_string();
        assert!(error.contains("plumb.sqlite3") && error.contains("not a database"), "{error}");
    }
}
