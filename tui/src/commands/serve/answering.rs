//! An answer from the page: checked, offered to the run, and informed what became of it.

use std::path::Path;

use axum::http::StatusCode;
use plumb_cell::prompt::Prompt;
use plumb_record::{Record, RunId, RunState};

use super::state::only_at_the_arm;
use crate::commands::answer::{AnswerError, await_taken, is_alive, read};

/// An answer as the page sends it.
#[derive(Debug, Clone, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct GivenAnswer {
    /// The lease's key.
    pub(super) lease: String,
    /// The run, and the prompt that was seen. An answer to a prompt that is over is not taken for the next one.
    pub(super) run: i64,
    pub(super) prompt: i64,
    /// As one would type it after `plumb answer`.
    pub(super) answer: String,
}

/// Why an answer was not taken, and what HTTP calls that.
pub(super) struct NotTaken {
    pub(super) status: StatusCode,
    pub(super) reason: String,
}

impl NotTaken {
    pub(super) fn new(status: StatusCode, reason: impl ToString) -> Self {
        Self { status, reason: reason.to_string() }
    }
}

/// Offers it in the name of the lease's holder, and waits for what becomes of it.
pub(super) fn give(directory: &Path, given: &GivenAnswer, holder: &str) -> Result<(), NotTaken> {
    let internal = |error: &dyn std::error::Error| NotTaken::new(StatusCode::INTERNAL_SERVER_ERROR, error);
    // Each answer has a connection of its own: the page's is busy reading.
    let mut record = Record::open(directory).map_err(|error| internal(&error))?;
    let offered = offer(&mut record, given, holder);
    if let Err(refusal) = &offered {
        let message = format!("an answer of {holder} from the page was not taken: {}", refusal.reason);
        // The answer was refused in any case; that the refusal is noted as well is tried once.
        let _ = record.note_log(RunId(given.run), "warn", "serve", None, &message);
    }
    offered
}

fn offer(record: &mut Record, given: &GivenAnswer, holder: &str) -> Result<(), NotTaken> {
    let internal = |error: &dyn std::error::Error| NotTaken::new(StatusCode::INTERNAL_SERVER_ERROR, error);
    let conflict = |error: AnswerError| NotTaken::new(StatusCode::CONFLICT, error);
    let run = record.run(RunId(given.run)).map_err(|error| NotTaken::new(StatusCode::NOT_FOUND, error))?;
    if run.state != RunState::Running {
        return Err(conflict(AnswerError::Ended(given.run)));
    }
    if !is_alive(&run) {
        return Err(conflict(AnswerError::Killed(
            given.run,
            plumb_record::record_option(record.directory()),
        )));
    }
    let stored = record.open_prompt(run.run).map_err(|error| internal(&error))?;
    let stored = stored.ok_or_else(|| conflict(AnswerError::NothingAsked(given.run)))?;
    if stored.id != given.prompt {
        let reason = "that prompt is answered already, and another one is open: look at the page again";
        return Err(NotTaken::new(StatusCode::CONFLICT, reason));
    }
    let prompt: Prompt = serde_json::from_value(stored.description).map_err(|error| internal(&error))?;
    if let Some(why) = only_at_the_arm(&prompt.kind) {
        return Err(NotTaken::new(StatusCode::FORBIDDEN, why));
    }
    let meant = read(&given.answer, &prompt).map_err(|right| {
        let wrong =
            AnswerError::WrongKind { given: given.answer.clone(), title: prompt.title.clone(), right };
        NotTaken::new(StatusCode::UNPROCESSABLE_ENTITY, wrong)
    })?;
    let value = serde_json::to_value(&meant).map_err(|error| internal(&error))?;
    let offer = record.offer_answer(prompt.id.0, &value, holder).map_err(|error| internal(&error))?;
    await_taken(record, run.run, &prompt, offer, &meant)
        .map_err(|error| NotTaken::new(StatusCode::CONFLICT, error))
}
