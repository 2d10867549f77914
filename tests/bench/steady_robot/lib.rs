//! A robot that answers at once, and reports where it is every millisecond while it moves: what is measured with it is not itself.

use std::time::{Duration, Instant};

use plumb_plugin::{
    DigitalInputs, Host, JointDescription, JointState, JointUnit, JointVector, Motion, PluginError, Robot,
    RobotCapabilities, RobotDescription, Value,
};

/// The time between two messages.
const PERIOD: Duration = Duration::from_millis(1);

struct SteadyRobot {
    host: Host,
    joints: JointVector,
}

plumb_plugin::export_robot!(SteadyRobot, include_str!("plugin.yaml"));

impl SteadyRobot {
    fn inputs(&self) -> DigitalInputs {
        DigitalInputs {
            time_ns: self.host.now_ns(),
            joints: self.joints,
            joints_half_width: JointVector::zeros(1),
            ..DigitalInputs::default()
        }
    }
}

impl Robot for SteadyRobot {
    fn create(_config: &Value, host: Host) -> Result<Self, PluginError> {
        Ok(Self { host, joints: JointVector::zeros(1) })
    }

    fn describe(&self) -> RobotDescription {
        RobotDescription {
            model: "steady robot".to_owned(),
            joints: vec![JointDescription {
                name: "belt".to_owned(),
                unit: JointUnit::Millimetre,
                lower: 0.0,
                upper: 1e9,
                resolution: 0.0,
                max_speed: 1000.0,
                home: 0.0,
            }],
            inputs: Vec::new(),
            outputs: Vec::new(),
            capabilities: RobotCapabilities {
                interruptible: true,
                stop_time_ms: 10,
                ..RobotCapabilities::default()
            },
        }
    }

    fn read_joints(&mut self) -> Result<JointState, PluginError> {
        Ok(JointState::new(self.host.now_ns(), self.joints, false))
    }

    /// A millimetre a millisecond, and two messages with each.
    fn move_joints(&mut self, motion: &Motion) -> Result<JointState, PluginError> {
        let from = self.joints.get(0).unwrap_or_default();
        let to = motion.end_from(&self.joints).get(0).unwrap_or_default();
        let began = Instant::now();
        for step in 1..=(to - from).max(0.0) as u32 {
            if self.host.should_stop() {
                return Err(PluginError::stopped());
            }
            std::thread::sleep((PERIOD * step).saturating_sub(began.elapsed()));
            self.joints.set(0, from + f64::from(step));
            self.host.emit("joints", &JointState::new(self.host.now_ns(), self.joints, true))?;
            self.host.emit("inputs", &self.inputs())?;
        }
        let state = JointState::new(self.host.now_ns(), self.joints, false);
        self.host.emit("inputs", &self.inputs())?;
        Ok(state)
    }

    fn stop(&mut self) -> Result<(), PluginError> {
        Ok(())
    }
}
