//! The database's tables and how older ones are brought up to date.

use std::path::Path;

use rusqlite::Connection;

use crate::error::During;
use crate::{RecordError, outbox_triggers};

/// Each entry takes the schema from its index to the next version. Entries are never changed, only added.
const MIGRATIONS: &[&str] = &[
    include_str!("schema.sql"),
    include_str!("schema-2.sql"),
    include_str!("schema-3.sql"),
    include_str!("schema-4.sql"),
    include_str!("schema-5.sql"),
    include_str!("schema-6.sql"),
    include_str!("schema-7.sql"),
];

/// The version from which on there is an outbox.
const WITH_OUTBOX: i64 = 6;

/// The version this program knows.
pub(crate) const KNOWN: i64 = MIGRATIONS.len() as i64;

/// Brings the tables up to the version this program knows.
pub(crate) fn migrate(connection: &mut Connection, path: &Path) -> Result<(), RecordError> {
    let known = KNOWN;
    let before: i64 = connection
        .query_row("PRAGMA user_version", [], |row| row.get(0))
        .during("read its schema version")?;
    if before == known {
        return Ok(());
    }
    let transaction = connection
        .transaction_with_behavior(rusqlite::TransactionBehavior::Immediate)
        .during("look at its schema")?;
    let found: i64 = transaction
        .query_row("PRAGMA user_version", [], |row| row.get(0))
        .during("read its schema version")?;
    if found > known {
        return Err(RecordError::TooNew { path: path.to_owned(), found, known });
    }
    for statements in MIGRATIONS.iter().skip(usize::try_from(found).unwrap_or(0)) {
        transaction.execute_batch(statements).during("bring its tables up to date")?;
    }
    outbox_triggers::make_triggers(&transaction).during("keep its outbox")?;
    if found < WITH_OUTBOX {
        outbox_triggers::send_what_is_there(&transaction).during("fill its outbox")?;
    }
    transaction.pragma_update(None, "user_version", known).during("note its schema version")?;
    transaction.commit().during("bring its tables up to date")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A record as a program of this version left it, with one row to send.
    fn left_by(version: i64) -> Connection {
        let mut connection = Connection::open_in_memory().expect("in memory");
        for statements in MIGRATIONS.iter().take(usize::try_from(version).expect("small")) {
            connection.execute_batch(statements).expect("the tables of then");
        }
        if version >= WITH_OUTBOX {
            let transaction = connection.transaction().expect("begun");
            outbox_triggers::make_triggers(&transaction).expect("the triggers of then");
            transaction.commit().expect("made");
        }
        connection
            .execute(
                "INSERT INTO revisions (cell, device, made, reason) VALUES ('c', 'arm', 'then', 'found')",
                [],
            )
            .expect("a row");
        connection.pragma_update(None, "user_version", version).expect("its version");
        connection
    }

    fn sent(connection: &Connection) -> i64 {
        let count = "SELECT count(*) FROM outbox WHERE kind = 'revisions'";
        connection.query_row(count, [], |row| row.get(0)).expect("counted")
    }

    #[test]
    fn what_is_there_is_sent_once_whichever_version_wrote_it() {
        for version in [1, WITH_OUTBOX - 1, WITH_OUTBOX, KNOWN] {
            let mut connection = left_by(version);
            for _ in 0..2 {
                migrate(&mut connection, Path::new("record")).expect("brought up to date");
                assert_eq!(sent(&connection), 1, "version {version}");
            }
        }
    }

    #[test]
    fn a_record_of_a_newer_program_is_left_alone() {
        let mut connection = left_by(KNOWN);
        connection.pragma_update(None, "user_version", KNOWN + 1).expect("newer");
        let refused = migrate(&mut connection, Path::new("record"));
        assert!(matches!(refused, Err(RecordError::TooNew { found, .. }) if found == KNOWN + 1));
    }
}
