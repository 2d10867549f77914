//! How long a plan should take, as far as can be known before it starts.

use nalgebra::{IsometryMatrix3, Vector3};
use plumb_plugin::JointVector;
use serde_json::{Map, Value};

use super::Engine;
use super::arm::Arm;
use super::execute::{attitude_of, flange_at};
use super::plan::{Entry, Plan, Work};
use crate::event::PlannedStep;
use crate::expression::{Calculator, Expression};
use crate::step::{Action, MoveStep, Question, ScanStep, SearchStep};

/// Time a joint takes for a request and its answer, seconds.
const EXCHANGE_S: f64 = 0.02;

/// Full speed of a joint that has not told its own, rad/s (or mm/s).
const TYPICAL_SPEED: f64 = 0.3;

/// Time a picture of a scan takes, seconds: one exchange with the camera, one with the sensor.
const PICTURE_S: f64 = 2.0 * EXCHANGE_S;

/// How far it is to where a scan begins, or from one of its stripes to the next, in joints, where that is not known, rad.
const TYPICAL_HOP: f64 = 0.03;

/// Full speed of a robot's joint.
type FullSpeed<'a> = Box<dyn Fn(&str, &str) -> Option<f64> + 'a>;

/// How long a robot's flange takes from one place to another at full speed, seconds.
type FlangeTime<'a> = Box<dyn Fn(&str, [IsometryMatrix3<f64>; 2]) -> Option<f64> + 'a>;

/// What the times of a plan are worked out from.
pub(super) struct Estimator<'a> {
    pub(super) plan: &'a Plan,
    pub(super) calculator: &'a Calculator,
    /// What the robots' model files give to expressions.
    pub(super) models: Map<String, Value>,
    /// Full speed of a robot's joint, rad/s or mm/s, where the robot has told it.
    pub(super) full_speed: FullSpeed<'a>,
    /// How long a robot's flange takes from place to place, where the robot is there and its model known.
    pub(super) flange_time: FlangeTime<'a>,
}

impl Engine {
    /// The plan as it is shown, and the estimated time of all of it, seconds.
    pub(super) fn planned_steps(&self) -> (Vec<PlannedStep>, f64) {
        let full_speed = |robot: &str, joint: &str| {
            let arm = self.arms.iter().find(|arm| arm.name == robot)?;
            arm.description.joints.iter().find(|known| known.name == joint).map(|joint| joint.max_speed)
        };
        Estimator {
            plan: &self.plan,
            calculator: &self.calculator,
            models: self.model_values(),
            full_speed: Box::new(full_speed),
            flange_time: Box::new(|robot, places| {
                flange_time(self.arms.iter().find(|arm| arm.name == robot)?, places)
            }),
        }
        .planned_steps()
    }
}

impl Estimator<'_> {
    /// The plan as it is shown, and the estimated time of all of it, seconds.
    pub(super) fn planned_steps(&self) -> (Vec<PlannedStep>, f64) {
        let mut steps = Vec::new();
        let mut total = 0.0;
        for entry in self.plan.entries.iter().filter(|entry| entry.is_shown()) {
            let estimate_s = self.estimate(entry);
            total += estimate_s.unwrap_or(0.0);
            steps.push(PlannedStep {
                step: entry.path.clone(),
                title: entry.step.title.clone(),
                kind: entry.step.action.kind().to_owned(),
                depth: entry.depth,
                moves: moved_by(&entry.step.action),
                asks: asks(&entry.step.action),
                estimate_s,
            });
        }
        (steps, total)
    }

    /// The values that are known to an entry before the run.
    pub(super) fn values(&self, entry: &Entry) -> Map<String, Value> {
        let scope = self.plan.scopes.get(entry.scope);
        scope.map(|scope| scope.plan_values(self.models.clone())).unwrap_or_default()
    }

    fn estimate(&self, entry: &Entry) -> Option<f64> {
        if matches!(entry.work, Work::Begin { .. }) {
            return Some(0.0);
        }
        match &entry.step.action {
            Action::Prompt(_) => None,
            Action::Move(step) => Some(self.estimate_move(step, &self.values(entry))),
            Action::Search(step) => Some(self.estimate_search(step, &self.values(entry))),
            Action::Scan(step) => Some(self.estimate_scan(step, &self.values(entry))),
            Action::Measure(_) => Some(4.0 * EXCHANGE_S),
            Action::Configure(_) | Action::Row(_) => Some(EXCHANGE_S),
            Action::Compute(_) | Action::Check(_) | Action::Apply(_) => Some(0.01),
            Action::Declare(_) | Action::Correct(_) => Some(EXCHANGE_S),
            Action::Repeat(_) | Action::Call(_) => Some(0.0),
        }
    }

    /// What an expression comes to, where that is known before the run.
    pub(super) fn known(&self, expression: &Expression, values: &Map<String, Value>) -> Option<f64> {
        expression.number(self.calculator, values).ok()
    }

    /// Full speed of a joint, in the unit inside, a second.
    fn full_speed(&self, robot: &str, joint: &str) -> f64 {
        (self.full_speed)(robot, joint).map_or(TYPICAL_SPEED, |speed| speed.max(1e-3))
    }

    fn estimate_move(&self, step: &MoveStep, values: &Map<String, Value>) -> f64 {
        let times = step.targets.iter().map(|target| {
            // Where an absolute move starts from is not known yet: a typical way is taken.
            let way = match self.known(&target.value, values) {
                Some(way) if step.relative => target.unit.to_internal(way).abs(),
                _ => 0.3,
            };
            way / (self.full_speed(&step.robot, &target.joint) * step.speed)
        });
        times.fold(EXCHANGE_S, f64::max)
    }

    /// Every stripe takes a short move and a picture; in motion all of them take one way, and pictures that are fetched after it.
    fn estimate_scan(&self, step: &ScanStep, values: &Map<String, Value>) -> f64 {
        let known = |expression: &Expression| self.known(expression, values);
        let place = |[x, y, z]: &[Expression; 3]| Some(Vector3::new(known(x)?, known(y)?, known(z)?));
        let line = place(&step.from).zip(place(&step.to));
        let length = line.map_or(100.0, |(from, to)| (to - from).norm());
        let pitch = known(&step.step).unwrap_or(10.0).max(0.01);
        let stripes = (length / pitch).floor() + 1.0;
        let hop = line.and_then(|(from, to)| self.hop_time(step, from, to, pitch, values));
        let hop = hop.unwrap_or(TYPICAL_HOP / TYPICAL_SPEED) / step.speed;
        let ways = match step.fly.as_ref().and_then(known).filter(|speed| *speed > 0.0) {
            Some(speed_mm_s) => hop + length / speed_mm_s,
            None => stripes * hop,
        };
        ways + stripes * PICTURE_S
    }

    /// From the first stripe of a scan to the second, seconds.
    fn hop_time(
        &self,
        step: &ScanStep,
        from: Vector3<f64>,
        to: Vector3<f64>,
        pitch: f64,
        values: &Map<String, Value>,
    ) -> Option<f64> {
        let angle = |angle: &Option<Expression>| match angle {
            None => Some(0.0),
            Some(angle) => self.known(angle, values).map(f64::to_radians),
        };
        let attitude = attitude_of(angle(&step.tilt)?, angle(&step.azimuth)?, angle(&step.turn)?);
        let second = from + (to - from).try_normalize(1e-9)? * pitch;
        let places = [from, second].map(|place| flange_at(place, attitude, Vector3::from(step.aim_mm)));
        (self.flange_time)(&step.robot, places)
    }

    fn estimate_search(&self, step: &SearchStep, values: &Map<String, Value>) -> f64 {
        let full = self.full_speed(&step.robot, &step.joint);
        let fast = step.unit.to_internal(step.fast.chunk);
        let slow = step.unit.to_internal(step.slow.chunk);
        let back_off = step.unit.to_internal(step.back_off);
        let way =
            self.known(&step.travel, values).map_or(0.2, |travel| step.unit.to_internal(travel).abs()) / 3.0;
        let exchanges = 2.0 * EXCHANGE_S * (way / fast + 2.0 * back_off / slow + 6.0);
        way / (full * step.fast.speed)
            + 3.0 * back_off / (full * step.fast.speed)
            + 2.0 * back_off / (full * step.slow.speed)
            + exchanges
    }
}

/// How long a robot's flange takes from one place to another at full speed, seconds, sought from the robot's home.
fn flange_time(arm: &Arm, places: [IsometryMatrix3<f64>; 2]) -> Option<f64> {
    let home: Vec<f64> = arm.description.joints.iter().map(|joint| joint.home).collect();
    let home = JointVector::from_slice(&home).ok()?;
    let first = arm.joints_for(&places[0], &home).ok()?;
    let second = arm.joints_for(&places[1], &first).ok()?;
    Some(arm.expected_time(&first, &second, 1.0).as_secs_f64())
}

/// Whether a step asks somebody.
pub(super) fn asks(action: &Action) -> bool {
    match action {
        Action::Prompt(_) => true,
        Action::Apply(apply) => apply.ask,
        Action::Correct(correct) => correct.ask,
        Action::Declare(declare) => declare.ask,
        _ => false,
    }
}

fn moved_by(action: &Action) -> Vec<String> {
    match action {
        Action::Move(step) => vec![step.robot.clone()],
        Action::Search(step) => vec![step.robot.clone()],
        Action::Scan(step) => vec![step.robot.clone()],
        Action::Prompt(step) => match &step.question {
            Question::JogTo { robot, .. } => vec![robot.clone()],
            _ => Vec::new(),
        },
        _ => Vec::new(),
    }
}
