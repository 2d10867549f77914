//! `check`: the run goes on only if something holds.

use crate::expression::{Expression, Template};
use crate::read_context::{CheckContext, ReadContext};
use crate::yaml::{MapReader, Node};

/// A declared check.
#[derive(Debug, Clone)]
pub struct CheckStep {
    /// What has to hold.
    pub that: Expression,
    /// What is said when it does not, and what would be right.
    pub otherwise: Template,
}

pub(super) fn read(node: &Node, context: &ReadContext<'_>) -> Option<CheckStep> {
    let mut map = MapReader::new(node, "a check", context.problems)?;
    let that = map.required("that").and_then(|node| context.expression(node, "`that`"));
    let otherwise = map.required("otherwise").and_then(|node| context.template(node, "`otherwise`"));
    map.finish();
    Some(CheckStep { that: that?, otherwise: otherwise? })
}

impl CheckStep {
    pub(super) fn check(&self, context: &CheckContext<'_>) {
        context.check_expression(&self.that);
        context.check_template(&self.otherwise);
    }
}
