//! `search`: a guarded move of one joint until a sensor changes.

use plumb_document::{MapReader, Node, Span, did_you_mean};

use super::declaration::{Action, MovedJoints, Searched};
use super::kind::{Kind, StepKind};
use super::motions::{MotionContext, PlannedMotion};
use super::row::CIRCUMSTANCES as COLUMNS;
use super::time::{Foreseen, TimeContext};
use crate::cell_names::CellNames;
use crate::check_context::CheckContext;
use crate::deg_or_mm::DegOrMm;
use crate::engine::Engine;
use crate::engine::step_context::{Done, StepContext};
use crate::engine::step_error::StepError;
use crate::expression::{Expression, Shape};
use crate::read_context::ReadContext;

mod carry_out;

pub(crate) use carry_out::CIRCUMSTANCES;

/// How far a search goes that does not know its travel before the run, rad or mm.
const TYPICAL_TRAVEL: f64 = 0.2;

/// Moves of a search beside those towards what is sought: backing off, and back to where it changed, which may take several.
const MOVES_BETWEEN: f64 = 6.0;

/// A declared search.
#[derive(Debug, Clone)]
pub(crate) struct SearchStep {
    /// Which robot.
    pub(crate) robot: String,
    /// Where its name is written.
    pub(crate) robot_span: Span,
    /// The joint that moves.
    pub(crate) joint: String,
    /// Where its name is written.
    pub(crate) joint_span: Span,
    /// How the search's lengths are written.
    pub(crate) unit: DegOrMm,
    /// How far at most; its sign is the direction.
    pub(crate) travel: Expression,
    /// The sensor that is watched.
    pub(crate) sensor: String,
    /// Where its name is written.
    pub(crate) sensor_span: Span,
    /// The search ends where the sensor comes on, or where it goes off.
    pub(crate) until_on: bool,
    /// The first approach.
    pub(crate) fast: Approach,
    /// The second approach, from the same side.
    pub(crate) slow: Approach,
    /// How far it goes back between the two.
    pub(crate) back_off: f64,
    /// When the sensor is there already at the start: go back by `back_off` until it is not, rather than fail.
    pub(crate) back_off_first: bool,
    /// When the sensor does not change on the whole way: go on, and say so in the result, rather than fail.
    pub(crate) may_find_nothing: bool,
    /// What the sensor is over when it changes, for who fits a model to the trigger poses.
    pub(crate) finds: Option<Finds>,
}

/// What the sensor is over when it changes.
#[derive(Debug, Clone)]
pub(crate) struct Finds {
    /// The surface or line, as the robot's model file calls it.
    pub(crate) surface: String,
    /// Where its name is written.
    pub(crate) span: Span,
    /// How high over it the hand is then, mm.
    pub(crate) height_mm: Option<Expression>,
    /// Under which circumstances, by the model lab's columns: load, temperature, which return to a pose.
    pub(crate) circumstances: Vec<(&'static str, Expression)>,
}

/// How a search approaches.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Approach {
    /// It moves in pieces this long, so that it overshoots by one at most.
    pub(crate) chunk: f64,
    /// Part of the full speed.
    pub(crate) speed: f64,
}

fn read(node: &Node, context: &ReadContext<'_>) -> Option<SearchStep> {
    let mut map = MapReader::new(node, "a search", context.problems)?;
    let robot = context.required_text(&mut map, "robot");
    let joint = context.required_text(&mut map, "joint");
    let until = map.required("until").and_then(|node| read_until(node, context));
    let in_mm = map.optional("travel_mm");
    let unit = if in_mm.is_some() { DegOrMm::Mm } else { DegOrMm::Deg };
    let travel_node = match in_mm {
        Some(node) => Some(node),
        None => map.required("travel_deg"),
    };
    let travel = travel_node.and_then(|node| context.expression(node, "the travel of a search"));
    let fast = read_approach(&mut map, "fast", (1.0, 1.0), unit, context);
    let slow = read_approach(&mut map, "slow", (0.25, 0.2), unit, context);
    let back_off_key = if unit == DegOrMm::Mm { "back_off_mm" } else { "back_off_deg" };
    let back_off = context.number_or(&mut map, back_off_key, (0.001, 90.0), 2.0 * fast.chunk);
    let back_off_first = map
        .optional("already_there")
        .and_then(|node| node.word("way to begin", &["fail", "back_off"], context.problems))
        == Some(1);
    let may_find_nothing = map
        .optional("nothing_found")
        .and_then(|node| node.word("way to end", &["fail", "go_on"], context.problems))
        == Some(1);
    let finds = map.optional("finds").and_then(|node| read_finds(node, context));
    map.finish();
    let (robot, robot_span) = robot?;
    let (joint, joint_span) = joint?;
    let (sensor, sensor_span, until_on) = until?;
    let travel = travel?;
    Some(SearchStep {
        robot,
        robot_span,
        joint,
        joint_span,
        unit,
        travel,
        sensor,
        sensor_span,
        until_on,
        fast,
        slow,
        back_off,
        back_off_first,
        may_find_nothing,
        finds,
    })
}

fn read_until(node: &Node, context: &ReadContext<'_>) -> Option<(String, Span, bool)> {
    let mut map = MapReader::new(node, "`until` of a search", context.problems)?;
    let sensor = context.required_text(&mut map, "sensor");
    let is =
        map.required("is").and_then(|node| node.word("state of a sensor", &["on", "off"], context.problems));
    map.finish();
    let (sensor, span) = sensor?;
    Some((sensor, span, is? == 0))
}

fn read_finds(node: &Node, context: &ReadContext<'_>) -> Option<Finds> {
    let mut map = MapReader::new(node, "`finds`", context.problems)?;
    let surface = context.required_text(&mut map, "on");
    let height_mm = map.optional("height_mm").and_then(|node| context.expression(node, "`height_mm`"));
    let circumstances = COLUMNS.into_iter().filter_map(|column| {
        let value = context.expression(map.optional(column)?, &format!("`{column}`"))?;
        Some((column, value))
    });
    let circumstances = circumstances.collect();
    map.finish();
    let (surface, span) = surface?;
    Some(Finds { surface, span, height_mm, circumstances })
}

fn read_approach(
    map: &mut MapReader<'_>,
    key: &'static str,
    (chunk, speed): (f64, f64),
    unit: DegOrMm,
    context: &ReadContext<'_>,
) -> Approach {
    let default = Approach { chunk, speed };
    let Some(mut map) =
        map.optional(key).and_then(|node| MapReader::new(node, "an approach", context.problems))
    else {
        return default;
    };
    let chunk_key = if unit == DegOrMm::Mm { "chunk_mm" } else { "chunk_deg" };
    let chunk = context.number_or(&mut map, chunk_key, (1e-4, 30.0), default.chunk);
    let speed = context.number_or(&mut map, "speed", (0.001, 1.0), default.speed);
    map.finish();
    Approach { chunk, speed }
}

impl SearchStep {
    /// How far it is to what is sought, rad or mm, with its sign: somewhere on the way, mostly in its first part; the whole way where it need not be
    /// there.
    fn foreseen_way(&self, context: &TimeContext<'_>) -> f64 {
        let travel = context.known(&self.travel).map(|travel| self.unit.to_internal(travel));
        travel.unwrap_or(TYPICAL_TRAVEL) / if self.may_find_nothing { 1.0 } else { 3.0 }
    }
}

impl Action for SearchStep {
    fn check(&self, context: &CheckContext<'_>) {
        context.check_expression(&self.travel);
        if let Some(finds) = &self.finds {
            let circumstances = finds.circumstances.iter().map(|(_, value)| value);
            finds.height_mm.iter().chain(circumstances).for_each(|value| context.check_expression(value));
        }
        context.sensor(&self.sensor, self.sensor_span);
        let Some(robot) = context.robot(&self.robot, self.robot_span) else { return };
        if let Some(finds) = self.finds.as_ref().filter(|finds| !robot.surfaces.contains(&finds.surface)) {
            let message = format!("the model of {} has no surface `{}`", robot.name, finds.surface);
            let help = did_you_mean(&finds.surface, robot.surfaces.iter().map(String::as_str));
            context.problems.add(finds.span, message, help);
        }
        if let Some(unit) = context.joint(robot, &self.joint, self.joint_span)
            && unit != self.unit
        {
            let message = format!("joint `{}` goes by {}", self.joint, unit.symbol());
            context.problems.add(self.joint_span, message, format!("write `travel_{}`", unit.symbol()));
        }
    }

    fn result_shape(&self, cell: &CellNames) -> Shape {
        let joints = || cell.joints_shape(&self.robot);
        Shape::Map(vec![
            ("found".to_owned(), Shape::Single),
            ("joints".to_owned(), joints()),
            ("half_width_deg".to_owned(), Shape::Single),
            ("half_width_mm".to_owned(), Shape::Single),
            ("fast_joints".to_owned(), joints()),
        ])
    }

    fn estimated_time_s(&self, context: &TimeContext<'_>) -> Option<f64> {
        let robot = context.robot(&self.robot)?;
        let full = robot.full_speed(&self.joint);
        let fast = self.unit.to_internal(self.fast.chunk);
        let slow = self.unit.to_internal(self.slow.chunk);
        let back_off = self.unit.to_internal(self.back_off);
        let way = self.foreseen_way(context).abs();
        // Fast on the way, and slowly once more; then the way back to the trigger.
        let moves = back_off / slow + MOVES_BETWEEN;
        let after_finding = 3.0 * back_off / (full * self.fast.speed)
            + 2.0 * back_off / (full * self.slow.speed)
            + moves * robot.command_s();
        let to_it = way / (full * self.fast.speed) + way / fast * robot.command_s();
        // What need not be there is there in every other case, as far as anybody knows.
        Some(to_it + if self.may_find_nothing { after_finding / 2.0 } else { after_finding })
    }

    fn foreseen(&self, context: &TimeContext<'_>) -> Foreseen {
        let here = context.robot(&self.robot).and_then(|robot| robot.position(&self.joint));
        let there = here.map(|here| here + self.foreseen_way(context));
        Foreseen { result: None, joints: vec![(self.robot.clone(), self.joint.clone(), there)] }
    }

    fn searched(&self) -> Option<Searched<'_>> {
        Some(Searched { joint: &self.joint, sensor: &self.sensor })
    }

    fn moved_robots(&self) -> Vec<String> {
        vec![self.robot.clone()]
    }

    fn planned_motions(&self, context: &MotionContext<'_>) -> Vec<PlannedMotion> {
        let state = if self.until_on { "on" } else { "off" };
        let travel = context.amount(&self.travel, self.unit);
        vec![PlannedMotion {
            robot: self.robot.clone(),
            joint: Some(self.joint.clone()),
            how: format!("by at most {travel} until {} is {state}", self.sensor),
            speed: self.fast.speed,
            limits: (context.limits)(&self.robot, &self.joint),
            beyond: None,
        }]
    }

    fn moved_joints(&self, robot: &str) -> MovedJoints {
        match self.robot == robot {
            true => MovedJoints::Named(vec![self.joint.clone()]),
            false => MovedJoints::None,
        }
    }
}

pub(super) const KIND: Kind = Kind::entry::<SearchStep>();

impl StepKind for SearchStep {
    const NAME: &'static str = "search";
    const SENTENCE: &'static str = "moves one joint until a sensor changes: fast, back off, slow from the same side, and back to where it changed";
    const SCHEMA: &'static str = r##"{
  "type": "object",
  "additionalProperties": false,
  "required": ["robot", "joint", "until"],
  "properties": {
    "robot": {"$ref": "#/definitions/text"},
    "joint": {"$ref": "#/definitions/text"},
    "travel_deg": {"description": "How far at most; the sign is the direction.", "$ref": "#/definitions/expression"},
    "travel_mm": {"description": "How far at most; the sign is the direction.", "$ref": "#/definitions/expression"},
    "until": {
      "type": "object",
      "additionalProperties": false,
      "required": ["sensor", "is"],
      "properties": {"sensor": {"$ref": "#/definitions/text"}, "is": {"enum": ["on", "off", true, false]}}
    },
    "fast": {"$ref": "#/definitions/approach"},
    "slow": {"$ref": "#/definitions/approach"},
    "back_off_deg": {"type": "number", "minimum": 0.001, "maximum": 90},
    "back_off_mm": {"type": "number", "minimum": 0.001, "maximum": 90},
    "already_there": {"enum": ["fail", "back_off"]},
    "nothing_found": {"description": "What to do when the sensor does not change on the whole way.", "enum": ["fail", "go_on"]},
    "finds": {
      "description": "What the sensor is over when it changes; `plumb show --table` gives the trigger poses to the model lab with it.",
      "type": "object",
      "additionalProperties": false,
      "required": ["on"],
      "properties": {
        "on": {"description": "A surface of the robot's model file.", "$ref": "#/definitions/text"},
        "height_mm": {"description": "How high over it the hand is then.", "$ref": "#/definitions/expression"},
        "payload_kg": {"description": "What the arm carries then.", "$ref": "#/definitions/expression"},
        "temperature_c": {"description": "How warm it is then.", "$ref": "#/definitions/expression"},
        "repeat": {"description": "One number for all returns to a pose; 0 for none.", "$ref": "#/definitions/expression"}
      }
    }
  },
  "oneOf": [{"required": ["travel_deg"]}, {"required": ["travel_mm"]}]
}"##;

    fn read(node: &Node, context: &ReadContext<'_>) -> Option<Self> {
        read(node, context)
    }

    fn execute(&self, engine: &mut Engine, at: &StepContext) -> Result<Done, StepError> {
        engine.execute_search(self, at)
    }
}
