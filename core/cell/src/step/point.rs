//! A point that a step names by its coordinates.

use plumb_document::Node;

use crate::expression::Expression;
use crate::read_context::ReadContext;

pub(super) fn read_place(node: &Node, what: &str, context: &ReadContext<'_>) -> Option<[Expression; 3]> {
    let items = node.list(what, context.problems)?;
    let [x, y, z] = items else {
        context.problems.add(node.span, format!("{what} has {} numbers", items.len()), "write `[x, y, z]`");
        return None;
    };
    Some([context.expression(x, what)?, context.expression(y, what)?, context.expression(z, what)?])
}
