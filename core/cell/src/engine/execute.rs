//! Carrying a step out by its kind.

use super::Engine;
use super::step_context::{Done, StepContext};
use super::step_error::StepError;
use crate::step::{Step, kind};

impl Engine {
    /// Carries out a step that has no steps inside.
    pub(crate) fn execute(&mut self, step: &Step, at: &StepContext) -> Result<Done, StepError> {
        match kind(step.kind) {
            Some(kind) => (kind.execute)(&*step.action, self, at),
            None => Err(StepError::error(format!("there is no kind of step `{}`", step.kind))),
        }
    }

    /// Takes over what a step did that was done before the run was interrupted.
    pub(crate) fn take_over_step(&mut self, step: &Step) {
        if let Some(kind) = kind(step.kind) {
            (kind.take_over)(&*step.action, self);
        }
    }
}
