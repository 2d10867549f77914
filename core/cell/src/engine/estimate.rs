//! How long a plan should take, as far as can be known before it starts.

use serde_json::{Map, Value};

use super::Engine;
use super::plan::{Entry, Work};
use crate::event::PlannedStep;
use crate::expression::Expression;
use crate::step::{Action, MoveStep, SearchStep};

/// Time a joint takes for a request and its answer, seconds.
const EXCHANGE_S: f64 = 0.02;

impl Engine {
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
                asks: matches!(&entry.step.action, Action::Prompt(_))
                    || matches!(&entry.step.action, Action::Apply(apply) if apply.ask)
                    || matches!(&entry.step.action, Action::Declare(declare) if declare.ask),
                estimate_s,
            });
        }
        (steps, total)
    }

    fn estimate(&self, entry: &Entry) -> Option<f64> {
        if matches!(entry.work, Work::Begin { .. }) {
            return Some(0.0);
        }
        let values = self
            .plan
            .scopes
            .get(entry.scope)
            .map(|scope| scope.plan_values(self.model_values()))
            .unwrap_or_default();
        match &entry.step.action {
            Action::Prompt(_) => None,
            Action::Move(step) => Some(self.estimate_move(step, &values)),
            Action::Search(step) => Some(self.estimate_search(step, &values)),
            Action::Compute(_) | Action::Check(_) | Action::Apply(_) => Some(0.01),
            Action::Declare(_) => Some(EXCHANGE_S),
            Action::Repeat(_) | Action::Call(_) => Some(0.0),
        }
    }

    fn known(&self, expression: &Expression, values: &Map<String, Value>) -> Option<f64> {
        expression.number(&self.calculator, values).ok()
    }

    /// Full speed of a joint, in the unit inside, a second.
    fn full_speed(&self, robot: &str, joint: &str) -> f64 {
        let arm = self.arms.iter().find(|arm| arm.name == robot);
        let joint = arm.and_then(|arm| arm.description.joints.iter().find(|known| known.name == joint));
        joint.map_or(0.3, |joint| joint.max_speed.max(1e-3))
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

fn moved_by(action: &Action) -> Vec<String> {
    match action {
        Action::Move(step) => vec![step.robot.clone()],
        Action::Search(step) => vec![step.robot.clone()],
        Action::Prompt(step) => match &step.question {
            crate::step::Question::JogTo { robot, .. } => vec![robot.clone()],
            _ => Vec::new(),
        },
        _ => Vec::new(),
    }
}
