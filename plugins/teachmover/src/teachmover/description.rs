//! What the arm says about itself.

use plumb_plugin::{JointDescription, JointUnit, LineDescription, RobotCapabilities, RobotDescription};

use super::TeachMover;
use crate::cutting::{Closing, Cutting};
use crate::drive::{HalfSteps, Joint, MOTORS};
use crate::limits;
use crate::speed_code::SpeedCode;

/// The user input lines; the eighth bit of the inputs is not described in any source.
const INPUT_LINES: u32 = 7;

/// The user output lines.
const OUTPUT_LINES: u32 = 5;

impl TeachMover {
    pub(super) fn description(&self) -> RobotDescription {
        let stop = self.cutting(self.configuration.full_speed, None, false).longest_stop(MOTORS);
        let stop_time_ms = u32::try_from(stop.as_micros().div_ceil(1000)).unwrap_or(u32::MAX);
        RobotDescription {
            model: "Microbot TeachMover".to_owned(),
            joints: Joint::ALL.map(|joint| self.joint(joint)).to_vec(),
            inputs: if self.configuration.dead_reckoning { Vec::new() } else { self.input_lines() },
            outputs: lines("output", OUTPUT_LINES),
            capabilities: RobotCapabilities {
                interruptible: true,
                stop_time_ms: stop_time_ms.max(self.configuration.stop_within_ms),
                jog: self.configuration.pendant.is_some(),
                only_pendant_ends_jog: true,
                set_zero: true,
            },
        }
    }

    fn joint(&self, joint: Joint) -> JointDescription {
        let (lower, upper) = limits::widest(joint);
        let home = self.zero.joints(HalfSteps::default());
        JointDescription {
            name: joint.name().to_owned(),
            unit: if joint == Joint::Gripper { JointUnit::Millimetre } else { JointUnit::Radian },
            lower,
            upper,
            resolution: 1.0 / self.zero.cable().half_steps_per_unit(joint),
            max_speed: self.configuration.full_speed.rate() / self.zero.cable().half_steps_per_unit(joint),
            home: home.get(joint.index()).copied().unwrap_or_default(),
        }
    }

    fn input_lines(&self) -> Vec<LineDescription> {
        let mut inputs = lines("input", INPUT_LINES);
        if let Some(switch) = self.configuration.grip_switch {
            inputs.retain(|line| line.bit != switch.bit);
            inputs.push(LineDescription { name: "grip_switch".to_owned(), bit: switch.bit });
        }
        inputs
    }

    /// How moves at a speed are cut now.
    pub(super) fn cutting(&self, speed: SpeedCode, closing: Option<Closing>, finest: bool) -> Cutting {
        Cutting {
            speed,
            character: self.controller.line().duration(1),
            stop_within: std::time::Duration::from_millis(u64::from(self.configuration.stop_within_ms)),
            slowness: self.slowness.factor(),
            closing,
            finest,
        }
    }
}

fn lines(kind: &str, count: u32) -> Vec<LineDescription> {
    (0..count).map(|bit| LineDescription { name: format!("{kind}_{}", bit + 1), bit }).collect()
}
