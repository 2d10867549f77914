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
