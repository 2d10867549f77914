//! The arm as a robot of plumb.

use std::time::Duration;

use plumb_plugin::{
    DigitalInputs, Host, JogState, JointDescription, JointState, JointUnit, JointVector, LogLevel, Motion,
    PluginError, Robot, RobotCapabilities, RobotDescription, Value,
};

use crate::configuration::Configuration;
use crate::controller_error::Consequence;
use crate::joints::{AXES, JOINTS, READY, is_plain};
use crate::monitor::{Monitor, MonitorError, MotionEnd, Taught, alike};
use crate::profile::Profile;

/// A joint that is to turn by less than this stays, deg: half of the last digit that is typed.
const STAYS: f64 = 0.000_5;
/// An arm that has arrived is this near to where it was sent, deg.
const ARRIVED_WITHIN: f64 = 0.05;
/// How often the pose is read until two readings agree.
const READINGS: usize = 5;
/// The pose from which POTCAL is begun reads at most this far from the ready position, deg.
const NEAR_READY: f64 = 15.0;
/// What brakes may take, and a control C on its way and its answer, ms.
const STOP_TIME_MS: u32 = 600;
/// Calibrations may take so long.
const CALIBRATION: Duration = Duration::from_secs(600);

/// A PUMA 560 at the end of its controller's terminal line.
#[derive(Debug)]
pub struct Puma {
    configuration: Configuration,
    host: Host,
    monitor: Monitor,
    /// Where the joints were read last, deg.
    last: [f64; AXES],
    /// Why the arm may not be moved, if so: a conversation failed, or the controller wants somebody.
    doubt: Option<String>,
    profile: Profile,
}

impl Robot for Puma {
    fn create(config: &Value, host: Host) -> Result<Self, PluginError> {
        let configuration = Configuration::read(config)?;
        let monitor = Monitor::open(&configuration).map_err(|error| error.plugin_error())?;
        let mut arm =
            Self { configuration, host, monitor, last: READY, doubt: None, profile: Profile::default() };
        arm.read(None)?;
        let text = format!(
            "PUMA 560 on {} at {} baud: {}",
            arm.configuration.port,
            arm.configuration.baud,
            arm.in_words()
        );
        arm.host.log(LogLevel::Info, &text);
        Ok(arm)
    }

    fn describe(&self) -> RobotDescription {
        let fraction = self.configuration.full_speed_percent / 100.0;
        let joints = JOINTS.iter().map(|joint| JointDescription {
            name: joint.name.to_owned(),
            unit: JointUnit::Radian,
            lower: joint.lower.to_radians(),
            upper: joint.upper.to_radians(),
            resolution: 0.01_f64.to_radians(),
            max_speed: (joint.top_speed * fraction).to_radians(),
            home: joint.ready.to_radians(),
        });
        RobotDescription {
            model: "Unimation PUMA 560, VAL-II".to_owned(),
            joints: joints.collect(),
            inputs: Vec::new(),
            outputs: Vec::new(),
            capabilities: RobotCapabilities {
                interruptible: true,
                stop_time_ms: STOP_TIME_MS,
                jog: true,
                only_pendant_ends_jog: false,
                set_zero: true,
            },
        }
    }

    fn activate(&mut self) -> Result<(), PluginError> {
        self.doubt = None;
        self.done(|monitor, _| monitor.start_over())?;
        self.read(None)?;
        if self.configuration.calibrate {
            let host = self.host.clone();
            let end = self.done(|monitor, _| monitor.calibrate(CALIBRATION, &mut || host.should_stop()))?;
            if end == MotionEnd::Stopped {
                return Err(PluginError::Stopped(
                    "CALIBRATE was stopped: the arm is not calibrated".to_owned(),
                ));
            }
            // Each joint has moved to its next index pulse.
            self.read(None)?;
        }
        Ok(())
    }

    fn deactivate(&mut self) -> Result<(), PluginError> {
        self.take_profile();
        if self.profile.commands > 0 {
            let text = format!("where the time went: {}", self.profile);
            self.host.log(LogLevel::Info, &text);
        }
        Ok(())
    }

    fn read_joints(&mut self) -> Result<JointState, PluginError> {
        self.read(None)?;
        self.come_to_rest()
    }

    fn move_joints(&mut self, motion: &Motion) -> Result<JointState, PluginError> {
        let target = self.target(motion)?;
        self.refuse_in_doubt()?;
        if self.host.should_stop() {
            return Err(PluginError::stopped());
        }
        if let Some(error) = self.done(|monitor, _| monitor.unrequested_error())? {
            let error = error.error();
            self.doubt = Some(error.text().to_owned());
            return Err(error);
        }
        let end = self.travel(&target, motion.speed_fraction)?;
        if end == MotionEnd::Stopped {
            self.read(None)?;
            self.come_to_rest()?;
            return Err(PluginError::Stopped(format!("stopped; the arm is at {}", self.in_words())));
        }
        self.read(Some(target))?;
        self.require_arrived(&target)?;
        self.take_profile();
        self.come_to_rest()
    }

    fn stop(&mut self) -> Result<(), PluginError> {
        // A move has sent the control C itself and waited for the prompt.
        Ok(())
    }

    fn read_inputs(&mut self) -> Result<DigitalInputs, PluginError> {
        Ok(self.inputs())
    }

    fn write_outputs(&mut self, levels: u64) -> Result<(), PluginError> {
        if levels == 0 {
            return Ok(());
        }
        Err(PluginError::Refused(format!("output levels {levels:#b}: this driver has no output lines")))
    }

    fn jog(&mut self, on: bool) -> Result<JogState, PluginError> {
        // The teach pendant drives beside the terminal; where it has brought the arm, the terminal says.
        self.read(None)?;
        Ok(JogState { state: self.come_to_rest()?, key: 0, finished: u32::from(!on) })
    }

    fn set_zero(&mut self, joints: &JointVector) -> Result<(), PluginError> {
        let requested = six(joints)?;
        let is_ready =
            requested.iter().zip(&READY).all(|(requested, ready)| (requested - ready).abs() < 0.01);
        if !is_ready {
            return Err(PluginError::Refused(
                "POTCAL knows one pose only, the ready position (0, -90, 90, 0, 0, 0): bring the arm to where that should be, and declare that".to_owned(),
            ));
        }
        self.refuse_in_doubt()?;
        self.read(None)?;
        if let Some((joint, value)) =
            JOINTS.iter().zip(&self.last).find(|(joint, value)| (*value - joint.ready).abs() > NEAR_READY)
        {
            return Err(PluginError::Refused(format!(
                "{} reads {value:.1} degrees, far from {:.0} in the ready position: POTCAL would drive it against its stop",
                joint.name, joint.ready
            )));
        }
        let host = self.host.clone();
        let end = self.done(|monitor, _| monitor.take_for_ready(CALIBRATION, &mut || host.should_stop()))?;
        if end == MotionEnd::Stopped {
            return Err(PluginError::Stopped("POTCAL was stopped; the zeros are as they were".to_owned()));
        }
        self.read(Some(READY))
    }
}

impl Puma {
    /// Where the time went since this was asked last, or since the beginning.
    pub fn take_time_profile(&mut self) -> Profile {
        self.take_profile();
        std::mem::take(&mut self.profile)
    }

    fn take_profile(&mut self) {
        let new = self.monitor.take_profile();
        let sum = &mut self.profile;
        sum.commands += new.commands;
        sum.sent += new.sent;
        sum.received += new.received;
        sum.line += new.line;
        sum.controller += new.controller;
        sum.motion += new.motion;
        sum.total += new.total;
    }

    /// Does something at the monitor. After an error that leaves open what the arm does, it is not moved until it is activated again.
    fn done<T>(
        &mut self,
        act: impl FnOnce(&mut Monitor, &[f64; AXES]) -> Result<T, MonitorError>,
    ) -> Result<T, PluginError> {
        act(&mut self.monitor, &self.last).map_err(|error| {
            let is_known = leaves_the_arm_known(&error);
            let error = error.plugin_error();
            if !is_known {
                self.doubt = Some(error.text().to_owned());
            }
            error
        })
    }

    fn refuse_in_doubt(&self) -> Result<(), PluginError> {
        match &self.doubt {
            None => Ok(()),
            Some(reason) => Err(PluginError::NotReady(format!(
                "the arm is not moved after this ({reason}): look where it is, then activate it again"
            ))),
        }
    }

    /// Reads where the joints are. A line without checksums can turn one digit into another: a reading as expected needs no second one; any other
    /// counts only when it comes twice.
    fn read(&mut self, expected: Option<[f64; AXES]>) -> Result<(), PluginError> {
        let mut former: Option<[f64; AXES]> = None;
        let mut failed = None;
        for _ in 0..READINGS {
            let now = match self.monitor.read(&expected.unwrap_or(self.last)) {
                Ok(now) => now,
                Err(MonitorError::Line(error))
                    if failed.is_none()
                        && error.plugin_error().status() == PluginError::Failed(String::new()).status() =>
                {
                    failed = Some(error);
                    continue;
                }
                Err(error) => return self.done(|_, _| Err(error)),
            };
            let again = |other: &[f64; AXES]| alike(&now, other);
            if expected.as_ref().is_some_and(again) || former.as_ref().is_some_and(again) {
                self.last = now;
                return Ok(());
            }
            former = Some(now);
        }
        let text = format!(
            "{READINGS} readings of the joints and no two alike: does something else move the arm? Check the cable, too"
        );
        self.doubt = Some(text.clone());
        Err(PluginError::Failed(text))
    }

    /// Goes to a pose, degrees. Before anything moves the arm is known to be where it was read last: where a point is taught the controller shows
    /// it, else it is read.
    fn travel(&mut self, target: &[f64; AXES], fraction: f64) -> Result<MotionEnd, PluginError> {
        let percent = speed_percent(fraction, self.configuration.full_speed_percent);
        for _ in 0..2 {
            let way = Way::between(&self.last, target);
            let moved = match way {
                Way::None => {
                    self.read(Some(self.last))?;
                    // Somebody has moved it meanwhile: there is a way after all.
                    (Way::between(&self.last, target) == Way::None).then_some(MotionEnd::Arrived)
                }
                Way::Ready => {
                    self.read(Some(self.last))?;
                    Some(self.make_ready(target, percent)?)
                }
                Way::Joints { together, alone } if together.iter().any(Option::is_some) => {
                    self.go_by_point(target, &together, &alone, percent)?
                }
                Way::Joints { .. } => {
                    self.read(Some(self.last))?;
                    match Way::between(&self.last, target) {
                        Way::Joints { together, alone } if together.iter().all(Option::is_none) => {
                            Some(self.drive_each(&alone, percent)?)
                        }
                        _ => None,
                    }
                }
            };
            if let Some(end) = moved {
                return Ok(end);
            }
        }
        let text = "the arm is not where it was read a moment ago: does somebody drive it with the pendant?"
            .to_owned();
        self.doubt = Some(text.clone());
        Err(PluginError::Failed(text))
    }

    fn make_ready(&mut self, target: &[f64; AXES], percent: f64) -> Result<MotionEnd, PluginError> {
        let (within, host) = (within(&self.last, target, percent), self.host.clone());
        self.done(|monitor, _| monitor.set_speed(percent))?;
        self.done(|monitor, _| monitor.ready(within, &mut || host.should_stop()))
    }

    /// Several joints at once, and then those that have to be driven alone; none if the arm was not where it was thought to: then it has been
    /// read again, and nothing has moved.
    fn go_by_point(
        &mut self,
        target: &[f64; AXES],
        together: &[Option<f64>; AXES],
        alone: &[(usize, f64)],
        percent: f64,
    ) -> Result<Option<MotionEnd>, PluginError> {
        let (within, host) = (within(&self.last, target, percent), self.host.clone());
        self.done(|monitor, _| monitor.set_speed(percent))?;
        if self.done(|monitor, near| monitor.teach_point(together, near))? == Taught::Elsewhere {
            self.read(None)?;
            return Ok(None);
        }
        match self.done(|monitor, _| monitor.move_to_point(within, &mut || host.should_stop()))? {
            MotionEnd::Stopped => Ok(Some(MotionEnd::Stopped)),
            MotionEnd::Arrived => self.drive_each(alone, percent).map(Some),
        }
    }

    /// One joint after the other, by so many degrees.
    fn drive_each(&mut self, joints: &[(usize, f64)], percent: f64) -> Result<MotionEnd, PluginError> {
        let host = self.host.clone();
        for (joint, by) in joints {
            let within = within(&self.last, &turned(self.last, *joint, *by), percent);
            let end = self
                .done(|monitor, _| monitor.drive(*joint, *by, percent, within, &mut || host.should_stop()))?;
            if end == MotionEnd::Stopped {
                return Ok(end);
            }
        }
        Ok(MotionEnd::Arrived)
    }

    /// Where a motion leads, degrees.
    fn target(&self, motion: &Motion) -> Result<[f64; AXES], PluginError> {
        let given = six(&motion.target)?;
        let mut target = self.last;
        for (index, ((target, given), joint)) in target.iter_mut().zip(given).zip(&JOINTS).enumerate() {
            if !motion.moves(index) {
                continue;
            }
            if !given.is_finite() {
                return Err(PluginError::Refused(format!(
                    "the value for {} is {given}; give a number",
                    joint.name
                )));
            }
            *target = if motion.relative != 0 { *target + given } else { given };
            if !(joint.lower - 0.005..=joint.upper + 0.005).contains(target) {
                return Err(PluginError::OutOfRange(format!(
                    "{} would go to {target:.2} degrees; it goes from {:.0} to {:.0}",
                    joint.name, joint.lower, joint.upper
                )));
            }
        }
        if !(motion.speed_fraction > 0.0 && motion.speed_fraction <= 1.0) {
            return Err(PluginError::Refused(format!(
                "the speed is {} of the full speed; give more than 0 and at most 1",
                motion.speed_fraction
            )));
        }
        Ok(target)
    }

    fn require_arrived(&mut self, target: &[f64; AXES]) -> Result<(), PluginError> {
        let off = JOINTS
            .iter()
            .zip(target.iter().zip(&self.last))
            .find(|(_, (a, b))| (*a - *b).abs() > ARRIVED_WITHIN);
        let Some((joint, (target, actual))) = off else { return Ok(()) };
        let text = format!(
            "{} was sent to {target:.2} and is at {actual:.2} degrees, although the controller reported that it had arrived: did somebody drive it with the pendant?",
            joint.name
        );
        self.doubt = Some(text.clone());
        Err(PluginError::Failed(text))
    }

    /// Reports to the streams that the arm is at rest, and where.
    fn come_to_rest(&mut self) -> Result<JointState, PluginError> {
        let state = JointState::new(self.host.now_ns(), self.vector(), false);
        self.host.emit("joints", &state)?;
        self.host.emit("inputs", &self.inputs())?;
        Ok(state)
    }

    fn inputs(&self) -> DigitalInputs {
        DigitalInputs {
            time_ns: self.host.now_ns(),
            joints: self.vector(),
            joints_half_width: JointVector::zeros(AXES),
            ..DigitalInputs::default()
        }
    }

    fn vector(&self) -> JointVector {
        let mut vector = JointVector::zeros(AXES);
        for (index, degrees) in self.last.iter().enumerate() {
            vector.set(index, degrees.to_radians());
        }
        vector
    }

    fn in_words(&self) -> String {
        let positions =
            JOINTS.iter().zip(&self.last).map(|(joint, value)| format!("{} {value:.2}", joint.name));
        format!("{} deg", positions.collect::<Vec<_>>().join(", "))
    }
}

/// How the arm gets from one pose to another.
#[derive(Clone, Debug, PartialEq)]
enum Way {
    /// It is there.
    None,
    /// By the command for the ready position.
    Ready,
    /// By a point for the joints that it can hold, then the others (from 0) by so many degrees, one at a time.
    Joints { together: [Option<f64>; AXES], alone: Vec<(usize, f64)> },
}

impl Way {
    fn between(here: &[f64; AXES], target: &[f64; AXES]) -> Self {
        let ways = here.iter().zip(target).enumerate();
        let moving: Vec<(usize, f64, f64)> = ways
            .filter(|(_, (here, target))| (*target - *here).abs() > STAYS)
            .map(|(joint, (here, target))| (joint, *target, target - here))
            .collect();
        if moving.is_empty() {
            return Self::None;
        }
        if moving.len() > 1 && target.iter().zip(&READY).all(|(target, ready)| (target - ready).abs() < STAYS)
        {
            return Self::Ready;
        }
        let (mut together, mut alone) = ([None; AXES], Vec::new());
        for (joint, target, by) in &moving {
            // What the terminal could take for a whole turn more is driven there by its difference.
            let plain = JOINTS.get(*joint).is_some_and(|facts| is_plain(facts, *target));
            match together.get_mut(*joint) {
                Some(kept) if plain && moving.len() > 1 => *kept = Some(*target),
                _ => alone.push((*joint, *by)),
            }
        }
        Self::Joints { together, alone }
    }
}

/// A pose with one joint turned by so many degrees.
fn turned(mut pose: [f64; AXES], joint: usize, by: f64) -> [f64; AXES] {
    if let Some(coordinate) = pose.get_mut(joint) {
        *coordinate += by;
    }
    pose
}

/// How long a motion may take: three times what it should, and some seconds.
fn within(here: &[f64; AXES], target: &[f64; AXES], percent: f64) -> Duration {
    let slowest =
        JOINTS.iter().zip(here.iter().zip(target)).fold(0.0, |longest: f64, (joint, (here, target))| {
            longest.max((target - here).abs() / (joint.top_speed * percent / 100.0))
        });
    Duration::from_secs_f64((slowest * 3.0 + 10.0).min(7200.0))
}

/// The six values of a joint vector that is meant for this arm, degrees.
fn six(joints: &JointVector) -> Result<[f64; AXES], PluginError> {
    let values: [f64; AXES] = joints.as_slice().try_into().map_err(|_| {
        let names = JOINTS.map(|joint| joint.name).join(", ");
        PluginError::Refused(format!("{} joint values given; this arm has 6: {names}", joints.len()))
    })?;
    Ok(values.map(f64::to_degrees))
}

/// Whether it is known after an error what the arm does: the controller refused a command, and nothing moved.
fn leaves_the_arm_known(error: &MonitorError) -> bool {
    match error {
        MonitorError::ControllerError(error) => {
            matches!(error.meaning().consequence, Consequence::OutOfRange | Consequence::Refused)
        }
        _ => false,
    }
}

/// The SPEED for a fraction of the full speed, in hundredths of a percent, and never none at all.
fn speed_percent(fraction: f64, full_speed_percent: f64) -> f64 {
    ((fraction * full_speed_percent * 100.0).round() / 100.0).max(0.01)
}

#[cfg(test)]
mod played;
#[cfg(test)]
mod played_tests;
#[cfg(test)]
mod tests;
