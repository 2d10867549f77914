//! `move`: joints of a robot go somewhere, all starting and ending together.

use super::joint_targets::{JointTargets, read_pair};
use super::scan::read_place;
use crate::expression::Expression;
use crate::read_context::{CheckContext, ReadContext};
use crate::yaml::{MapReader, Node, Place, did_you_mean};

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
    /// Where the model's point goes, by which joints; nothing for a move that names all its targets.
    pub point: Option<PointTarget>,
    /// Where the hand goes, by all joints.
    pub hand: Option<Box<HandTarget>>,
    /// Part of the full speed of the slowest joint, above 0, at most 1.
    pub speed: f64,
}

/// A place for the model's point, and the joints that bring it there.
#[derive(Debug, Clone)]
pub struct PointTarget {
    /// Its coordinates in the model's frame of measurements, mm.
    pub xyz: [Expression; 3],
    /// Which of the model's targets, and where its name stands; the first where none is named.
    pub target: Option<(String, Place)>,
    /// What the hand carries, kg; nothing where it is not said.
    pub payload: Option<Expression>,
    /// The joints, and where their names stand.
    pub by: Vec<(String, Place)>,
}

/// A place and an attitude for the hand, as a scan has them.
#[derive(Debug, Clone)]
pub struct HandTarget {
    /// Where the aim goes, mm in the robot's base frame.
    pub at: [Expression; 3],
    /// The point of the flange's frame that is brought there, mm.
    pub aim_mm: [f64; 3],
    /// How far the flange's axis is tilted from straight down, deg.
    pub tilt: Option<Expression>,
    /// The direction, about the vertical from the base's x, in which the flange then stands, deg.
    pub azimuth: Option<Expression>,
    /// How far the flange is turned about its own axis, deg.
    pub turn: Option<Expression>,
}

pub(super) fn read(node: &Node, context: &ReadContext<'_>) -> Option<MoveStep> {
    let mut map = MapReader::new(node, "a move", context.problems)?;
    let robot = context.required_text(&mut map, "robot");
    let to = read_pair(&mut map, "to_deg", "to_mm", context);
    let by = read_pair(&mut map, "by_deg", "by_mm", context);
    let point = map.optional("to_point").and_then(|node| read_point(node, context));
    let hand = map.optional("to_hand").and_then(|node| read_hand(node, context)).map(Box::new);
    let speed = context.number_or(&mut map, "speed", (0.001, 1.0), 0.5);
    let place = map.place();
    map.finish();
    let (robot, robot_place) = robot?;
    let relative = to.is_empty();
    if !to.is_empty() && !by.is_empty() {
        context.problems.add(place, "a move goes either to angles or by angles", "keep `to_...` or `by_...`");
    }
    let targets = if relative { by } else { to };
    if point.is_some() && relative && !targets.is_empty() {
        context.problems.add(
            place,
            "a point is gone to, not by",
            "give the other joints under `to_deg` or `to_mm`",
        );
    }
    if hand.is_some() && (point.is_some() || !targets.is_empty()) {
        context.problems.add(
            place,
            "a hand that is brought somewhere takes all joints",
            "keep `to_hand` alone",
        );
    }
    if targets.is_empty() && point.is_none() && hand.is_none() {
        let help =
            "give `to_deg`, `by_deg`, `to_mm` or `by_mm` with joints under it, as in `by_deg: {waist: 5}`";
        context.problems.add(place, "this move names no joint", help);
        return None;
    }
    Some(MoveStep { robot, robot_place, targets, relative, point, hand, speed })
}

fn read_hand(node: &Node, context: &ReadContext<'_>) -> Option<HandTarget> {
    let mut map = MapReader::new(node, "`to_hand`", context.problems)?;
    let at = map.required("at_mm").and_then(|node| read_place(node, "`at_mm`", context));
    let aim_mm = map.required("aim_mm").and_then(|node| node.numbers("`aim_mm`", context.problems));
    let mut angle =
        |key: &'static str| map.optional(key).and_then(|node| context.expression(node, &format!("`{key}`")));
    let (tilt, azimuth, turn) = (angle("tilt_deg"), angle("azimuth_deg"), angle("turn_deg"));
    map.finish();
    Some(HandTarget { at: at?, aim_mm: aim_mm?, tilt, azimuth, turn })
}

fn read_point(node: &Node, context: &ReadContext<'_>) -> Option<PointTarget> {
    let mut map = MapReader::new(node, "`to_point`", context.problems)?;
    let mut coordinate = |key: &'static str| map.required(key).and_then(|node| context.expression(node, key));
    let xyz = [coordinate("x_mm"), coordinate("y_mm"), coordinate("z_mm")];
    let target = map
        .optional("target")
        .and_then(|node| Some((node.text("`target`", context.problems)?.to_owned(), node.place)));
    let payload = map.optional("payload_kg").and_then(|node| context.expression(node, "`payload_kg`"));
    let by = map.required("by").and_then(|node| node.list("`by`", context.problems));
    map.finish();
    let names =
        by?.iter().filter_map(|node| Some((node.text("a joint", context.problems)?.to_owned(), node.place)));
    let by: Vec<(String, Place)> = names.collect();
    if by.len() != 3 {
        let help = "name the three joints that bring it there, as in `by: [waist, shoulder, elbow]`";
        context.problems.add(node.place, "a point has three coordinates", help);
    }
    let [x, y, z] = xyz;
    Some(PointTarget { xyz: [x?, y?, z?], target, payload, by })
}

impl MoveStep {
    pub(super) fn check(&self, context: &CheckContext<'_>) {
        let robot = context.robot(&self.robot, self.robot_place);
        if let Some(point) = &self.point {
            point
                .xyz
                .iter()
                .chain(&point.payload)
                .for_each(|expression| context.check_expression(expression));
            if let (Some(robot), Some((target, place))) = (robot, &point.target)
                && !robot.targets.contains(target)
            {
                let help = did_you_mean(target, robot.targets.iter().map(String::as_str));
                context.problems.add(
                    *place,
                    format!("the model of {} has no target `{target}`", robot.name),
                    help,
                );
            }
            for (joint, place) in &point.by {
                if let Some(robot) = robot {
                    context.joint(robot, joint, *place);
                }
                if let Some(named) = self.targets.iter().find(|target| target.joint == *joint) {
                    let help = "either the point says where it goes, or a number";
                    context.problems.add(named.place, format!("joint `{joint}` has two goals"), help);
                }
            }
        }
        if let Some(hand) = &self.hand {
            let angles = hand.tilt.iter().chain(&hand.azimuth).chain(&hand.turn);
            hand.at.iter().chain(angles).for_each(|expression| context.check_expression(expression));
        }
        for target in &self.targets {
            target.check(robot, context);
        }
    }
}
