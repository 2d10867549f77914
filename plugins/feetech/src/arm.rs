//! The arm as a robot of plumb.

use std::path::PathBuf;

use plumb_plugin::{
    DigitalInputs, Host, JointDescription, JointState, JointUnit, JointVector, LogLevel, Motion, MotorState,
    PluginError, Robot, RobotCapabilities, RobotDescription, Value,
};

use crate::calibration::{self, Calibration, Kept};
use crate::configuration::Configuration;
use crate::motion::{Direction, acceleration_in_units};
use crate::servo::{MIDDLE, STEP_DEG, STEPS_A_TURN, ServoState, motor_state};
use crate::servos::{Joint, Servos};
use crate::travel::{End, Pace, Travel};
use crate::zeros::{Pose, Verdict, judge};

/// What a stop may take: a question three times without an answer, the goals, and the servos' own slowing down, ms.
const STOP_TIME_MS: u32 = 700;
/// A joint may be commanded beyond its limits by this, deg: half a step, rounded up.
const BESIDE_LIMITS: f64 = 0.05;

/// An arm of STS servos on one bus.
#[derive(Debug)]
pub struct FeetechArm {
    configuration: Configuration,
    host: Host,
    servos: Servos,
    /// Where the joints was when their angles were declared last.
    declared: Vec<Option<Pose>>,
    /// Why the arm may not be moved, if so.
    doubt: Option<String>,
}

impl Robot for FeetechArm {
    fn create(config: &Value, host: Host) -> Result<Self, PluginError> {
        let configuration = Configuration::read(config)?;
        let mut servos = Servos::open(&configuration)?;
        if let Some(file) = &configuration.calibration {
            let kept = calibration::read(file).map_err(|error| PluginError::Refused(error.to_string()))?;
            servos.follow(&kept)?;
        }
        for joint in &servos.joints {
            if let Some(text) = cut_by_the_servo(joint) {
                host.log(LogLevel::Warn, &text);
            }
        }
        let declared = vec![None; servos.joints.len()];
        let arm = Self { configuration, host, servos, declared, doubt: None };
        let text = format!(
            "{} servos on {} at {} baud",
            arm.servos.joints.len(),
            arm.configuration.port,
            arm.configuration.baud
        );
        arm.host.log(LogLevel::Info, &text);
        Ok(arm)
    }

    fn describe(&self) -> RobotDescription {
        let step = STEP_DEG * f64::from(self.configuration.settles_within);
        let joints = self.configuration.joints.iter().map(|joint| JointDescription {
            name: joint.name.clone(),
            unit: JointUnit::Radian,
            lower: joint.from_deg.to_radians(),
            upper: joint.to_deg.to_radians(),
            resolution: step.to_radians(),
            max_speed: self.configuration.full_speed.to_radians(),
            home: 0.0_f64.clamp(joint.from_deg, joint.to_deg).to_radians(),
        });
        RobotDescription {
            model: "arm of Feetech STS servos".to_owned(),
            joints: joints.collect(),
            inputs: Vec::new(),
            outputs: Vec::new(),
            capabilities: RobotCapabilities {
                interruptible: true,
                stop_time_ms: STOP_TIME_MS,
                jog: false,
                only_pendant_ends_jog: false,
                set_zero: true,
            },
        }
    }

    fn activate(&mut self) -> Result<(), PluginError> {
        let states = self.servos.states()?;
        self.servos.switch_torque(true)?;
        // Switching torque on takes an overload back; what is still wrong after that stays wrong.
        let after = self.servos.states()?;
        if let Some(fault) = self.servos.fault(&after) {
            return Err(PluginError::NotReady(fault));
        }
        if let Some(fault) = self.servos.fault(&states) {
            self.host.log(LogLevel::Warn, &format!("was before it was activated: {fault}"));
        }
        self.doubt = None;
        Ok(())
    }

    fn deactivate(&mut self) -> Result<(), PluginError> {
        let counts = self.servos.bus.counts;
        if counts.lost > 0 || counts.damaged > 0 {
            let text = format!(
                "of {} packets {} answers were lost and {} came damaged: check the bus cable",
                counts.packets, counts.lost, counts.damaged
            );
            self.host.log(LogLevel::Warn, &text);
        }
        match self.configuration.release_at_end {
            true => self.servos.switch_torque(false),
            false => Ok(()),
        }
    }

    fn read_joints(&mut self) -> Result<JointState, PluginError> {
        let (states, moving) = self.servos.resting()?;
        self.report(&states, moving)
    }

    fn move_joints(&mut self, motion: &Motion) -> Result<JointState, PluginError> {
        if let Some(reason) = &self.doubt {
            return Err(PluginError::NotReady(format!(
                "the arm is not moved after this ({reason}): look where it is, then activate it again"
            )));
        }
        if self.host.should_stop() {
            return Err(PluginError::stopped());
        }
        let made = self.travel(motion);
        if let Err(error) = &made
            && !matches!(
                error,
                PluginError::OutOfRange(_) | PluginError::Refused(_) | PluginError::Stopped(_)
            )
        {
            self.doubt = Some(error.text().to_owned());
        }
        made
    }

    fn stop(&mut self) -> Result<(), PluginError> {
        // A move holds its servos itself before it returns; what moves now was sent by somebody else, or sinks.
        let states = self.servos.states()?;
        let moving: Vec<usize> =
            states.iter().enumerate().filter(|(_, state)| state.moving).map(|(index, _)| index).collect();
        if moving.is_empty() { Ok(()) } else { self.servos.hold(&moving, &states) }
    }

    fn read_inputs(&mut self) -> Result<DigitalInputs, PluginError> {
        Err(PluginError::unsupported("read input lines: it has none"))
    }

    fn set_zero(&mut self, joints: &JointVector) -> Result<(), PluginError> {
        let declared = self.degrees_of(joints)?;
        let (states, moving) = self.servos.resting()?;
        if moving {
            return Err(PluginError::NotReady("the arm moves: a zero is set at rest".to_owned()));
        }
        let now = self.poses(&declared, &states);
        let directions = self.directions_by(&now)?;
        for (index, (pose, direction)) in now.iter().zip(&directions).enumerate() {
            let Some(joint) = self.servos.joints.get_mut(index) else { continue };
            let turned = joint.direction != *direction;
            if turned {
                let text = format!(
                    "{}: its servo counts the other way than it was taken to; from now on it is taken so",
                    joint.setting.name
                );
                self.host.log(LogLevel::Info, &text);
            }
            joint.direction = *direction;
            if pose.stated || turned {
                self.servos.take_for(index, direction.step(pose.degrees))?;
            }
            if let Some(kept) = self.declared.get_mut(index)
                && (pose.stated || kept.is_none())
            {
                *kept = Some(*pose);
            }
        }
        self.keep_calibration()
    }

    fn read_motors(&mut self) -> Result<MotorState, PluginError> {
        let states = self.servos.states()?;
        Ok(motor_state(self.host.now_ns(), &states))
    }
}

impl FeetechArm {
    fn travel(&mut self, motion: &Motion) -> Result<JointState, PluginError> {
        let (here, _) = self.servos.resting()?;
        if let Some(fault) = self.servos.fault(&here) {
            return Err(PluginError::NotReady(fault));
        }
        let targets = self.targets(motion, &here)?;
        let speed = self.configuration.full_speed / STEP_DEG * motion.speed_fraction;
        let pace = Pace {
            speed: speed.max(1.0),
            acceleration: acceleration_in_units(self.configuration.acceleration),
            settles_within: self.configuration.settles_within,
        };
        let host = self.host.clone();
        let report = |servos: &Servos, states: &[ServoState]| {
            host.emit("joints", &JointState::new(host.now_ns(), vector(&servos.joints, states), true))
        };
        let end =
            Travel { servos: &mut self.servos, host: &self.host, pace, targets }.make(&here, &report)?;
        let (states, moving) = self.servos.resting()?;
        let state = self.report(&states, moving)?;
        match end {
            End::Arrived => Ok(state),
            End::Stopped => {
                Err(PluginError::Stopped(format!("stopped; the arm holds at {}", self.in_words(&states))))
            }
        }
    }

    /// The joints that move, with their targets in steps.
    fn targets(&self, motion: &Motion, here: &[ServoState]) -> Result<Vec<(usize, i32)>, PluginError> {
        if !(motion.speed_fraction > 0.0 && motion.speed_fraction <= 1.0) {
            return Err(PluginError::Refused(format!(
                "the speed is {} of the full speed; give more than 0 and at most 1",
                motion.speed_fraction
            )));
        }
        let mut targets = Vec::new();
        for (index, (joint, state)) in self.servos.joints.iter().zip(here).enumerate() {
            let Some(given) = motion.target.get(index).filter(|_| motion.moves(index)) else { continue };
            let (name, limits) = (&joint.setting.name, [joint.setting.from_deg, joint.setting.to_deg]);
            if !given.is_finite() {
                return Err(PluginError::Refused(format!("the value for {name} is {given}; give a number")));
            }
            let current = joint.direction.degrees(state.position);
            let requested =
                if motion.relative != 0 { current + given.to_degrees() } else { given.to_degrees() };
            if requested < limits[0] - BESIDE_LIMITS || requested > limits[1] + BESIDE_LIMITS {
                return Err(PluginError::OutOfRange(format!(
                    "{name} would go to {requested:.2} degrees; it goes from {} to {}",
                    limits[0], limits[1]
                )));
            }
            targets.push((index, joint.direction.step(requested).clamp(0, STEPS_A_TURN - 1)));
        }
        Ok(targets)
    }

    /// Reports to the stream where the arm is.
    fn report(&self, states: &[ServoState], moving: bool) -> Result<JointState, PluginError> {
        let state = JointState::new(self.host.now_ns(), vector(&self.servos.joints, states), moving);
        self.host.emit("joints", &state)?;
        Ok(state)
    }

    fn in_words(&self, states: &[ServoState]) -> String {
        let position = |(joint, state): (&Joint, &ServoState)| {
            format!("{} {:.1}", joint.setting.name, joint.direction.degrees(state.position))
        };
        let positions: Vec<String> = self.servos.joints.iter().zip(states).map(position).collect();
        format!("{} degrees", positions.join(", "))
    }

    /// The declared angles, deg.
    fn degrees_of(&self, joints: &JointVector) -> Result<Vec<f64>, PluginError> {
        if joints.len() != self.servos.joints.len() {
            return Err(PluginError::Refused(format!(
                "{} joint values given; this arm has {}",
                joints.len(),
                self.servos.joints.len()
            )));
        }
        let degrees: Vec<f64> = joints.as_slice().iter().map(|value| value.to_degrees()).collect();
        for (joint, degrees) in self.servos.joints.iter().zip(&degrees) {
            let setting = &joint.setting;
            if !(*degrees >= setting.from_deg - BESIDE_LIMITS && *degrees <= setting.to_deg + BESIDE_LIMITS) {
                return Err(PluginError::OutOfRange(format!(
                    "{} cannot be at {degrees:.2} degrees; it goes from {} to {}",
                    setting.name, setting.from_deg, setting.to_deg
                )));
            }
        }
        Ok(degrees)
    }

    /// Where the joints are by their encoders, and what they are declared to be.
    fn poses(&self, declared: &[f64], states: &[ServoState]) -> Vec<Pose> {
        let pose = |((joint, state), degrees): ((&Joint, &ServoState), &f64)| Pose {
            encoder: (state.position + joint.settings.homing_offset).rem_euclid(STEPS_A_TURN),
            degrees: *degrees,
            stated: (degrees - joint.direction.degrees(state.position)).abs() > STEP_DEG / 2.0,
        };
        self.servos.joints.iter().zip(states).zip(declared).map(pose).collect()
    }

    /// The direction of each servo, by this pose and the one declared before.
    fn directions_by(&mut self, now: &[Pose]) -> Result<Vec<Direction>, PluginError> {
        let mut directions = Vec::with_capacity(now.len());
        for ((joint, before), now) in self.servos.joints.iter().zip(&mut self.declared).zip(now) {
            let verdict = before.map_or(Verdict::Same, |before| judge(joint.direction, &before, now));
            directions.push(match verdict {
                Verdict::Same => joint.direction,
                Verdict::Reversed => joint.direction.other(),
                Verdict::Neither(servo, declared) => {
                    *before = None;
                    return Err(PluginError::Refused(format!(
                        "{}: since its angle was declared last its servo has turned by {servo:.1} degrees, and the declared angle by {declared:.1}: \
                         neither direction fits. Nothing was changed. Is it this joint's servo, and was it read well? Declared once more it is taken as it is",
                        joint.setting.name
                    )));
                }
            });
        }
        Ok(directions)
    }

    /// Writes the calibration file, where the cell names one.
    fn keep_calibration(&self) -> Result<(), PluginError> {
        let Some(file) = &self.configuration.calibration else { return Ok(()) };
        let entry = |joint: &Joint| {
            let ends = [joint.setting.from_deg, joint.setting.to_deg].map(|end| joint.direction.step(end));
            let kept = Kept {
                id: joint.setting.servo,
                drive_mode: u8::from(joint.direction == Direction::Reversed),
                homing_offset: joint.settings.homing_offset,
                range_min: ends.into_iter().min().unwrap_or(MIDDLE),
                range_max: ends.into_iter().max().unwrap_or(MIDDLE),
            };
            (joint.setting.name.clone(), kept)
        };
        let calibration: Calibration = self.servos.joints.iter().map(entry).collect();
        calibration::write(&PathBuf::from(file), &calibration)
            .map_err(|error| PluginError::Failed(error.to_string()))
    }
}

/// What a message to the log says of a servo whose own limits lie within those of the cell file.
fn cut_by_the_servo(joint: &Joint) -> Option<String> {
    let (lowest, highest) = (i32::from(joint.settings.lowest_goal), i32::from(joint.settings.highest_goal));
    // Both 0: it turns without end.
    let is_cut = |degrees: f64| {
        !(lowest..=highest).contains(&joint.direction.step(degrees).clamp(0, STEPS_A_TURN - 1))
    };
    let cut =
        (lowest, highest) != (0, 0) && [joint.setting.from_deg, joint.setting.to_deg].into_iter().any(is_cut);
    cut.then(|| {
        let mut ends = [lowest, highest].map(|step| joint.direction.degrees(step));
        ends.sort_by(f64::total_cmp);
        format!(
            "{}: the servo itself takes goals from {:.1} to {:.1} degrees (registers 9 and 11), less than the cell file gives it",
            joint.setting.name, ends[0], ends[1]
        )
    })
}

fn vector(joints: &[Joint], states: &[ServoState]) -> JointVector {
    let mut vector = JointVector::zeros(joints.len());
    for (index, (joint, state)) in joints.iter().zip(states).enumerate() {
        vector.set(index, joint.direction.degrees(state.position).to_radians());
    }
    vector
}
