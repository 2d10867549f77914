//! The tie between an entry of the queue and its run.

use rusqlite::{Transaction, params};

use crate::error::During;
use crate::{RecordError, RunId};

/// Ties an entry to the run that carries it out, in the transaction that begins the run.
pub(crate) fn begin(transaction: &Transaction<'_>, entry: i64, run: RunId) -> Result<(), RecordError> {
    let changed = transaction
        .execute(
            "UPDATE queue SET run = ?2 WHERE id = ?1 AND run IS NULL AND removed IS NULL",
            params![entry, run.0],
        )
        .during("start a run")?;
    if changed == 0 { Err(RecordError::NotWaiting { entry }) } else { Ok(()) }
}
