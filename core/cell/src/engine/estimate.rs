//! How long a plan should take, as far as can be known before it starts.

use serde_json::{Map, Value};

use super::Engine;
use super::plan::{Entry, Plan, Work};
use crate::event::PlannedStep;
use crate::expression::{Calculator, Expression};
use crate::step::{Action, MoveStep, Question, ScanStep, SearchStep};

/// Time a joint takes for a request and its answer, seconds.
const EXCHANGE_S: f64 = 0.02;

/// Full speed of a joint that has not told its own, rad/s (or mm/s).
const TYPICAL_SPEED: f64 = 0.3;

/// Full speed of a robot's joint.
type FullSpeed<'a> = Box<dyn Fn(&str, &str) -> Option<f64> + 'a>;

/// What the times of a plan are worked out from.
pub(super) struct Estimator<'a> {
    pub(super) plan: &'a Plan,
    pub(super) calculator: &'a Calculator,
    /// What the robots' model files give to expressions.
    pub(super) models: Map<String, Value>,
    /// Full speed of a robot's joint, rad/s or mm/s, where the robot has told it.
    pub(super) full_speed: FullSpeed<'a>,
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
            Action::Declare(_) => Some(EXCHANGE_S),
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

    /// Every stripe takes a short move, its settling and a picture.
    fn estimate_scan(&self, step: &ScanStep, values: &Map<String, Value>) -> f64 {
        let numbers = |place: &[Expression; 3]| place.each_ref().map(|axis| self.known(axis, values));
        let way = |from: [Option<f64>; 3], to: [Option<f64>; 3]| {
            let squares = from.iter().zip(to).map(|(from, to)| Some((to? - (*from)?).powi(2)));
            squares.sum::<Option<f64>>().map(f64::sqrt)
        };
        let length = way(numbers(&step.from), numbers(&step.to)).unwrap_or(100.0);
        let stripes = (length / self.known(&step.step, values).unwrap_or(10.0).max(0.01)).floor() + 1.0;
        stripes * (4.0 * EXCHANGE_S + 0.2)
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

/// Whether a step asks somebody.
pub(super) fn asks(action: &Action) -> bool {
    match action {
        Action::Prompt(_) => true,
        Action::Apply(apply) => apply.ask,
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
