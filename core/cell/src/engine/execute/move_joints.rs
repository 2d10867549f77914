//! `move`

use nalgebra::Vector3;
use plumb_plugin::JointVector;
use serde_json::json;

use super::scan::flange_at;
use crate::engine::Engine;
use crate::engine::arm::WantedPoint;
use crate::engine::scope::joints_value;
use crate::engine::step_context::{Done, StepContext};
use crate::engine::step_error::StepError;
use crate::event::NamedValue;
use crate::step::{MoveStep, PointTarget};

impl Engine {
    pub(super) fn execute_move(&mut self, step: &MoveStep, at: &StepContext) -> Result<Done, StepError> {
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
        let places =
            values.iter().map(|value| format!("{} at {:.3} {}", value.name, value.value, value.unit));
        let message = places.collect::<Vec<_>>().join(", ");
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
            let Some(column) = arm.column(&joint.joint) else { continue };
            let place = if step.relative {
                start.get(column).unwrap_or(0.0) + value
            } else {
                value - arm.zero(column)
            };
            target.set(column, place);
        }
        if let Some(hand) = &step.hand {
            let attitude = self.attitude([&hand.tilt, &hand.azimuth, &hand.turn], at)?;
            let wanted = flange_at(self.place(&hand.at, at)?, attitude, Vector3::from(hand.aim_mm));
            target = self.arm(&step.robot)?.joints_for(&wanted, start).map_err(StepError::error)?;
        }
        if let Some(point) = &step.point {
            target = self.point_target(step, point, at, start, &target)?;
        }
        Ok(target)
    }

    /// Where the drive has to go for the model's point to come where it is wanted, the other joints going where they are told. The way there
    /// decides from which side each joint arrives.
    fn point_target(
        &mut self,
        step: &MoveStep,
        point: &PointTarget,
        at: &StepContext,
        start: &JointVector,
        others: &JointVector,
    ) -> Result<JointVector, StepError> {
        let mut wanted = [0.0; 3];
        for (value, expression) in wanted.iter_mut().zip(&point.xyz) {
            *value = self.number(at.scope, expression)?;
        }
        let payload_kg = match &point.payload {
            Some(payload) => self.number(at.scope, payload)?,
            None => 0.0,
        };
        let arm = self.arm(&step.robot)?;
        let by: Vec<usize> = point.by.iter().filter_map(|(joint, _)| arm.column(joint)).collect();
        let target = point.target.as_ref().map(|(name, _)| name.as_str());
        let wanted = WantedPoint { xyz_mm: wanted, target, by: &by, payload_kg };
        arm.joints_for_point(&wanted, start, others).map_err(StepError::error)
    }

    /// Moves a robot; where it comes to rest is written down with the end of the step.
    pub(super) fn move_arm(
        &mut self,
        robot: &str,
        from: &JointVector,
        target: &JointVector,
        speed: f64,
        at: &StepContext,
    ) -> Result<JointVector, StepError> {
        self.look_for_interrupt()?;
        let limit = at.time_left()?;
        self.standing.forget();
        let begun_ns = self.links.clock_ns();
        let moved = self.arm(robot)?.move_to(from, target, speed, limit);
        match moved {
            Ok(state) => {
                let between_ns = begun_ns.zip(self.links.clock_ns());
                if let Err(reason) = self.arm(robot)?.believe_end(target, &state, between_ns) {
                    // Nobody knows where it is or whether it still moves.
                    self.stops.fire();
                    return Err(StepError::Error(reason));
                }
                self.rest_ns = self.rest_ns.max(state.time_ns);
                self.saw(robot, &state)?;
                self.moved.insert(robot.to_owned(), state.joints);
                Ok(state.joints)
            }
            Err(error) => Err(self.device_error(error)),
        }
    }
}

/// Joints out of a stored intent.
pub(in crate::engine) fn joint_vector(value: &serde_json::Value) -> Option<JointVector> {
    let numbers: Option<Vec<f64>> = value.as_array()?.iter().map(serde_json::Value::as_f64).collect();
    JointVector::from_slice(&numbers?).ok()
}
