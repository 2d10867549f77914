//! Answers given from elsewhere: another program offers one here, and the run takes it or says why not.

use rusqlite::{OptionalExtension as _, params};
use serde_json::Value;

use crate::error::During;
use crate::record::timestamp;
use crate::run::json_column;
use crate::{Record, RecordError, RunId, StoredPrompt};

/// An answer somebody offers.
#[derive(Debug, Clone, PartialEq)]
pub struct Offer {
    /// Its number.
    pub id: i64,
    /// Who gives it.
    pub by: String,
    /// The answer, in the asker's own words.
    pub answer: Value,
}

impl Record {
    /// Offers an answer to a prompt; gives the offer's number.
    ///
    /// # Errors
    /// When the record cannot be written.
    pub fn offer_answer(&mut self, prompt: i64, answer: &Value, by: &str) -> Result<i64, RecordError> {
        self.on_the_disk(|record| {
            record
                .connection
                .execute(
                    "INSERT INTO offers (prompt, time, author, answer) VALUES (?1, ?2, ?3, ?4)",
                    params![prompt, timestamp(), by, answer.to_string()],
                )
                .during("offer an answer")?;
            Ok(record.connection.last_insert_rowid())
        })
    }

    /// The oldest answer offered to a prompt that was not refused.
    ///
    /// # Errors
    /// When the record cannot be read.
    pub fn offer_to(&self, prompt: i64) -> Result<Option<Offer>, RecordError> {
        self.connection
            .prepare_cached(
                "SELECT id, author, answer FROM offers WHERE prompt = ?1 AND refused IS NULL ORDER BY id LIMIT 1",
            )
            .and_then(|mut statement| {
                statement
                    .query_row(params![prompt], |row| {
                        Ok(Offer { id: row.get(0)?, by: row.get(1)?, answer: json_column(row, 2)? })
                    })
                    .optional()
            })
            .during("look for answers from elsewhere")
    }

    /// Refuses an offered answer.
    ///
    /// # Errors
    /// When the record cannot be written.
    pub fn refuse_offer(&mut self, offer: i64, reason: &str) -> Result<(), RecordError> {
        self.connection
            .execute("UPDATE offers SET refused = ?2 WHERE id = ?1", params![offer, reason])
            .during("refuse an answer")?;
        Ok(())
    }

    /// Why an offered answer was refused; none when it was not, or not yet.
    ///
    /// # Errors
    /// When the record cannot be read.
    pub fn why_refused(&self, offer: i64) -> Result<Option<String>, RecordError> {
        self.connection
            .query_row("SELECT refused FROM offers WHERE id = ?1", params![offer], |row| row.get(0))
            .during("look what became of an answer")
    }

    /// The prompt of a run that waits for an answer now, if one does.
    ///
    /// # Errors
    /// When the record cannot be read.
    pub fn open_prompt(&self, run: RunId) -> Result<Option<StoredPrompt>, RecordError> {
        let newest = self.prompts(run)?.into_iter().next_back();
        Ok(newest.filter(|prompt| prompt.answer.is_none() && prompt.withdrawn.is_none()))
    }
}
