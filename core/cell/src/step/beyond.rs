//! Positions that a robot cannot take because a joint would be beyond its limits, as far as a plan knows them.

use super::known_robot::KnownRobot;
use super::limits::{beyond_limits, outside};
use super::motions::MotionContext;
use crate::deg_or_mm::DegOrMm;

/// The limits that a position (rad or mm) of a joint lies beyond, in words: those that the cell gives it, else the robot's own.
pub(super) fn limits_passed(
    (robot, joint): (&str, &str),
    position: f64,
    unit: DegOrMm,
    context: &MotionContext<'_>,
) -> Option<String> {
    let of_cell = (context.range)(robot, joint).and_then(|range| beyond_limits(position, range, unit));
    let own = || (context.own_limits)(robot, joint)?.beyond(position, unit);
    of_cell.or_else(own)
}

/// The limits that every position between two bounds (rad or mm) lies beyond, in words: a joint that is to be there cannot.
pub(super) fn limits_between(
    (robot, joint): (&str, &str),
    (least, most): (f64, f64),
    unit: DegOrMm,
    context: &MotionContext<'_>,
) -> Option<String> {
    let own = (context.own_limits)(robot, joint).map(|own| own.with_zero_shift());
    let ranges = (context.range)(robot, joint).into_iter().chain(own);
    let out = { ranges }.find_map(|range| outside(range, (least, most)))?;
    limits_passed((robot, joint), out, unit, context)
}

/// Which joint of a robot that is at these positions (rad or mm, in the order of the cell's list) is beyond its limits, in words; none where all are within, or
/// none are known.
pub(super) fn joint_beyond_limits(
    robot: &KnownRobot<'_>,
    positions: &[f64],
    context: &MotionContext<'_>,
) -> Option<String> {
    robot.named(positions).find_map(|(joint, position)| {
        let (position, unit) = (position?, robot.unit(joint)?);
        let limits = limits_passed((robot.name(), joint), position, unit, context)?;
        let shown = (unit.from_internal(position) * 1e3).round() / 1e3;
        Some(format!("{joint} would be at {shown} {}, beyond its limits: {limits}", unit.symbol()))
    })
}

/// The least and the greatest position of a joint that a plan knows limits of, rad or mm.
pub(super) fn known_range((robot, joint): (&str, &str), context: &MotionContext<'_>) -> Option<(f64, f64)> {
    let own = (context.own_limits)(robot, joint).map(|own| (own.least, own.most));
    (context.range)(robot, joint).or(own)
}
