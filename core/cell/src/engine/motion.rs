//! Motion of a robot on behalf of a step.

use plumb_plugin::JointVector;

use super::Engine;
use super::step_context::StepContext;
use super::step_error::StepError;

impl Engine {
    /// Moves a robot; where it comes to rest is written down with the end of the step.
    pub(crate) fn move_arm(
        &mut self,
        robot: &str,
        from: &JointVector,
        target: &JointVector,
        speed: f64,
        at: &StepContext,
    ) -> Result<JointVector, StepError> {
        self.look_for_interrupt()?;
        let limit = at.time_left()?;
        self.pose_cache.forget();
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
pub(crate) fn joint_vector(value: &serde_json::Value) -> Option<JointVector> {
    let numbers: Option<Vec<f64>> = value.as_array()?.iter().map(serde_json::Value::as_f64).collect();
    JointVector::from_slice(&numbers?).ok()
}
