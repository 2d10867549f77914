//! A point that a step names by its coordinates.

use nalgebra::{Rotation3, Vector3};
use plumb_document::Node;

use super::motions::rounded;
use super::time::TimeContext;
use crate::engine::flange::attitude_of;
use crate::expression::Expression;
use crate::read_context::ReadContext;

pub(super) fn read_position(node: &Node, what: &str, context: &ReadContext<'_>) -> Option<[Expression; 3]> {
    let items = node.list(what, context.problems)?;
    let [x, y, z] = items else {
        context.problems.add(node.span, format!("{what} has {} numbers", items.len()), "write `[x, y, z]`");
        return None;
    };
    Some([context.expression(x, what)?, context.expression(y, what)?, context.expression(z, what)?])
}

/// The point, mm, where it is known before the run.
pub(super) fn known_position([x, y, z]: &[Expression; 3], context: &TimeContext<'_>) -> Option<Vector3<f64>> {
    Some(Vector3::new(context.known(x)?, context.known(y)?, context.known(z)?))
}

/// The flange's attitude by tilt, azimuth and turn, each 0 where it is left out, where they are known before the run.
pub(super) fn known_attitude(
    angles: [&Option<Expression>; 3],
    context: &TimeContext<'_>,
) -> Option<Rotation3<f64>> {
    let known = |angle: &Option<Expression>| match angle {
        None => Some(0.0),
        Some(angle) => context.known(angle).map(f64::to_radians),
    };
    let [tilt, azimuth, turn] = angles;
    Some(attitude_of(known(tilt)?, known(azimuth)?, known(turn)?))
}

/// The point in words, as far as it is known before the run.
pub(super) fn position_in_words(point: &[Expression; 3], context: &TimeContext<'_>) -> String {
    let coordinate = |expression: &Expression| match context.known(expression) {
        Some(number) => rounded(number).to_string(),
        None => format!("`{}`", expression.text()),
    };
    format!("[{}] mm", point.each_ref().map(coordinate).join(", "))
}
