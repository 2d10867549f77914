//! `move`: joints of a robot go somewhere, all starting and ending together.

use nalgebra::{IsometryMatrix3, Vector3};
use plumb_document::{MapReader, Node, Span, did_you_mean};
use plumb_plugin::JointVector;
use serde_json::json;

use super::beyond::{joint_beyond_limits, known_range, limits_passed};
use super::declaration::{Action, MovedJoints};
use super::joint_targets::{JointTarget, JointTargets, read_pair};
use super::kind::{Kind, StepKind};
use super::motions::{MotionContext, PlannedMotion};
use super::point::{known_attitude, known_position, position_in_words, read_position};
use super::time::{Foreseen, TimeContext};
use crate::cell_names::CellNames;
use crate::check_context::CheckContext;
use crate::engine::Engine;
use crate::engine::arm::RequestedPoint;
use crate::engine::flange::flange_at;
use crate::engine::motion::joint_vector;
use crate::engine::scope::joints_value;
use crate::engine::step_context::{Done, StepContext};
use crate::engine::step_error::StepError;
use crate::event::NamedValue;
use crate::expression::{Expression, Shape};
use crate::in_words::with_decimals;
use crate::read_context::ReadContext;

/// A declared move.
#[derive(Debug, Clone)]
pub(crate) struct MoveStep {
    /// Which robot.
    pub(crate) robot: String,
    /// Where its name is written.
    pub(crate) robot_span: Span,
    /// The joints that move; the others stay.
    pub(crate) targets: JointTargets,
    /// The targets are added to where the joints are.
    pub(crate) relative: bool,
    /// Where the model's point goes, by which joints; nothing for a move that names all its targets.
    pub(crate) point: Option<PointTarget>,
    /// Where the hand goes, by all joints.
    pub(crate) hand: Option<Box<HandTarget>>,
    /// Part of the full speed of the slowest joint, above 0, at most 1.
    pub(crate) speed: f64,
}

/// A position for the model's point, and the joints that bring it there.
#[derive(Debug, Clone)]
pub(crate) struct PointTarget {
    /// Its coordinates in the model's frame of measurements, mm.
    pub(crate) xyz: [Expression; 3],
    /// Which of the model's targets, and where its name is written; the first where none is named.
    pub(crate) target: Option<(String, Span)>,
    /// What the hand carries, kg; nothing where it is not said.
    pub(crate) payload: Option<Expression>,
    /// The joints, and where their names are written.
    pub(crate) by: Vec<(String, Span)>,
}

/// A position and an attitude for the hand, as a scan has them.
#[derive(Debug, Clone)]
pub(crate) struct HandTarget {
    /// Where the aim goes, mm in the robot's base frame.
    pub(crate) at: [Expression; 3],
    /// The point of the flange's frame that is brought there, mm.
    pub(crate) aim_mm: [f64; 3],
    /// How far the flange's axis is tilted from straight down, deg.
    pub(crate) tilt: Option<Expression>,
    /// The direction, about the vertical from the base's x, in which the flange then is, deg.
    pub(crate) azimuth: Option<Expression>,
    /// How far the flange is turned about its own axis, deg.
    pub(crate) turn: Option<Expression>,
}

impl HandTarget {
    /// Where the flange goes, as far as that is known before the run.
    fn flange(&self, context: &TimeContext<'_>) -> Option<IsometryMatrix3<f64>> {
        let position = known_position(&self.at, context)?;
        let attitude = known_attitude([&self.tilt, &self.azimuth, &self.turn], context)?;
        Some(flange_at(position, attitude, Vector3::from(self.aim_mm)))
    }
}

fn read(node: &Node, context: &ReadContext<'_>) -> Option<MoveStep> {
    let mut map = MapReader::new(node, "a move", context.problems)?;
    let robot = context.required_text(&mut map, "robot");
    let to = read_pair(&mut map, "to_deg", "to_mm", context);
    let by = read_pair(&mut map, "by_deg", "by_mm", context);
    let point = map.optional("to_point").and_then(|node| read_point(node, context));
    let hand = map.optional("to_hand").and_then(|node| read_hand(node, context)).map(Box::new);
    let speed = context.number_or(&mut map, "speed", (0.001, 1.0), 0.5);
    let span = map.span();
    let before = context.problems.len();
    map.finish();
    // Under a key that is reported joints may be meant.
    let all_keys_known = context.problems.len() == before;
    let (robot, robot_span) = robot?;
    let relative = to.is_empty();
    if !to.is_empty() && !by.is_empty() {
        context.problems.add(span, "a move goes either to angles or by angles", "keep `to_...` or `by_...`");
    }
    let targets = if relative { by } else { to };
    if point.is_some() && relative && !targets.is_empty() {
        context.problems.add(
            span,
            "a point is gone to, not by",
            "give the other joints under `to_deg` or `to_mm`",
        );
    }
    if hand.is_some() && (point.is_some() || !targets.is_empty()) {
        context.problems.add(
            span,
            "a hand that is brought somewhere takes all joints",
            "keep `to_hand` alone",
        );
    }
    if targets.is_empty() && point.is_none() && hand.is_none() {
        let help =
            "give `to_deg`, `by_deg`, `to_mm` or `by_mm` with joints under it, as in `by_deg: {waist: 5}`";
        if all_keys_known {
            context.problems.add(span, "this move names no joint", help);
        }
        return None;
    }
    Some(MoveStep { robot, robot_span, targets, relative, point, hand, speed })
}

fn read_hand(node: &Node, context: &ReadContext<'_>) -> Option<HandTarget> {
    let mut map = MapReader::new(node, "`to_hand`", context.problems)?;
    let at = map.required("at_mm").and_then(|node| read_position(node, "`at_mm`", context));
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
        .and_then(|node| Some((node.text("`target`", context.problems)?.to_owned(), node.span)));
    let payload = map.optional("payload_kg").and_then(|node| context.expression(node, "`payload_kg`"));
    let by = map.required("by").and_then(|node| node.list("`by`", context.problems));
    map.finish();
    let names =
        by?.iter().filter_map(|node| Some((node.text("a joint", context.problems)?.to_owned(), node.span)));
    let by: Vec<(String, Span)> = names.collect();
    if by.len() != 3 {
        let help = "name the three joints that bring it there, as in `by: [waist, shoulder, elbow]`";
        context.problems.add(node.span, "a point has three coordinates", help);
    }
    let [x, y, z] = xyz;
    Some(PointTarget { xyz: [x?, y?, z?], target, payload, by })
}

/// Other starts for each of the joints that bring a point somewhere, as shares of its range.
const STARTS: [f64; 3] = [0.2, 0.5, 0.8];

/// The joints at every mixture of these shares.
fn other_starts(by: &[&str], ranges: &[(f64, f64)]) -> Vec<Vec<(String, Option<f64>)>> {
    by.iter().zip(ranges).fold(vec![Vec::new()], |starts, (joint, (least, most))| {
        let at = |fraction: f64| ((*joint).to_owned(), Some(least + fraction * (most - least)));
        let with = |start: &Vec<_>| STARTS.map(|fraction| [start.clone(), vec![at(fraction)]].concat());
        starts.iter().flat_map(with).collect()
    })
}

impl MoveStep {
    /// Where joints would go, rad or mm; None for a position that is not known before the run.
    fn goals(&self, context: &TimeContext<'_>) -> Vec<(String, Option<f64>)> {
        let Some(robot) = context.robot(&self.robot) else { return Vec::new() };
        if let Some(hand) = &self.hand {
            let found = hand.flange(context).and_then(|flange| robot.joints_for(&flange));
            let own = |(joint, goal): (&str, Option<f64>)| (joint.to_owned(), goal);
            return match &found {
                Some(positions) => robot.named(positions).map(own).collect(),
                None => robot.anywhere().map(own).collect(),
            };
        }
        let goal = |target: &JointTarget| {
            let value = context.known(&target.value).map(|value| target.unit.to_internal(value));
            let goal = match self.relative {
                true => robot.position(&target.joint).zip(value).map(|(here, way)| here + way),
                false => value,
            };
            (target.joint.clone(), goal)
        };
        let goals: Vec<(String, Option<f64>)> = self.targets.iter().map(goal).collect();
        let Some(point) = &self.point else { return goals };
        let by: Vec<&str> = point.by.iter().map(|(joint, _)| joint.as_str()).collect();
        let target = point.target.as_ref().map(|(name, _)| name.as_str());
        let found = known_position(&point.xyz, context)
            .and_then(|position| robot.joints_for_tip((position, target), &by, &goals));
        let there = |joint: &&str| {
            let found = found.as_ref().map(|found| robot.named(found));
            ((*joint).to_owned(), found.and_then(|mut found| found.find(|(name, _)| name == joint)?.1))
        };
        goals.iter().cloned().chain(by.iter().map(there)).collect()
    }

    /// The limits that a position known before the run lies beyond, in words.
    fn beyond(&self, target: &JointTarget, context: &MotionContext<'_>) -> Option<String> {
        let position = context.time.known(&target.value).filter(|_| !self.relative)?;
        let position = target.unit.to_internal(position);
        limits_passed((&self.robot, &target.joint), position, target.unit, context)
    }

    /// Which joint would be beyond its limits where the hand is brought to its position; none where nobody knows from where it starts.
    fn hand_beyond(&self, hand: &HandTarget, context: &MotionContext<'_>) -> Option<String> {
        let robot = context.time.robot(&self.robot)?;
        let positions = robot.joints_for(&hand.flange(context.time)?)?;
        joint_beyond_limits(robot, &positions, context)
    }

    /// Which joint would be beyond its limits where the point is brought to its position, whichever way; none where one way keeps them, as the run looks for
    /// it, or nobody knows.
    fn point_beyond(&self, point: &PointTarget, context: &MotionContext<'_>) -> Option<String> {
        let robot = context.time.robot(&self.robot)?;
        let xyz_mm = known_position(&point.xyz, context.time)?;
        let target = point.target.as_ref().map(|(name, _)| name.as_str());
        let by: Vec<&str> = point.by.iter().map(|(joint, _)| joint.as_str()).collect();
        let others = self.goals(context.time);
        let others: Vec<_> = others.into_iter().filter(|(joint, _)| !by.contains(&joint.as_str())).collect();
        let found = robot.joints_for_tip((xyz_mm, target), &by, &others)?;
        let beyond = joint_beyond_limits(robot, &found, context)?;
        let ranges = by.iter().map(|joint| known_range((&self.robot, joint), context));
        let keeps = |start: Vec<(String, Option<f64>)>| {
            let start = [others.clone(), start].concat();
            let found = robot.joints_for_tip((xyz_mm, target), &by, &start);
            found.is_some_and(|found| joint_beyond_limits(robot, &found, context).is_none())
        };
        (!other_starts(&by, &ranges.collect::<Option<Vec<_>>>()?).into_iter().any(keeps)).then_some(beyond)
    }
}

impl Action for MoveStep {
    fn check(&self, context: &CheckContext<'_>) {
        let robot = context.robot(&self.robot, self.robot_span);
        if let Some(point) = &self.point {
            point
                .xyz
                .iter()
                .chain(&point.payload)
                .for_each(|expression| context.check_expression(expression));
            if let (Some(robot), Some((target, span))) = (robot, &point.target)
                && !robot.targets.contains(target)
            {
                let help = did_you_mean(target, robot.targets.iter().map(String::as_str));
                context.problems.add(
                    *span,
                    format!("the model of {} has no target `{target}`", robot.name),
                    help,
                );
            }
            for (joint, span) in &point.by {
                if let Some(robot) = robot {
                    context.joint(robot, joint, *span);
                }
                if let Some(named) = self.targets.iter().find(|target| target.joint == *joint) {
                    let help = "either the point says where it goes, or a number";
                    context.problems.add(named.span, format!("joint `{joint}` has two goals"), help);
                }
            }
        }
        if let Some(hand) = &self.hand {
            let angles = hand.tilt.iter().chain(&hand.azimuth).chain(&hand.turn);
            hand.at.iter().chain(angles).for_each(|expression| context.check_expression(expression));
        }
        for target in &self.targets {
            target.check(robot, context);
            if !self.relative {
                target.check_limits(robot, context);
            }
        }
    }

    fn result_shape(&self, cell: &CellNames) -> Shape {
        Shape::Map(vec![("joints".to_owned(), cell.joints_shape(&self.robot))])
    }

    fn estimated_time_s(&self, context: &TimeContext<'_>) -> Option<f64> {
        let robot = context.robot(&self.robot)?;
        let goals = self.goals(context);
        let by = self.targets.iter().filter(|_| self.relative).filter_map(|target| {
            // A way is known where no position is.
            let way = target.unit.to_internal(context.known(&target.value)?).abs();
            robot.position(&target.joint).is_none().then(|| way / robot.full_speed(&target.joint))
        });
        let positions = goals.iter().map(|(joint, goal)| (joint.as_str(), *goal));
        let known = positions.filter(|(joint, _)| !self.relative || robot.position(joint).is_some());
        Some(robot.command_s() + by.fold(robot.way_s(known), f64::max) / self.speed)
    }

    fn foreseen(&self, context: &TimeContext<'_>) -> Foreseen {
        let goals = self.goals(context).into_iter();
        Foreseen {
            result: None,
            joints: goals.map(|(joint, goal)| (self.robot.clone(), joint, goal)).collect(),
        }
    }

    fn moved_robots(&self) -> Vec<String> {
        vec![self.robot.clone()]
    }

    fn planned_motions(&self, context: &MotionContext<'_>) -> Vec<PlannedMotion> {
        let way = if self.relative { "by" } else { "to" };
        let motion = |target: &JointTarget| PlannedMotion {
            robot: self.robot.clone(),
            joint: Some(target.joint.clone()),
            how: format!("{way} {}", context.amount(&target.value, target.unit)),
            speed: self.speed,
            limits: (context.limits)(&self.robot, &target.joint),
            beyond: self.beyond(target, context),
        };
        let together = |how: String, beyond: Option<String>| PlannedMotion {
            robot: self.robot.clone(),
            joint: None,
            how,
            speed: self.speed,
            limits: "its joints' limits".to_owned(),
            beyond,
        };
        let hand = self.hand.iter().map(|hand| {
            let how = format!("'s hand to {}", position_in_words(&hand.at, context.time));
            together(how, self.hand_beyond(hand, context))
        });
        let point = self.point.iter().map(|point| {
            let how = format!("'s tip to {}", position_in_words(&point.xyz, context.time));
            together(how, self.point_beyond(point, context))
        });
        self.targets.iter().map(motion).chain(hand).chain(point).collect()
    }

    fn moved_joints(&self, robot: &str) -> MovedJoints {
        if self.robot != robot {
            return MovedJoints::None;
        }
        // A hand or a point is brought somewhere by all joints.
        if self.hand.is_some() || self.point.is_some() {
            return MovedJoints::All;
        }
        MovedJoints::Named(self.targets.iter().map(|target| target.joint.clone()).collect())
    }
}

pub(super) const KIND: Kind = Kind::entry::<MoveStep>();

impl StepKind for MoveStep {
    const NAME: &'static str = "move";
    const SENTENCE: &'static str = "moves joints of a robot, to angles or by angles";
    const SCHEMA: &'static str = r##"{
  "type": "object",
  "additionalProperties": false,
  "required": ["robot"],
  "properties": {
    "robot": {"$ref": "#/definitions/text"},
    "to_deg": {"$ref": "#/definitions/joint_numbers"},
    "to_mm": {"$ref": "#/definitions/joint_numbers"},
    "by_deg": {"$ref": "#/definitions/joint_numbers"},
    "by_mm": {"$ref": "#/definitions/joint_numbers"},
    "to_point": {
      "description": "Where the model's point goes, in the model's frame of measurements, and the three joints that bring it there.",
      "type": "object",
      "additionalProperties": false,
      "required": ["x_mm", "y_mm", "z_mm", "by"],
      "properties": {
        "x_mm": {"$ref": "#/definitions/expression"},
        "y_mm": {"$ref": "#/definitions/expression"},
        "z_mm": {"$ref": "#/definitions/expression"},
        "target": {"description": "Which of the model's targets; the first unless given.", "$ref": "#/definitions/text"},
        "payload_kg": {"description": "What the hand carries, kg; nothing unless given.", "$ref": "#/definitions/expression"},
        "by": {"type": "array", "items": {"$ref": "#/definitions/text"}, "minItems": 3, "maxItems": 3}
      }
    },
    "to_hand": {
      "description": "Where a point of the hand's frame goes, mm in the robot's base frame, the hand looking straight down unless tilted and turned.",
      "type": "object",
      "additionalProperties": false,
      "required": ["at_mm", "aim_mm"],
      "properties": {
        "at_mm": {"type": "array", "items": {"$ref": "#/definitions/expression"}, "minItems": 3, "maxItems": 3},
        "aim_mm": {"description": "The point in the hand's frame that is brought there.", "type": "array", "items": {"type": "number"}, "minItems": 3, "maxItems": 3},
        "tilt_deg": {"$ref": "#/definitions/expression"},
        "azimuth_deg": {"$ref": "#/definitions/expression"},
        "turn_deg": {"$ref": "#/definitions/expression"}
      }
    },
    "speed": {"$ref": "#/definitions/speed"}
  },
  "anyOf": [{"required": ["to_hand"]}, {"required": ["to_point"]}, {"required": ["to_deg"]}, {"required": ["to_mm"]}, {"required": ["by_deg"]}, {"required": ["by_mm"]}]
}"##;

    fn read(node: &Node, context: &ReadContext<'_>) -> Option<Self> {
        read(node, context)
    }

    fn execute(&self, engine: &mut Engine, at: &StepContext) -> Result<Done, StepError> {
        engine.execute_move(self, at)
    }
}

impl Engine {
    fn execute_move(&mut self, step: &MoveStep, at: &StepContext) -> Result<Done, StepError> {
        let start = self.read_pose(&step.robot)?.joints;
        // Begun again after an interruption, a relative move still ends where it was to end at first.
        let earlier = at.intent.as_ref().and_then(|intent| joint_vector(intent.get("target")?));
        let target = match earlier {
            Some(target) => target,
            None => self.move_target(step, at, &start)?,
        };
        self.arm(&step.robot)?
            .check_move(&start, &target)
            .map_err(|reason| StepError::error(reason.to_string()))?;
        self.journal
            .record
            .note_intent(at.attempt.row, &json!({"robot": step.robot, "target": target.as_slice()}))?;
        let end = self.move_arm(&step.robot, &start, &target, step.speed, at)?;
        let joints = self.arm(&step.robot)?.named(&end);
        let by_point = |name: &String| {
            step.point.as_ref().is_some_and(|point| point.by.iter().any(|(joint, _)| joint == name))
        };
        let moved = |joint: &NamedValue| {
            step.hand.is_some()
                || by_point(&joint.name)
                || step.targets.iter().any(|target| target.joint == joint.name)
        };
        let values: Vec<NamedValue> = joints.iter().filter(|joint| moved(joint)).cloned().collect();
        let positions = values
            .iter()
            .map(|value| format!("{} at {} {}", value.name, with_decimals(value.value, 3), value.unit));
        let message = positions.collect::<Vec<_>>().join(", ");
        Ok(Done { result: json!({"joints": joints_value(&joints)}), values, message })
    }

    fn move_target(
        &mut self,
        step: &MoveStep,
        at: &StepContext,
        start: &JointVector,
    ) -> Result<JointVector, StepError> {
        let mut target = *start;
        for joint in &step.targets {
            let value = joint.unit.to_internal(self.number(at.scope, &joint.value)?);
            let arm = self.arm(&step.robot)?;
            let index = arm.joint(&joint.joint)?;
            let goal = if step.relative { index.value(start)? + value } else { value - arm.zero(index) };
            index.set(&mut target, goal)?;
        }
        if let Some(hand) = &step.hand {
            let attitude = self.attitude([&hand.tilt, &hand.azimuth, &hand.turn], at)?;
            let requested = flange_at(self.position(&hand.at, at)?, attitude, Vector3::from(hand.aim_mm));
            target = self.arm(&step.robot)?.joints_for(&requested, start).map_err(StepError::error)?;
        }
        if let Some(point) = &step.point {
            target = self.point_target(step, point, at, start, &target)?;
        }
        Ok(target)
    }

    /// Where the drive has to go for the model's point to come where it is wanted, the other joints going where they are sent. The way there
    /// decides from which side each joint arrives.
    fn point_target(
        &mut self,
        step: &MoveStep,
        point: &PointTarget,
        at: &StepContext,
        start: &JointVector,
        others: &JointVector,
    ) -> Result<JointVector, StepError> {
        let mut requested = [0.0; 3];
        for (value, expression) in requested.iter_mut().zip(&point.xyz) {
            *value = self.number(at.scope, expression)?;
        }
        let payload_kg = match &point.payload {
            Some(payload) => self.number(at.scope, payload)?,
            None => 0.0,
        };
        let arm = self.arm(&step.robot)?;
        let by = point.by.iter().map(|(joint, _)| arm.joint(joint)).collect::<Result<Vec<_>, _>>()?;
        let target = point.target.as_ref().map(|(name, _)| name.as_str());
        let requested = RequestedPoint { xyz_mm: requested, target, by: &by, payload_kg };
        arm.joints_for_point(&requested, start, others).map_err(StepError::error)
    }
}

#[cfg(test)]
mod tests {
    use super::other_starts;

    #[test]
    fn a_point_is_looked_for_from_every_mixture_of_a_fifth_a_half_and_four_fifths_of_each_range() {
        let starts = other_starts(&["waist", "elbow"], &[(0.0, 10.0), (-2.0, -1.0)]);
        let numbers: Vec<[f64; 2]> = starts
            .iter()
            .map(|start| match &start[..] {
                [(waist, Some(first)), (elbow, Some(second))] if waist == "waist" && elbow == "elbow" => {
                    [*first, *second]
                }
                other => panic!("{other:?}"),
            })
            .collect();
        let expected = [2.0, 5.0, 8.0].map(|first| [-1.8, -1.5, -1.2].map(|second| [first, second]));
        assert_eq!(numbers.len(), 9);
        for (found, expected) in numbers.iter().flatten().zip(expected.iter().flatten().flatten()) {
            assert!((found - expected).abs() < 1e-12, "{numbers:?}");
        }
    }
}
