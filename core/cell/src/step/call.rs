//! `call`: the steps of another procedure.

use crate::expression::Expression;
use crate::read_context::ReadContext;
use crate::yaml::{Key, MapReader, Node, Place};

/// A declared call.
#[derive(Debug, Clone)]
pub struct CallStep {
    /// The procedure's file, relative to the file that calls it.
    pub file: String,
    /// Where it stands.
    pub place: Place,
    /// Parameters other than their defaults; worked out from this procedure's own parameters before the run.
    pub with: Vec<(Key, Expression)>,
}

pub(super) fn read(node: &Node, context: &ReadContext<'_>) -> Option<CallStep> {
    let mut map = MapReader::new(node, "a call", context.problems)?;
    let file = context.required_text(&mut map, "procedure");
    let with = map.optional("with").and_then(|node| node.entries("`with`", context.problems));
    map.finish();
    let (file, place) = file?;
    let mut parameters = Vec::new();
    for (name, node) in with.unwrap_or_default() {
        parameters.push((name.clone(), context.expression(node, &format!("`{}`", name.name))?));
    }
    Some(CallStep { file, place, with: parameters })
}
