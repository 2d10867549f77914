//! How long a plan should take, as far as can be known before it starts: the plan is gone through as a run would go through it, with what is
//! known of parameters, computed values, conditions and the positions of joints.

use serde_json::{Map, Value, json};

use super::Engine;
use super::plan::{Entry, Plan, Work};
use super::scope::Scope;
use crate::event::PlannedStep;
use crate::expression::{Calculator, Expression};
use crate::step::{Foreseen, Geometry, Inside, JointFacts, KnownRobot, RobotFacts, TimeContext};
use crate::workcell::{RobotSetting, Workcell};

/// What the times of a plan are worked out from.
pub(crate) struct Estimator<'a> {
    pub(crate) plan: &'a Plan,
    pub(crate) calculator: &'a Calculator,
    pub(crate) cell: &'a Workcell,
    /// What the robots' model files give to expressions.
    pub(crate) models: Map<String, Value>,
    /// What is known of the robots.
    pub(crate) facts: Vec<RobotFacts>,
}

/// What is assumed of a condition that only the run will show.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Unknown {
    /// A step's condition holds, and a repetition goes on: the longest way through the plan.
    Holds,
    /// A step is left out, and a repetition ends with its first turn: the shortest way.
    Ends,
}

/// A step as it is foreseen.
pub(crate) struct ForeseenStep<'a> {
    pub(crate) entry: &'a Entry,
    /// What is known when it begins.
    pub(crate) context: &'a TimeContext<'a>,
    /// Its condition, or that of a repetition or call around it, does not hold: it is not carried out.
    pub(crate) is_left_out: bool,
    /// About how long it takes, seconds; none where a person sets the pace.
    pub(crate) estimate_s: Option<f64>,
}

impl Engine {
    /// The plan as it is shown, and the estimated time of all of it, seconds.
    pub(crate) fn planned_steps(&self) -> (Vec<PlannedStep>, f64) {
        let facts = self.arms.iter().map(|arm| {
            let here = self.pose_cache.fresh(&arm.name);
            let joint = |(index, joint): (usize, &plumb_plugin::JointDescription)| JointFacts {
                name: joint.name.clone(),
                max_speed: joint.max_speed,
                start: Some(here.and_then(|state| state.joints.get(index)).unwrap_or(joint.home)),
            };
            RobotFacts {
                robot: arm.name.clone(),
                joints: arm.description.joints.iter().enumerate().map(joint).collect(),
                command_s: self
                    .facts
                    .iter()
                    .find(|facts| facts.robot == arm.name)
                    .and_then(|facts| facts.command_s),
                ..RobotFacts::default()
            }
        });
        Estimator {
            plan: &self.plan,
            calculator: &self.calculator,
            cell: &self.cell,
            models: self.model_values(),
            facts: facts.collect(),
        }
        .planned_steps()
    }
}

impl Estimator<'_> {
    /// The plan as it is shown, and the estimated time of all of it, seconds.
    pub(crate) fn planned_steps(&self) -> (Vec<PlannedStep>, f64) {
        let mut steps = Vec::new();
        self.foresee(Unknown::Holds, |step| steps.push(step.planned()));
        let total = steps.iter().filter_map(|step| step.estimate_s).sum();
        (steps, total)
    }

    /// The least time, seconds, where a repetition may end before its last turn, nobody knows when; otherwise nothing.
    pub(crate) fn least_s(&self) -> Option<f64> {
        let ends_by =
            |entry: &Entry| matches!(entry.step.action.inside(), Inside::Repeated { until: Some(_), .. });
        if !self.plan.entries.iter().any(ends_by) {
            return None;
        }
        let mut least_s = 0.0;
        self.foresee(Unknown::Ends, |step| least_s += step.estimate_s.unwrap_or(0.0));
        Some(least_s)
    }

    /// The repetitions that may end before their last turn, nobody knows when, each with its most turns.
    pub(crate) fn open_repetitions(&self) -> Vec<(String, u32)> {
        let open = |entry: &Entry| match (&entry.work, entry.step.action.inside()) {
            (Work::Turn { turn: 1, turns }, Inside::Repeated { until: Some(_), .. }) => {
                Some((entry.path.0.clone(), *turns))
            }
            _ => None,
        };
        self.plan.entries.iter().filter_map(open).collect()
    }

    /// Goes through the plan as a run would, and reports each step that is shown.
    pub(crate) fn foresee(&self, unknown: Unknown, mut visit: impl FnMut(&ForeseenStep<'_>)) {
        let known = |setting| self.known_robot(setting);
        let mut robots: Vec<KnownRobot<'_>> = self.cell.robots.iter().map(known).collect();
        let mut scopes = self.plan.scopes.clone();
        // Entries before this one are not carried out.
        let mut goes_on_at = 0;
        for entry in &self.plan.entries {
            let is_passed_over = entry.index < goes_on_at;
            let values = scopes.get(entry.scope).map(|scope| scope.values(self.models.clone()));
            let context = TimeContext {
                calculator: self.calculator,
                values: values.unwrap_or_default(),
                robots: &robots,
            };
            let holds = self.holds(entry.step.when.as_ref(), &context);
            let is_left_out = is_passed_over || !holds.unwrap_or(unknown == Unknown::Holds);
            let is_turn = matches!(entry.work, Work::Turn { .. } | Work::TurnEnd { .. } | Work::End { .. });
            if !is_turn {
                let estimate_s = match (is_left_out, &entry.work) {
                    (true, _) | (_, Work::Begin { .. }) => Some(0.0),
                    _ => entry.step.action.estimated_time_s(&context),
                };
                visit(&ForeseenStep { entry, context: &context, is_left_out, estimate_s });
            }
            if is_passed_over {
                continue;
            }
            match (&entry.work, is_left_out) {
                (Work::Begin { end }, true) => goes_on_at = end + 1,
                (Work::Begin { .. }, false) | (Work::Leaf, true) => {}
                (Work::Leaf, false) => {
                    let foreseen = entry.step.action.foreseen(&context);
                    self.carry_out(entry, foreseen, &mut scopes, &mut robots);
                }
                (Work::Turn { turn, turns }, _) => {
                    if let Some(scope) = scopes.get_mut(entry.scope) {
                        scope.set_state(&entry.step.id, entry.state_of_turn(*turn, *turns));
                    }
                }
                (Work::TurnEnd { end }, _) => {
                    let Inside::Repeated { until, .. } = entry.step.action.inside() else { continue };
                    if until.is_some() && self.holds(until, &context).unwrap_or(unknown == Unknown::Ends) {
                        goes_on_at = *end;
                    }
                }
                (Work::End { called, turns }, _) => {
                    let called = called.and_then(|called| scopes.get(called));
                    let result = called.map(|scope| Value::Object(scope.results().clone()));
                    let result = result.unwrap_or_else(|| json!({"turns": turns}));
                    if let Some(scope) = scopes.get_mut(entry.scope) {
                        scope.set_result(&entry.step.id, result);
                    }
                }
            }
        }
    }

    /// A robot of the cell as the run begins.
    fn known_robot<'c>(&self, setting: &'c RobotSetting) -> KnownRobot<'c> {
        let facts = self.facts.iter().find(|facts| facts.robot == setting.device);
        let geometry = setting.model.as_ref().map(|model| model as &dyn Geometry);
        KnownRobot::new(&setting.device, &setting.joints, geometry, facts)
    }

    /// Whether a condition holds, where that is known before the run; a step without one is always carried out.
    fn holds(&self, condition: Option<&Expression>, context: &TimeContext<'_>) -> Option<bool> {
        condition.map_or(Some(true), |condition| condition.truth(self.calculator, &context.values).ok())
    }

    /// Takes what a step would change into what is known.
    fn carry_out(
        &self,
        entry: &Entry,
        foreseen: Foreseen,
        scopes: &mut [Scope],
        robots: &mut [KnownRobot<'_>],
    ) {
        if let Some(scope) = scopes.get_mut(entry.scope) {
            match foreseen.result {
                Some(result) => scope.set_result(&entry.step.id, result),
                None => scope.forget_result(&entry.step.id),
            }
        }
        for robot in robots {
            let moved = entry.step.action.moved_joints(robot.name());
            robot.moved(|joint| moved.contains(joint));
            let name = robot.name().to_owned();
            let own = foreseen.joints.iter().filter(|(robot, ..)| *robot == name);
            robot.went(own.map(|(_, joint, position)| (joint.as_str(), *position)));
        }
    }
}

impl ForeseenStep<'_> {
    pub(crate) fn planned(&self) -> PlannedStep {
        let step = &self.entry.step;
        PlannedStep {
            step: self.entry.path.clone(),
            title: step.title.clone(),
            kind: step.kind.to_owned(),
            depth: self.entry.depth,
            moves: step.action.moved_robots(),
            asks: step.action.question().is_some(),
            estimate_s: self.estimate_s,
        }
    }
}
