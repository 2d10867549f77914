//! A robot of two joints, one that turns and one that slides. It moves in memory: replace `Controller` by what talks to yours.

use std::time::Duration;

use plumb_plugin::{
    Host, JointDescription, JointState, JointUnit, JointVector, Motion, PluginError, Robot, RobotCapabilities,
    RobotDescription, Value,
};

/// What talks to the robot; here there is none. Joints are rad and mm.
struct Controller {
    joints: JointVector,
}

/// The robot.
pub struct {Type} {
    host: Host,
    controller: Controller,
}

/// How long it moves between two looks at `should_stop`, which the contract wants at least every 50 ms.
const STEP: Duration = Duration::from_millis(20);

/// How fast each joint goes at most: rad/s and mm/s.
const MAX_SPEED: [f64; 2] = [1.0, 100.0];

impl {Type} {
    /// Where it is now, by the cell's clock.
    fn state(&self, moving: bool) -> JointState {
        JointState::new(self.host.now_ns(), self.controller.joints, moving)
    }
}

impl Robot for {Type} {
    /// Connects. Nothing moves. `config` is what the cell file gives under `config:`, as plugin.yaml allows it.
    fn create(_config: &Value, host: Host) -> Result<Self, PluginError> {
        Ok(Self { host, controller: Controller { joints: JointVector::zeros(2) } })
    }

    fn describe(&self) -> RobotDescription {
        let joint = |name: &str, unit, lower, upper, resolution, max_speed| JointDescription {
            name: name.to_owned(),
            unit,
            lower,
            upper,
            resolution,
            max_speed,
            home: 0.0,
        };
        RobotDescription {
            model: "{name}, in memory".to_owned(),
            joints: vec![
                joint("waist", JointUnit::Radian, (-90_f64).to_radians(), 90_f64.to_radians(), 1e-4, MAX_SPEED[0]),
                joint("slide", JointUnit::Millimetre, 0.0, 200.0, 0.01, MAX_SPEED[1]),
            ],
            inputs: Vec::new(),
            outputs: Vec::new(),
            capabilities: RobotCapabilities { interruptible: true, stop_time_ms: 50, ..RobotCapabilities::default() },
        }
    }

    fn read_joints(&mut self) -> Result<JointState, PluginError> {
        Ok(self.state(false))
    }

    /// Moves, and returns when it is at rest at its target. plumb has checked the limits.
    fn move_joints(&mut self, motion: &Motion) -> Result<JointState, PluginError> {
        let from = self.controller.joints;
        let end = motion.end_from(&from);
        let way = |joint: usize| end.get(joint).unwrap_or(0.0) - from.get(joint).unwrap_or(0.0);
        let seconds = (0..2).map(|joint| way(joint).abs() / MAX_SPEED[joint] / motion.speed_fraction).fold(0.0, f64::max);
        let steps = (seconds / STEP.as_secs_f64()).ceil().max(1.0) as u32;
        for step in 1..=steps {
            // Ends here with PluginError::Stopped when a stop was asked for: command your controller to stop before that.
            self.host.wait(STEP)?;
            let part = f64::from(step) / f64::from(steps);
            for joint in 0..2 {
                self.controller.joints.set(joint, from.get(joint).unwrap_or(0.0) + way(joint) * part);
            }
            if step == steps {
                self.controller.joints = end;
            }
            self.host.emit("joints", &self.state(step < steps))?;
        }
        Ok(self.state(false))
    }

    /// Brings it to rest, now.
    fn stop(&mut self) -> Result<(), PluginError> {
        Ok(())
    }
}

plumb_plugin::export_robot!({Type}, include_str!("../plugin.yaml"));
