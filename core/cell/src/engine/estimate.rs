//! How long a plan should take, as far as can be known before it starts.

use nalgebra::IsometryMatrix3;
use plumb_plugin::JointVector;
use serde_json::{Map, Value};

use super::Engine;
use super::arm::Arm;
use super::plan::{Entry, Plan, Work};
use crate::event::PlannedStep;
use crate::expression::Calculator;
use crate::step::TimeContext;

/// Full speed of a robot's joint.
type FullSpeed<'a> = Box<dyn Fn(&str, &str) -> Option<f64> + 'a>;

/// How long a robot's flange takes from one place to another at full speed, seconds.
type FlangeTime<'a> = Box<dyn Fn(&str, [IsometryMatrix3<f64>; 2]) -> Option<f64> + 'a>;

/// What the times of a plan are worked out from.
pub(crate) struct Estimator<'a> {
    pub(crate) plan: &'a Plan,
    pub(crate) calculator: &'a Calculator,
    /// What the robots' model files give to expressions.
    pub(crate) models: Map<String, Value>,
    /// Full speed of a robot's joint, rad/s or mm/s, where the robot has told it.
    pub(crate) full_speed: FullSpeed<'a>,
    /// How long a robot's flange takes from place to place, where the robot is there and its model known.
    pub(crate) flange_time: FlangeTime<'a>,
}

impl Engine {
    /// The plan as it is shown, and the estimated time of all of it, seconds.
    pub(crate) fn planned_steps(&self) -> (Vec<PlannedStep>, f64) {
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
    pub(crate) fn planned_steps(&self) -> (Vec<PlannedStep>, f64) {
        let mut steps = Vec::new();
        let mut total = 0.0;
        for entry in self.plan.entries.iter().filter(|entry| entry.is_shown()) {
            let estimate_s = self.estimate(entry);
            total += estimate_s.unwrap_or(0.0);
            steps.push(PlannedStep {
                step: entry.path.clone(),
                title: entry.step.title.clone(),
                kind: entry.step.kind.to_owned(),
                depth: entry.depth,
                moves: entry.step.action.moved_robots(),
                asks: entry.step.action.question().is_some(),
                estimate_s,
            });
        }
        (steps, total)
    }

    /// What the time of an entry is worked out from.
    pub(crate) fn context(&self, entry: &Entry) -> TimeContext<'_> {
        let scope = self.plan.scopes.get(entry.scope);
        TimeContext {
            calculator: self.calculator,
            values: scope.map(|scope| scope.plan_values(self.models.clone())).unwrap_or_default(),
            full_speed: &*self.full_speed,
            flange_time: &*self.flange_time,
        }
    }

    fn estimate(&self, entry: &Entry) -> Option<f64> {
        match entry.work {
            Work::Begin { .. } => Some(0.0),
            _ => entry.step.action.estimated_time_s(&self.context(entry)),
        }
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
