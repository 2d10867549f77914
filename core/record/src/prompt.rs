//! Questions and answers: who answered what, when.

use rusqlite::{Row, params};
use serde::Serialize;
use serde_json::Value;

use crate::error::During;
use crate::record::timestamp;
use crate::run::json_column;
use crate::{Record, RecordError, RunId};

/// A prompt as the record holds it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StoredPrompt {
    /// Its number, unique in the record.
    pub id: i64,
    /// The step that asked.
    pub step: String,
    /// When.
    pub asked: String,
    /// The question, in the asker's own words.
    pub description: Value,
    /// The answer, if one was given.
    pub answer: Option<StoredAnswer>,
    /// When it was withdrawn, if it was.
    pub withdrawn: Option<String>,
}

/// An answer as the record holds it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StoredAnswer {
    /// When it was given.
    pub time: String,
    /// Who gave it.
    pub by: String,
    /// The answer, in the asker's own words.
    pub answer: Value,
}

impl Record {
    /// Notes a question and gives its number. The description is made from the number, so that it can hold it.
    ///
    /// # Errors
    /// When the record cannot be written.
    pub fn ask_prompt(
        &mut self,
        run: RunId,
        step: &str,
        describe: impl FnOnce(i64) -> Value,
    ) -> Result<i64, RecordError> {
        let transaction = self.connection.transaction().during("note a prompt")?;
        transaction
            .execute(
                "INSERT INTO prompts (run, step, asked, description) VALUES (?1, ?2, ?3, 'null')",
                params![run.0, step, timestamp()],
            )
            .during("note a prompt")?;
        let id = transaction.last_insert_rowid();
        transaction
            .execute(
                "UPDATE prompts SET description = ?2 WHERE id = ?1",
                params![id, describe(id).to_string()],
            )
            .during("note a prompt")?;
        transaction.commit().during("note a prompt")?;
        Ok(id)
    }

    /// Notes the answer to a prompt; the first one stays, a later one changes nothing and gives false.
    ///
    /// # Errors
    /// When the record cannot be written.
    pub fn answer_prompt(&mut self, prompt: i64, answer: &Value, by: &str) -> Result<bool, RecordError> {
        self.on_the_disk(|record| {
            let changed = record.connection.execute(
                "UPDATE prompts SET answered = ?2, answer = ?3, answered_by = ?4 \
                 WHERE id = ?1 AND answered IS NULL AND withdrawn IS NULL",
                params![prompt, timestamp(), answer.to_string(), by],
            );
            Ok(changed.during("note an answer")? == 1)
        })
    }

    /// Notes that a prompt needs no answer any more.
    ///
    /// # Errors
    /// When the record cannot be written.
    pub fn withdraw_prompt(&mut self, prompt: i64) -> Result<(), RecordError> {
        self.connection
            .execute(
                "UPDATE prompts SET withdrawn = ?2 WHERE id = ?1 AND answered IS NULL",
                params![prompt, timestamp()],
            )
            .during("withdraw a prompt")?;
        Ok(())
    }

    /// All prompts of a run, in the order they were asked.
    ///
    /// # Errors
    /// When the record cannot be read.
    pub fn prompts(&self, run: RunId) -> Result<Vec<StoredPrompt>, RecordError> {
        let mut statement = self
            .connection
            .prepare(
                "SELECT id, step, asked, description, answered, answer, answered_by, withdrawn FROM prompts \
                 WHERE run = ?1 ORDER BY id",
            )
            .during("read the prompts of a run")?;
        let rows = statement.query_map(params![run.0], prompt).during("read the prompts of a run")?;
        rows.collect::<Result<_, _>>().during("read the prompts of a run")
    }
}

fn prompt(row: &Row<'_>) -> rusqlite::Result<StoredPrompt> {
    let answered: Option<String> = row.get(4)?;
    let answer = match answered {
        None => None,
        Some(time) => Some(StoredAnswer {
            time,
            answer: json_column(row, 5)?,
            by: row.get::<_, Option<String>>(6)?.unwrap_or_default(),
        }),
    };
    Ok(StoredPrompt {
        id: row.get(0)?,
        step: row.get(1)?,
        asked: row.get(2)?,
        description: json_column(row, 3)?,
        answer,
        withdrawn: row.get(7)?,
    })
}
