//! `move`: joints of a robot go somewhere, all starting and ending together.

use super::joint_targets::{JointTargets, read_pair};
use crate::read_context::{CheckContext, ReadContext};
use crate::yaml::{MapReader, Node, Place};

/// A declared move.
#[derive(Debug, Clone)]
pub struct MoveStep {
    /// Which robot.
    pub robot: String,
    /// Where its name stands.
    pub robot_place: Place,
    /// The joints that move; the others stay.
    pub targets: JointTargets,
    /// The targets are added to where the joints stand.
    pub relative: bool,
    /// Part of the full speed of the slowest joint, above 0, at most 1.
    pub speed: f64,
}

pub(super) fn read(node: &Node, context: &ReadContext<'_>) -> Option<MoveStep> {
    let mut map = MapReader::new(node, "a move", context.problems)?;
    let robot = context.required_text(&mut map, "robot");
    let to = read_pair(&mut map, "to_deg", "to_mm", context);
    let by = read_pair(&mut map, "by_deg", "by_mm", context);
    let speed = context.number_or(&mut map, "speed", (0.001, 1.0), 0.5);
    let place = map.place();
    map.finish();
    let (robot, robot_place) = robot?;
    let relative = to.is_empty();
    if !to.is_empty() && !by.is_empty() {
        context.problems.add(place, "a move goes either to angles or by angles", "keep `to_...` or `by_...`");
    }
    let targets = if relative { by } else { to };
    if targets.is_empty() {
        let help =
            "give `to_deg`, `by_deg`, `to_mm` or `by_mm` with joints under it, as in `by_deg: {waist: 5}`";
        context.problems.add(place, "this move names no joint", help);
        return None;
    }
    Some(MoveStep { robot, robot_place, targets, relative, speed })
}

impl MoveStep {
    pub(super) fn check(&self, context: &CheckContext<'_>) {
        let robot = context.robot(&self.robot, self.robot_place);
        for target in &self.targets {
            target.check(robot, context);
        }
    }
}
