//! What makes a kind of step.

use std::any::Any;
use std::sync::Arc;

use super::declaration::Action;
use crate::engine::Engine;
use crate::engine::step_context::{Done, StepContext};
use crate::engine::step_error::StepError;
use crate::read_context::ReadContext;
use plumb_document::Node;

/// A kind of step, as its file implements it.
pub(crate) trait StepKind: Action + Sized {
    /// As files name it.
    const NAME: &'static str;

    /// What it does, in a sentence without its subject: `moves joints of a robot`.
    const SENTENCE: &'static str;

    /// The JSON Schema of its fields. `#/definitions/...` are those of `schema/procedure.json`.
    const SCHEMA: &'static str;

    /// Reads its fields; none where they cannot be read, which is reported.
    fn read(node: &Node, context: &ReadContext<'_>) -> Option<Self>;

    /// Carries it out.
    ///
    /// # Errors
    /// Why it did not come to its end.
    fn execute(&self, engine: &mut Engine, at: &StepContext) -> Result<Done, StepError>;

    /// What a resumed run takes over from a step of this kind that was done before.
    fn take_over(&self, _engine: &mut Engine) {}
}

/// A kind of step in the table of all kinds.
#[derive(Debug)]
pub(crate) struct Kind {
    pub(crate) name: &'static str,
    pub(crate) sentence: &'static str,
    pub(crate) schema: &'static str,
    pub(super) read: fn(&Node, &ReadContext<'_>) -> Option<Arc<dyn Action>>,
    pub(crate) execute: fn(&dyn Action, &mut Engine, &StepContext) -> Result<Done, StepError>,
    pub(crate) take_over: fn(&dyn Action, &mut Engine),
}

impl Kind {
    /// The entry of a kind.
    pub(super) const fn entry<S: StepKind>() -> Self {
        Self {
            name: S::NAME,
            sentence: S::SENTENCE,
            schema: S::SCHEMA,
            read: read_as::<S>,
            execute: execute_as::<S>,
            take_over: take_over_as::<S>,
        }
    }
}

fn read_as<S: StepKind>(node: &Node, context: &ReadContext<'_>) -> Option<Arc<dyn Action>> {
    Some(Arc::new(S::read(node, context)?))
}

fn execute_as<S: StepKind>(
    action: &dyn Action,
    engine: &mut Engine,
    at: &StepContext,
) -> Result<Done, StepError> {
    match (action as &dyn Any).downcast_ref::<S>() {
        Some(step) => step.execute(engine, at),
        None => {
            Err(StepError::error(format!("step `{}` holds no fields of the kind `{}`", at.path, S::NAME)))
        }
    }
}

fn take_over_as<S: StepKind>(action: &dyn Action, engine: &mut Engine) {
    if let Some(step) = (action as &dyn Any).downcast_ref::<S>() {
        step.take_over(engine);
    }
}
