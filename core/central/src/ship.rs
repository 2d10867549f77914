//! Sending the outbox of one record.

use std::path::Path;

use plumb_record::{OutboxRow, Record};
use sqlx::{Connection as _, Row as _};

use crate::error::During as _;
use crate::model_effects::effects_of;
use crate::{Central, CentralError};

/// Rows of one transaction. A run writes a few hundred; more rows at once would only make each retry longer.
const BATCH: u32 = 500;

/// What one turn of the shipper did.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shipped {
    /// Rows sent in this turn.
    pub rows: usize,
    /// Number of the last row that the database has now.
    pub up_to: i64,
    /// Rows of the record that it does not have yet.
    pub left: i64,
}

/// Ships one record over one connection.
pub struct Shipper {
    central: Central,
    identity: String,
    /// The last row that the database is known to have.
    up_to: i64,
}

impl Shipper {
    /// Finds out how far the database is with `record`.
    ///
    /// # Errors
    /// [`CentralError::Copied`] where both sides know the last row and it says two things; or one of them cannot be read.
    pub async fn begin(mut central: Central, record: &Record, host: &str) -> Result<Self, CentralError> {
        let identity = record.identity()?;
        central.register(&identity, host, record.directory()).await?;
        let last = sqlx::query(
            "SELECT sequence, sha256 FROM outbox WHERE record = $1 ORDER BY sequence DESC LIMIT 1",
        )
        .bind(&identity)
        .fetch_optional(&mut central.connection)
        .await
        .during("cannot tell how far it is")?;
        let up_to = match last {
            None => 0,
            Some(row) => {
                let (sequence, digest): (i64, String) = (row.get(0), row.get(1));
                let own = record.outbox_row(sequence)?;
                if own.is_none_or(|own| own.digest() != digest) {
                    return Err(CentralError::Copied { sequence });
                }
                sequence
            }
        };
        match record.first_outbox_row()? {
            Some(first) if first > up_to + 1 => Err(CentralError::Trimmed { first }),
            _ => Ok(Self { central, identity, up_to }),
        }
    }

    /// Takes rows off the outbox that the database has and that are older than so many days; how many.
    ///
    /// # Errors
    /// The record cannot be written.
    pub fn trim(&self, record: &mut Record, days: u32) -> Result<usize, CentralError> {
        Ok(record.trim_outbox(self.up_to, days)?)
    }

    /// Sends the next rows, if there are any, and lets the database know that the record is still heard of.
    ///
    /// # Errors
    /// The connection is gone (what was sent in full stays), or [`CentralError::Copied`].
    pub async fn turn(&mut self, record: &Record) -> Result<Shipped, CentralError> {
        let rows = record.outbox_after(self.up_to, BATCH)?;
        if !rows.is_empty() {
            self.central.append(&self.identity, &rows).await?;
        }
        self.up_to = rows.last().map_or(self.up_to, |row| row.sequence);
        let left = record.newest_outbox_row()? - self.up_to;
        Ok(Shipped { rows: rows.len(), up_to: self.up_to, left })
    }

    /// Lets the database know that the record is still heard of.
    ///
    /// # Errors
    /// The connection is gone.
    pub async fn say_alive(&mut self) -> Result<(), CentralError> {
        sqlx::query("UPDATE records SET last_seen = now(), signed_off = NULL WHERE record = $1")
            .bind(&self.identity)
            .execute(&mut self.central.connection)
            .await
            .during("does not answer any more")?;
        Ok(())
    }

    /// Lets the database know that this shipper ends in good order, and that nothing will be heard of the record until it is started again.
    ///
    /// # Errors
    /// The connection is gone.
    pub async fn sign_off(mut self) -> Result<(), CentralError> {
        sqlx::query("UPDATE records SET last_seen = now(), signed_off = now() WHERE record = $1")
            .bind(&self.identity)
            .execute(&mut self.central.connection)
            .await
            .during("does not answer any more")?;
        Ok(())
    }
}

impl Central {
    async fn register(&mut self, identity: &str, host: &str, directory: &Path) -> Result<(), CentralError> {
        sqlx::query(
            "INSERT INTO records (record, host, directory) VALUES ($1, $2, $3) \
             ON CONFLICT (record) DO UPDATE SET host = excluded.host, directory = excluded.directory, last_seen = now(), signed_off = NULL",
        )
        .bind(identity)
        .bind(host)
        .bind(directory.display().to_string())
        .execute(&mut self.connection)
        .await
        .during("cannot take the record in")?;
        Ok(())
    }

    /// Appends rows in one transaction. Rows that are there already stay as they are.
    async fn append(&mut self, identity: &str, rows: &[OutboxRow]) -> Result<(), CentralError> {
        let operation = "cannot take rows in";
        let mut transaction = self.connection.begin().await.during(operation)?;
        let sequences: Vec<i64> = rows.iter().map(|row| row.sequence).collect();
        let digests: Vec<String> = rows.iter().map(OutboxRow::digest).collect();
        let added = sqlx::query(
            "INSERT INTO outbox (record, sequence, kind, number, made, body, sha256) \
             SELECT $1, s, k, n, m::timestamptz, b::jsonb, d \
             FROM unnest($2::bigint[], $3::text[], $4::bigint[], $5::text[], $6::text[], $7::text[]) AS t (s, k, n, m, b, d) \
             ON CONFLICT DO NOTHING",
        )
        .bind(identity)
        .bind(&sequences)
        .bind(rows.iter().map(|row| row.kind.clone()).collect::<Vec<_>>())
        .bind(rows.iter().map(|row| row.number).collect::<Vec<_>>())
        .bind(rows.iter().map(|row| row.made.clone()).collect::<Vec<_>>())
        .bind(rows.iter().map(|row| without_nul(&row.body)).collect::<Vec<_>>())
        .bind(&digests)
        .execute(&mut *transaction)
        .await
        .during(operation)?;
        if added.rows_affected() < rows.len() as u64 {
            // Another shipper of the same record was quicker: then the rows say the same.
            let same: i64 = sqlx::query_scalar(
                "SELECT count(*) FROM outbox o JOIN unnest($2::bigint[], $3::text[]) AS t (s, d) \
                 ON o.sequence = t.s AND o.sha256 = t.d WHERE o.record = $1",
            )
            .bind(identity)
            .bind(&sequences)
            .bind(&digests)
            .fetch_one(&mut *transaction)
            .await
            .during(operation)?;
            if same != rows.len() as i64 {
                return Err(CentralError::Copied { sequence: sequences.first().copied().unwrap_or(0) });
            }
        }
        for row in rows.iter().filter(|row| row.kind == "model_revisions") {
            add_effects(&mut transaction, identity, row).await?;
        }
        transaction.commit().await.during(operation)
    }
}

/// Lists the numbers of the effects of a model revision.
async fn add_effects(
    transaction: &mut sqlx::Transaction<'_, sqlx::Postgres>,
    identity: &str,
    row: &OutboxRow,
) -> Result<(), CentralError> {
    let Ok(body) = serde_json::from_str::<serde_json::Value>(&row.body) else { return Ok(()) };
    let text_of = |key: &str| body.get(key).and_then(serde_json::Value::as_str).unwrap_or_default();
    // When the model was written, which in a record from before the outbox is long before its row was.
    let made = if text_of("made").is_empty() { &row.made } else { text_of("made") };
    for one in effects_of(text_of("content")) {
        sqlx::query(
            "INSERT INTO effects (record, sequence, cell, device, made, effect, place, parameter, value, claim) \
             VALUES ($1, $2, $3, $4, $5::timestamptz, $6, $7, $8, $9, $10) ON CONFLICT DO NOTHING",
        )
        .bind(identity)
        .bind(row.sequence)
        .bind(text_of("cell"))
        .bind(text_of("device"))
        .bind(made)
        .bind(&one.effect)
        .bind(&one.site)
        .bind(&one.parameter)
        .bind(one.value)
        .bind(&one.claim)
        .execute(&mut **transaction)
        .await
        .during("cannot take effects in")?;
    }
    Ok(())
}

/// The body without the character 0, which PostgreSQL's text cannot hold; it is replaced by the sign for an unreadable
/// character.
fn without_nul(body: &str) -> String {
    if !body.contains("\\u0000") {
        return body.to_owned();
    }
    // A backslash that is written out (`\\u0000`) is no character 0, so the text is taken apart properly.
    match serde_json::from_str::<serde_json::Value>(body) {
        Ok(mut value) => {
            replace_nul(&mut value);
            value.to_string()
        }
        Err(_) => body.to_owned(),
    }
}

fn replace_nul(value: &mut serde_json::Value) {
    match value {
        serde_json::Value::String(text) => *text = text.replace('\0', "\u{fffd}"),
        serde_json::Value::Array(items) => items.iter_mut().for_each(replace_nul),
        serde_json::Value::Object(fields) => fields.values_mut().for_each(replace_nul),
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_character_0_becomes_a_mark_and_a_written_out_one_stays() {
        assert_eq!(without_nul(r#"{"a":"x\u0000y"}"#), "{\"a\":\"x\u{fffd}y\"}");
        assert_eq!(without_nul(r#"{"a":"x\\u0000y"}"#), r#"{"a":"x\\u0000y"}"#);
        assert_eq!(without_nul(r#"{"a": 1}"#), r#"{"a": 1}"#);
    }
}
