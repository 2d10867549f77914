//! `scan`: a light stripe sensor is carried along a line, and at each position a stripe is taken.

use nalgebra::{IsometryMatrix3, Rotation3, Vector3};
use plumb_document::{MapReader, Node, Span};

use super::declaration::{Action, MovedJoints, numbers_shape};
use super::kind::{Kind, StepKind};
use super::known_robot::{KnownRobot, TYPICAL_TURN};
use super::motions::{MotionContext, PlannedMotion};
use super::point::{known_attitude, known_position, position_in_words, read_position};
use super::read::check_name;
use super::time::{EXCHANGE_S, Foreseen, TimeContext};
use crate::cell_names::CellNames;
use crate::check_context::CheckContext;
use crate::engine::Engine;
use crate::engine::flange::flange_at;
use crate::engine::step_context::{Done, StepContext};
use crate::engine::step_error::StepError;
use crate::expression::{Expression, Shape};
use crate::read_context::ReadContext;

mod carry_out;
mod flight;

/// Time a picture of a scan takes, seconds: one exchange with the camera, one with the sensor.
const PICTURE_S: f64 = 2.0 * EXCHANGE_S;

/// How long a scan is whose line is not known before the run, mm.
const TYPICAL_LENGTH_MM: f64 = 100.0;

/// From stripe to stripe where that is not known before the run, mm.
const TYPICAL_PITCH_MM: f64 = 10.0;

/// How far a hand is from the joints that carry it along a line, mm, where no model says.
const TYPICAL_REACH_MM: f64 = 500.0;

/// A declared scan.
#[derive(Debug, Clone)]
pub(crate) struct ScanStep {
    /// Which robot.
    pub(crate) robot: String,
    /// Where its name is written.
    pub(crate) robot_span: Span,
    /// The light stripe sensor.
    pub(crate) sensor: String,
    /// Where its name is written.
    pub(crate) sensor_span: Span,
    /// The camera that is asked for each picture; none for one that takes them by itself.
    pub(crate) trigger: Option<(String, Span)>,
    /// Where the first stripe's middle goes, mm in the robot's base frame.
    pub(crate) from: [Expression; 3],
    /// Where the last goes at most.
    pub(crate) to: [Expression; 3],
    /// From stripe to stripe, mm.
    pub(crate) step: Expression,
    /// The point of the flange's frame that is brought to each of these positions, mm.
    pub(crate) aim_mm: [f64; 3],
    /// How far the flange's axis is tilted from straight down, deg.
    pub(crate) tilt: Option<Expression>,
    /// The direction, about the vertical from the base's x, in which the flange then is, deg.
    pub(crate) azimuth: Option<Expression>,
    /// How far the flange is turned about its own axis, deg.
    pub(crate) turn: Option<Expression>,
    /// Part of the full speed.
    pub(crate) speed: f64,
    /// How fast the aim goes along the line while the camera takes pictures by itself, mm/s; none or 0: the arm rests for each.
    pub(crate) fly: Option<Expression>,
    /// What is fitted to the points.
    pub(crate) fit: Option<Fitted>,
    /// The name of the cloud's files.
    pub(crate) save: Option<String>,
    /// The name under which the lab knows the surface.
    pub(crate) on: Option<String>,
}

/// What is fitted to the points of a scan.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Fitted {
    /// A plane.
    Plane,
    /// A pyramid of four faces on a table.
    Pyramid,
    /// A ball on a table.
    Sphere,
}

fn read(node: &Node, context: &ReadContext<'_>) -> Option<ScanStep> {
    let mut map = MapReader::new(node, "a scan", context.problems)?;
    let robot = context.required_text(&mut map, "robot");
    let sensor = context.required_text(&mut map, "sensor");
    let text =
        |node: &Node, what: &str| node.text(what, context.problems).map(|text| (text.to_owned(), node.span));
    let trigger = map.optional("trigger").and_then(|node| text(node, "`trigger`"));
    let from = map.required("from_mm").and_then(|node| read_position(node, "`from_mm`", context));
    let to = map.required("to_mm").and_then(|node| read_position(node, "`to_mm`", context));
    let step = map.required("step_mm").and_then(|node| context.expression(node, "`step_mm`"));
    let aim_mm = map.required("aim_mm").and_then(|node| node.numbers("`aim_mm`", context.problems));
    let mut angle =
        |key: &'static str| map.optional(key).and_then(|node| context.expression(node, &format!("`{key}`")));
    let (tilt, azimuth, turn) = (angle("tilt_deg"), angle("azimuth_deg"), angle("turn_deg"));
    let fly = angle("fly_mm_s");
    let speed = context.number_or(&mut map, "speed", (0.001, 1.0), 0.5);
    let fit = map
        .optional("fit")
        .and_then(|node| node.word("surface to fit", &["plane", "pyramid", "sphere"], context.problems))
        .map(|word| {
            [Fitted::Plane, Fitted::Pyramid, Fitted::Sphere].get(word).copied().unwrap_or(Fitted::Plane)
        });
    let save = map.optional("save").and_then(|node| {
        let (name, span) = text(node, "`save`")?;
        check_name(&name, span, "the name of a cloud", context);
        Some(name)
    });
    let on = map.optional("on").and_then(|node| text(node, "`on`")).map(|(name, _)| name);
    map.finish();
    let (robot, robot_span) = robot?;
    let (sensor, sensor_span) = sensor?;
    Some(ScanStep {
        robot,
        robot_span,
        sensor,
        sensor_span,
        trigger,
        from: from?,
        to: to?,
        step: step?,
        aim_mm: aim_mm?,
        tilt,
        azimuth,
        turn,
        speed,
        fly,
        fit,
        save,
        on,
    })
}

impl Action for ScanStep {
    fn check(&self, context: &CheckContext<'_>) {
        let _ = context.robot(&self.robot, self.robot_span);
        context.sensor(&self.sensor, self.sensor_span);
        if let Some((trigger, span)) = &self.trigger {
            context.sensor(trigger, *span);
        }
        let expressions = self.from.iter().chain(&self.to).chain([&self.step]);
        let angles = self.tilt.iter().chain(&self.azimuth).chain(&self.turn).chain(&self.fly);
        for expression in expressions.chain(angles) {
            context.check_expression(expression);
        }
    }

    fn result_shape(&self, _cell: &CellNames) -> Shape {
        let mut names = vec!["points", "stripes", "empty", "seconds", "camera_percent", "processing_percent"];
        match self.fit {
            None => {}
            Some(Fitted::Plane) => {
                names.extend(["rms_mm", "thickness_mm", "normal_x", "normal_y", "normal_z", "offset_mm"])
            }
            Some(Fitted::Pyramid) => names.extend(["rms_mm", "apex_x_mm", "apex_y_mm", "apex_z_mm"]),
            Some(Fitted::Sphere) => {
                names.extend(["rms_mm", "centre_x_mm", "centre_y_mm", "centre_z_mm", "radius_mm"]);
            }
        }
        numbers_shape(&names)
    }

    /// Every stripe takes a short move and a picture; in motion all of them take one way, and pictures that are fetched after it.
    fn estimated_time_s(&self, context: &TimeContext<'_>) -> Option<f64> {
        let robot = context.robot(&self.robot)?;
        let line = self.line(context);
        let length = line.as_ref().map_or(TYPICAL_LENGTH_MM, |line| line.length_mm);
        let pitch = context.known(&self.step).unwrap_or(TYPICAL_PITCH_MM).max(0.01);
        let stripes = (length / pitch + 1e-9).floor() + 1.0;
        // The speed of a hand at full speed is that of joints turning about something as far away as a hand usually is.
        let typical = |way_mm: f64| {
            robot.way_s(robot.anywhere()).max(1e-6) * way_mm / (TYPICAL_REACH_MM * TYPICAL_TURN)
        };
        let joints = line.as_ref().and_then(|line| line.joints(robot, pitch));
        let (there, hop) = match &joints {
            Some([first, second]) => {
                let mut at_first = robot.clone();
                at_first.went(robot.named(first));
                (robot.way_s(robot.named(first)), at_first.way_s(robot.named(second)))
            }
            None => (robot.way_s(robot.anywhere()), typical(pitch)),
        };
        let fly = self.fly.as_ref().and_then(|fly| context.known(fly));
        let ways = match fly.filter(|speed| *speed > 0.0) {
            Some(speed_mm_s) => 2.0 * robot.command_s() + length / speed_mm_s,
            None => (stripes - 1.0) * hop / self.speed + stripes * robot.command_s(),
        };
        Some(there / self.speed + ways + stripes * PICTURE_S)
    }

    fn foreseen(&self, context: &TimeContext<'_>) -> Foreseen {
        let Some(robot) = context.robot(&self.robot) else { return Foreseen::default() };
        let line = self.line(context);
        let last = line.and_then(|line| robot.joints_for(&line.flange(line.length_mm)));
        let named = last.iter().flat_map(|last| robot.named(last));
        let joints = named.map(|(joint, goal)| (self.robot.clone(), joint.to_owned(), goal)).collect();
        Foreseen { result: None, joints }
    }

    fn planned_motions(&self, context: &MotionContext<'_>) -> Vec<PlannedMotion> {
        let words = |point| position_in_words(point, context.time);
        vec![PlannedMotion {
            robot: self.robot.clone(),
            joint: None,
            how: format!("'s hand along a line from {} to {}", words(&self.from), words(&self.to)),
            speed: self.speed,
            limits: "its joints' limits".to_owned(),
            beyond: None,
        }]
    }

    fn moved_robots(&self) -> Vec<String> {
        vec![self.robot.clone()]
    }

    fn moved_joints(&self, robot: &str) -> MovedJoints {
        if self.robot == robot { MovedJoints::All } else { MovedJoints::None }
    }
}

/// The line of a scan, where it is known before the run.
struct Line {
    from: Vector3<f64>,
    direction: Vector3<f64>,
    length_mm: f64,
    attitude: Rotation3<f64>,
    aim: Vector3<f64>,
}

impl Line {
    /// Where the flange is so far along the line.
    fn flange(&self, along_mm: f64) -> IsometryMatrix3<f64> {
        flange_at(self.from + self.direction * along_mm, self.attitude, self.aim)
    }

    /// The joints at the first stripe and at the second.
    fn joints(&self, robot: &KnownRobot<'_>, pitch_mm: f64) -> Option<[Vec<f64>; 2]> {
        let first = robot.joints_for(&self.flange(0.0))?;
        let mut there = robot.clone();
        there.went(robot.named(&first));
        let second = there.joints_for(&self.flange(pitch_mm))?;
        Some([first, second])
    }
}

impl ScanStep {
    fn line(&self, context: &TimeContext<'_>) -> Option<Line> {
        let from = known_position(&self.from, context)?;
        let way = known_position(&self.to, context)? - from;
        let attitude = known_attitude([&self.tilt, &self.azimuth, &self.turn], context)?;
        let direction = way.try_normalize(1e-9).unwrap_or_default();
        Some(Line { from, direction, length_mm: way.norm(), attitude, aim: Vector3::from(self.aim_mm) })
    }

    /// The camera that takes pictures by itself while the arm flies.
    pub(crate) fn camera(&self) -> Option<&str> {
        self.trigger.as_ref().map(|(name, _)| name.as_str())
    }
}

pub(super) const KIND: Kind = Kind::entry::<ScanStep>();

impl StepKind for ScanStep {
    const NAME: &'static str = "scan";
    const SENTENCE: &'static str = "carries a light stripe sensor along a line, a stripe at each place, and makes a cloud of points of them";
    const SCHEMA: &'static str = r##"{
  "type": "object",
  "additionalProperties": false,
  "required": ["robot", "sensor", "from_mm", "to_mm", "step_mm", "aim_mm"],
  "properties": {
    "robot": {"$ref": "#/definitions/text"},
    "sensor": {"$ref": "#/definitions/text"},
    "trigger": {"description": "The camera that takes a picture at each place.", "$ref": "#/definitions/text"},
    "from_mm": {"description": "Where the line begins: [x, y, z].", "$ref": "#/definitions/place"},
    "to_mm": {"description": "Where the line ends: [x, y, z].", "$ref": "#/definitions/place"},
    "step_mm": {"description": "From one place to the next.", "$ref": "#/definitions/expression"},
    "aim_mm": {"description": "The point in the hand's frame that goes along the line.", "type": "array", "items": {"type": "number"}, "minItems": 3, "maxItems": 3},
    "tilt_deg": {"$ref": "#/definitions/expression"},
    "azimuth_deg": {"$ref": "#/definitions/expression"},
    "turn_deg": {"$ref": "#/definitions/expression"},
    "speed": {"$ref": "#/definitions/speed"},
    "fly_mm_s": {"description": "How fast the aim goes along the line while the camera takes pictures by itself; 0 or left out: the arm rests for each.", "$ref": "#/definitions/expression"},
    "fit": {"description": "The surface that is laid into the cloud.", "enum": ["plane", "pyramid", "sphere"]},
    "save": {"description": "The name of the cloud's files; a second cloud of that name in the same run is NAME-2.", "$ref": "#/definitions/name"},
    "on": {"description": "The surface of the model file that was scanned.", "$ref": "#/definitions/text"}
  }
}"##;

    fn read(node: &Node, context: &ReadContext<'_>) -> Option<Self> {
        read(node, context)
    }

    fn execute(&self, engine: &mut Engine, at: &StepContext) -> Result<Done, StepError> {
        engine.execute_scan(self, at)
    }
}
