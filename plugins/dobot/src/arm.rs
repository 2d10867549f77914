//! The arm as a robot of plumb.

use std::time::Duration;

use plumb_plugin::{
    Host, JointState, LogLevel, Motion, PluginError, Robot, RobotCapabilities, RobotDescription, Value,
};

use crate::configuration::Configuration;
use crate::controller::Controller;
use crate::joints::{self, Angles};
use crate::travel::{self, End, Travel};

/// What a stop may take, ms: a command under way three times without an answer, stopping, and two readings that agree.
const STOP_TIME_MS: u32 = 1500;
/// How long an arm that is read at rest may still settle.
const SETTLES_WITHIN: Duration = Duration::from_millis(300);

/// A Dobot Magician.
#[derive(Debug)]
pub struct DobotArm {
    configuration: Configuration,
    host: Host,
    controller: Controller,
    /// Why the arm may not be moved, if so.
    doubt: Option<String>,
}

impl Robot for DobotArm {
    fn create(config: &Value, host: Host) -> Result<Self, PluginError> {
        let configuration = Configuration::read(config)?;
        let mut controller = Controller::open(&configuration.port, configuration.reply_within)?;
        let version = controller.version()?;
        let angles = travel::look(&mut controller)?;
        let text = format!(
            "Dobot Magician on {}, program {version}, at {}. Whether it was homed since it was switched on it cannot say",
            configuration.port,
            joints::in_words(&angles, joints::count(&configuration))
        );
        host.log(LogLevel::Info, &text);
        Ok(Self { configuration, host, controller, doubt: Some("it was not activated yet".to_owned()) })
    }

    fn describe(&self) -> RobotDescription {
        RobotDescription {
            model: "Dobot Magician".to_owned(),
            joints: joints::descriptions(&self.configuration),
            inputs: Vec::new(),
            outputs: Vec::new(),
            capabilities: RobotCapabilities {
                interruptible: true,
                stop_time_ms: STOP_TIME_MS,
                ..RobotCapabilities::default()
            },
        }
    }

    fn activate(&mut self) -> Result<(), PluginError> {
        // Nothing that another program left in the queue may begin: it is emptied before it runs.
        travel::halt(&mut self.controller)?;
        self.clear_alarms_of_reach()?;
        self.controller.set_speeds(self.configuration.full_speed, self.configuration.acceleration)?;
        self.controller.start_queue()?;
        self.doubt = None;
        Ok(())
    }

    fn deactivate(&mut self) -> Result<(), PluginError> {
        let counts = self.controller.counts();
        if counts.lost > 0 || counts.damaged > 0 {
            let text = format!(
                "of {} commands {} were without an answer and {} answers came damaged: check the cable",
                counts.sent, counts.lost, counts.damaged
            );
            self.host.log(LogLevel::Warn, &text);
        }
        Ok(())
    }

    fn read_joints(&mut self) -> Result<JointState, PluginError> {
        let (angles, at_rest) = travel::look_at_rest(&mut self.controller, SETTLES_WITHIN)?;
        self.report(&angles, !at_rest)
    }

    fn move_joints(&mut self, motion: &Motion) -> Result<JointState, PluginError> {
        if self.host.should_stop() {
            return Err(PluginError::stopped());
        }
        if let Some(reason) = &self.doubt {
            return Err(PluginError::NotReady(format!(
                "the arm is not moved after this ({reason}): look where it is, then activate it again"
            )));
        }
        let made = self.travel(motion);
        match &made {
            Ok(_) | Err(PluginError::OutOfRange(_) | PluginError::Refused(_)) => {}
            // The queue of an arm that was stopped is stopped until it is activated.
            Err(error) => self.doubt = Some(error.text().to_owned()),
        }
        made
    }

    fn stop(&mut self) -> Result<(), PluginError> {
        // A move stops its arm itself before it returns; what moves now was begun by somebody else.
        self.doubt = Some("it was stopped".to_owned());
        travel::halt(&mut self.controller).map(drop)
    }
}

impl DobotArm {
    fn travel(&mut self, motion: &Motion) -> Result<JointState, PluginError> {
        let (here, at_rest) = travel::look_at_rest(&mut self.controller, SETTLES_WITHIN)?;
        if !at_rest {
            return Err(PluginError::NotReady("the arm moves, and not by this program".to_owned()));
        }
        let target = self.target(motion, &here)?;
        let host = self.host.clone();
        let count = joints::count(&self.configuration);
        let report = |angles: &Angles| {
            host.emit("joints", &JointState::new(host.now_ns(), joints::vector(angles, count), true))
        };
        let end = Travel {
            controller: &mut self.controller,
            host: &self.host,
            configuration: &self.configuration,
            target,
            speed_fraction: motion.speed_fraction,
        }
        .make(&here, &report)?;
        match end {
            End::Arrived => self.read_joints(),
            End::Stopped(angles) => {
                self.report(&angles, false)?;
                Err(PluginError::Stopped(format!(
                    "stopped; the arm holds at {}",
                    joints::in_words(&angles, count)
                )))
            }
        }
    }

    /// Where the joints go, deg; one that takes no part stays where it is.
    fn target(&self, motion: &Motion, here: &Angles) -> Result<Angles, PluginError> {
        if !(motion.speed_fraction > 0.0 && motion.speed_fraction <= 1.0) {
            return Err(PluginError::Refused(format!(
                "the speed is {} of the full speed; give more than 0 and at most 1",
                motion.speed_fraction
            )));
        }
        let mut target = *here;
        for (index, (requested, (name, _))) in target.iter_mut().zip(joints::JOINTS).enumerate() {
            let Some(given) = motion.target.get(index).filter(|_| motion.moves(index)) else { continue };
            if !given.is_finite() {
                return Err(PluginError::Refused(format!("the value for {name} is {given}; give a number")));
            }
            let before = if motion.relative != 0 { *requested } else { 0.0 };
            *requested = before + given.to_degrees();
        }
        joints::check_reach(&target, &self.configuration)?;
        Ok(target)
    }

    /// Reports to the stream where the arm is.
    fn report(&self, angles: &Angles, moving: bool) -> Result<JointState, PluginError> {
        let vector = joints::vector(angles, joints::count(&self.configuration));
        let state = JointState::new(self.host.now_ns(), vector, moving);
        self.host.emit("joints", &state)?;
        Ok(state)
    }

    /// Alarms that only say that the arm could not go somewhere are cleared; any other stays and is reported.
    fn clear_alarms_of_reach(&mut self) -> Result<(), PluginError> {
        let alarms = self.controller.alarms()?;
        if !alarms.are_none() && alarms.are_of_reach() {
            self.host.log(LogLevel::Warn, &format!("cleared: {}", alarms.in_words()));
            self.controller.clear_alarms()?;
        }
        let left = self.controller.alarms()?;
        match left.are_none() {
            true => Ok(()),
            false => Err(PluginError::NotReady(left.in_words())),
        }
    }
}
