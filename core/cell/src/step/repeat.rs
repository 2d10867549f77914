//! `repeat`: steps done several times.

use super::{Step, read_steps};
use crate::expression::Expression;
use crate::read_context::ReadContext;
use crate::yaml::{MapReader, Node};

/// A declared repetition.
#[derive(Debug, Clone)]
pub struct RepeatStep {
    /// How many times, at most; known before the run starts.
    pub times: Expression,
    /// Ends the repetition after a turn in which it holds.
    pub until: Option<Expression>,
    /// What is done each time.
    pub steps: Vec<Step>,
}

pub(super) fn read(node: &Node, context: &ReadContext<'_>) -> Option<RepeatStep> {
    let mut map = MapReader::new(node, "a repetition", context.problems)?;
    let times = map.required("times").and_then(|node| context.expression(node, "`times`"));
    let until = map.optional("until").and_then(|node| context.expression(node, "`until`"));
    let steps = map.required("steps").and_then(|node| read_steps(node, context));
    map.finish();
    Some(RepeatStep { times: times?, until, steps: steps? })
}
