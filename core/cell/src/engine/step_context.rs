//! One attempt at one step.

use std::sync::Arc;
use std::time::{Duration, Instant};

use serde_json::Value;

use super::journal::Attempt;
use super::scope::ScopeId;
use super::step_clock::StepClock;
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
    pub(crate) limit: Option<TimeLimit>,
}

impl StepContext {
    /// Of a question that belongs to no step.
    pub(crate) fn outside(path: &StepPath, answer_name: &str) -> Self {
        Self {
            path: path.clone(),
            title: String::new(),
            answer_name: answer_name.to_owned(),
            scope: 0,
            attempt: Attempt { row: 0, number: 1, started: Instant::now() },
            intent: None,
            limit: None,
        }
    }
}

/// How long an attempt at a step may take.
#[derive(Debug, Clone)]
pub(crate) struct TimeLimit {
    /// So long.
    pub(crate) within: Duration,
    /// When it began by the wall's clock: a person's time goes by that.
    pub(crate) began: Instant,
    /// How long it takes by the cell's clock: a robot's time goes by that.
    pub(crate) clock: Arc<StepClock>,
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
    /// The time left for robots before the step's limit, by the clock of the cell.
    ///
    /// # Errors
    /// When there is none.
    pub(crate) fn time_left(&self) -> Result<Duration, StepError> {
        let Some(limit) = &self.limit else { return Ok(Duration::from_secs(24 * 3600)) };
        let left = limit.within.saturating_sub(limit.clock.elapsed());
        if left.is_zero() {
            let within = limit.within.as_secs_f64();
            return Err(StepError::error(format!(
                "its time limit of {within} s has passed by the cell's clock"
            )));
        }
        Ok(left)
    }

    /// Whether anyone who is asked in it has taken too long to answer.
    pub(crate) fn is_patience_over(&self) -> bool {
        self.limit.as_ref().is_some_and(|limit| limit.began.elapsed() >= limit.within)
    }
}
