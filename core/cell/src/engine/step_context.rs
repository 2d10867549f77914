//! One attempt at one step.

use std::time::{Duration, Instant};

use serde_json::Value;

use super::journal::Attempt;
use super::scope::ScopeId;
use super::step_error::StepError;
use crate::event::{NamedValue, StepPath};

/// What an attempt at a step knows about itself.
#[derive(Debug, Clone)]
pub(crate) struct StepContext {
    pub(crate) path: StepPath,
    pub(crate) title: String,
    pub(crate) answer_name: String,
    pub(crate) scope: ScopeId,
    pub(crate) attempt: Attempt,
    /// What an earlier attempt set out to do.
    pub(crate) intent: Option<Value>,
    pub(crate) deadline: Option<Instant>,
}

/// What a step has done.
#[derive(Debug, Clone, Default)]
pub(crate) struct Done {
    /// What later expressions see.
    pub(crate) result: Value,
    /// The same for people.
    pub(crate) values: Vec<NamedValue>,
    /// One sentence.
    pub(crate) message: String,
}

impl StepContext {
    /// The time left before the step's limit.
    ///
    /// # Errors
    /// When there is none.
    pub(crate) fn time_left(&self) -> Result<Duration, StepError> {
        let Some(deadline) = self.deadline else { return Ok(Duration::from_secs(24 * 3600)) };
        let left = deadline.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return Err(StepError::error("its time limit has passed"));
        }
        Ok(left)
    }
}
