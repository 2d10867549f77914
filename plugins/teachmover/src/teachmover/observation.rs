//! Where the arm is and what its inputs say, as the controller reports it.

use std::time::Instant;

use plumb_plugin::{DigitalInputs, JointState, JointVector, LogLevel, PluginError};

use super::TeachMover;
use crate::drive::{HalfSteps, Joint, Joints, MOTOR_NAMES};
use crate::protocol::{ControllerState, PendantKey};

/// How often registers and inputs are read until two readings agree.
const READINGS: usize = 4;

impl TeachMover {
    /// Reads registers and inputs, and emits a change of the inputs with the pose it happened at.
    ///
    /// A line without checksums can turn one digit into another. A reading as expected needs no second one; any other counts only when it comes
    /// twice.
    ///
    /// # Errors
    /// Anything the line says; [`PluginError::Failed`] when no two readings agree.
    pub(super) fn observe(&mut self, expected: Option<HalfSteps>) -> Result<ControllerState, PluginError> {
        let before = self.last;
        let expected = ControllerState { registers: expected.unwrap_or(before.registers), ..before };
        let now = self.read_twice_alike(Some(expected))?;
        self.last = now;
        self.stop_key |= now.key == PendantKey::STOP && before.key != PendantKey::STOP;
        if now.inputs != before.inputs {
            self.host.emit("inputs", &self.input_change(&before, &now))?;
        }
        Ok(now)
    }

    /// Reads until two readings agree, or one is as expected.
    pub(super) fn read_twice_alike(
        &mut self,
        expected: Option<ControllerState>,
    ) -> Result<ControllerState, PluginError> {
        let mut former = None;
        for index in 0..READINGS {
            let reading = self.controller.read()?;
            if expected == Some(reading) || former == Some(reading) {
                if index > 1 {
                    self.host.log(
                        LogLevel::Warn,
                        "a reading of the registers was damaged on the line; read again",
                    );
                }
                self.read_at = Instant::now();
                return Ok(reading);
            }
            former = Some(reading);
        }
        Err(PluginError::Failed(format!(
            "{READINGS} readings of the registers on {} all differ: check the cable, and that no program runs in the controller",
            self.configuration.port
        )))
    }

    /// The joints now.
    pub(super) fn joints(&self) -> Joints {
        self.zero.joints(self.last.registers)
    }

    /// The joints as they were reported last.
    pub(super) fn joint_state(&self, moving: bool) -> JointState {
        JointState::new(self.host.now_ns(), vector(&self.joints()), moving)
    }

    /// Reports to the streams where the arm is, and that its inputs have been seen up to then: anyone who waits for the inputs to be as new as the
    /// state finds them so.
    ///
    /// # Errors
    /// What the host says.
    pub(super) fn report_rest(&self) -> Result<JointState, PluginError> {
        let state = self.joint_state(false);
        self.host.emit("joints", &state)?;
        if !self.configuration.dead_reckoning {
            self.host.emit("inputs", &self.inputs_at_rest())?;
        }
        Ok(state)
    }

    /// The inputs as they were reported last, with nothing changed.
    pub(super) fn inputs_at_rest(&self) -> DigitalInputs {
        DigitalInputs {
            time_ns: self.host.now_ns(),
            levels: u64::from(self.last.inputs),
            joints: vector(&self.joints()),
            joints_half_width: JointVector::zeros(Joint::ALL.len()),
            ..DigitalInputs::default()
        }
    }

    /// The inputs changed somewhere between two poses: the middle of them, and half their distance each way.
    fn input_change(&self, before: &ControllerState, now: &ControllerState) -> DigitalInputs {
        let (from, to) = (self.zero.joints(before.registers), self.zero.joints(now.registers));
        let (mut middle, mut half_width) = (to, to);
        for ((middle, half_width), (from, to)) in
            middle.iter_mut().zip(&mut half_width).zip(from.iter().zip(to))
        {
            *middle = (from + to) / 2.0;
            *half_width = (to - from).abs() / 2.0;
        }
        DigitalInputs {
            changed: u64::from(before.inputs ^ now.inputs),
            joints: vector(&middle),
            joints_half_width: vector(&half_width),
            ..self.inputs_at_rest()
        }
    }

    /// Where the arm is, in words an operator can compare with what they see.
    pub(super) fn pose_in_words(&self) -> String {
        let values = self.joints();
        let words = Joint::ALL.into_iter().zip(values).map(|(joint, value)| match joint {
            Joint::Gripper => format!("gripper {value:.1} mm"),
            _ => format!("{} {:.1} deg", joint.name(), value.to_degrees()),
        });
        words.collect::<Vec<_>>().join(", ")
    }

    /// The error of registers that are not where the commands should have brought them.
    pub(super) fn miscounted(&self, sent: HalfSteps, before: HalfSteps) -> PluginError {
        let counted = self.last.registers.since(before);
        let motors = MOTOR_NAMES.into_iter().zip(counted.0.into_iter().zip(sent.0));
        let wrong = motors.filter(|(_, (counted, sent))| counted != sent);
        let words: Vec<String> =
            wrong.map(|(motor, (counted, sent))| format!("{motor} {counted} instead of {sent}")).collect();
        PluginError::Failed(format!(
            "the controller counted {} half-steps: a command was damaged on the line, or carried out in part; the arm is at {}",
            words.join(", "),
            self.pose_in_words()
        ))
    }
}

fn vector(joints: &Joints) -> JointVector {
    let mut vector = JointVector::zeros(joints.len());
    vector.as_mut_slice().copy_from_slice(joints);
    vector
}
