//! The arm as a robot of plumb.

mod description;
mod hand_control;
mod observation;
mod setting_up;
mod travel;

use std::time::{Duration, Instant};

use plumb_plugin::{
    DigitalInputs, Host, JogState, JointState, JointVector, LogLevel, Motion, PluginError, Robot,
    RobotDescription, Value,
};

use crate::configuration::{Configuration, PendantMode};
use crate::controller::Controller;
use crate::cutting::Slowness;
use crate::drive::{HalfSteps, Joint, Joints, RegisterZero};
use crate::protocol::ControllerState;
use crate::reply_line::ReplyLine;
use crate::speed_code::SpeedCode;

/// How long an arm that was read without a fault is taken to be as it did then, when it is activated.
const STILL_SO: Duration = Duration::from_millis(300);

/// The half-steps a second that the slowest motor, the shoulder's, is rated for without a load: 0.36 rad/s of 7072 half-steps a turn.
const RATED: f64 = 405.0;

/// The characters of the longest reply. The controller pauses between them where it is commanded to; that it does so for milliseconds is assumed.
const LONGEST_REPLY: u64 = 50;

/// A TeachMover on its serial line.
#[derive(Debug)]
pub struct TeachMover {
    configuration: Configuration,
    host: Host,
    controller: Controller,
    /// What the registers mean.
    zero: RegisterZero,
    /// How much longer than expected the motors take.
    slowness: Slowness,
    /// What the controller reported last.
    last: ControllerState,
    /// When it did.
    read_at: Instant,
    /// Whether the STOP key has been pressed and no move has been refused for it yet.
    stop_key: bool,
    mode: Mode,
}

/// Whether the arm may be moved.
#[derive(Debug)]
enum Mode {
    /// It may.
    Ready,
    /// A conversation failed, so what the arm did is not known: the operator looks at it and activates it again. Why.
    Doubtful(String),
    /// The pendant has it: the operator drives it there, or the taught program runs.
    AtThePendant(PendantMode),
    /// That has ended, and nobody has asked for the arm back yet.
    GivenBack,
}

impl Robot for TeachMover {
    fn create(config: &Value, host: Host) -> Result<Self, PluginError> {
        let configuration = Configuration::read(config)?;
        let line = ReplyLine::open(&configuration.port, configuration.baud)?;
        let reply_within_ms = u64::from(configuration.reply_within_ms);
        let pauses_ms = u64::from(configuration.reply_delay.unwrap_or(0)) * LONGEST_REPLY;
        let reply_limit = Duration::from_millis(reply_within_ms + pauses_ms);
        let controller =
            Controller::new(line, configuration.recognition, reply_limit).with_senses(configuration.senses);
        let controller =
            if configuration.dead_reckoning { controller.by_dead_reckoning() } else { controller };
        let mut arm = Self {
            zero: configuration.zero,
            configuration,
            host,
            controller,
            slowness: Slowness::default(),
            last: ControllerState::default(),
            read_at: Instant::now(),
            stop_key: false,
            mode: Mode::Ready,
        };
        arm.controller.resynchronise()?;
        arm.set_up()?;
        arm.last = arm.first_reading()?;
        let baud = arm.configuration.baud;
        let text =
            format!("TeachMover on {} at {baud} baud: {}", arm.configuration.port, arm.pose_in_words());
        arm.host.log(LogLevel::Info, &text);
        let rate = arm.configuration.full_speed.rate();
        if rate > RATED {
            let text = format!(
                "full_speed_code {} makes {rate:.0} half-steps a second; without a load the shoulder follows {RATED:.0} at most: motors may lose steps, and nothing notices",
                arm.configuration.full_speed.number()
            );
            arm.host.log(LogLevel::Warn, &text);
        }
        Ok(arm)
    }

    fn describe(&self) -> RobotDescription {
        self.description()
    }

    fn activate(&mut self) -> Result<(), PluginError> {
        self.refuse_at_the_pendant()?;
        // On a line this slow, what has just been read is not read again.
        if !matches!(self.mode, Mode::Ready)
            || self.configuration.dead_reckoning
            || self.read_at.elapsed() > STILL_SO
        {
            self.controller.resynchronise()?;
            self.last = self.read_twice_alike(None)?;
        }
        self.slowness = Slowness::default();
        self.stop_key = false;
        self.mode = Mode::Ready;
        Ok(())
    }

    fn read_joints(&mut self) -> Result<JointState, PluginError> {
        self.refuse_at_the_pendant()?;
        self.observe(None)?;
        self.report_rest()
    }

    fn move_joints(&mut self, motion: &Motion) -> Result<JointState, PluginError> {
        self.refuse_at_the_pendant()?;
        if let Mode::Doubtful(reason) = &self.mode {
            return Err(PluginError::NotReady(format!(
                "the arm is not moved after a failed conversation ({reason}): look where it is, then activate it again"
            )));
        }
        if self.host.should_stop() {
            return Err(PluginError::stopped());
        }
        self.mode = Mode::Ready;
        let moved = self.travel(motion);
        if let Err(error) = &moved {
            self.doubt_after(error);
        }
        moved
    }

    fn stop(&mut self) -> Result<(), PluginError> {
        // A piece of a move ends by itself within the stop time, and no other is begun: there is nothing to send.
        self.refuse_at_the_pendant()
    }

    fn read_inputs(&mut self) -> Result<DigitalInputs, PluginError> {
        self.refuse_at_the_pendant()?;
        if self.configuration.dead_reckoning {
            return Err(PluginError::Unsupported(
                "by dead reckoning there are no inputs: @READ reports them, and this controller does not know it".to_owned(),
            ));
        }
        self.observe(None)?;
        let inputs = self.inputs_at_rest();
        self.host.emit("inputs", &inputs)?;
        Ok(inputs)
    }

    fn write_outputs(&mut self, levels: u64) -> Result<(), PluginError> {
        self.refuse_at_the_pendant()?;
        let outputs = u8::try_from(levels).ok().filter(|levels| *levels < 32).ok_or_else(|| {
            PluginError::Refused(format!(
                "output levels {levels:#b}: the controller has five output lines, bits 0 to 4"
            ))
        })?;
        let written = self.controller.step(SpeedCode::SLOWEST, HalfSteps::default(), Some(outputs));
        match written {
            Ok(_) => Ok(()),
            Err(error) => {
                let error = error.into();
                self.doubt_after(&error);
                Err(error)
            }
        }
    }

    fn jog(&mut self, on: bool) -> Result<JogState, PluginError> {
        if on { self.drive_by_hand() } else { self.end_driving_by_hand() }
    }

    fn set_zero(&mut self, joints: &JointVector) -> Result<(), PluginError> {
        self.refuse_at_the_pendant()?;
        let joints = six(joints)?;
        for (joint, value) in Joint::ALL.into_iter().zip(joints) {
            finite(joint, value)?;
        }
        self.controller.found();
        self.observe(None)?;
        // Not @RESET: it would switch the motor current off, and an arm that nothing holds sags.
        self.zero = self.zero.declared(joints, self.last.registers);
        self.host.log(LogLevel::Info, &format!("declared: {}", self.pose_in_words()));
        Ok(())
    }
}

impl TeachMover {
    /// Keeps the arm from being moved after an error that leaves open what it did.
    fn doubt_after(&mut self, error: &PluginError) {
        match error {
            PluginError::Refused(_)
            | PluginError::OutOfRange(_)
            | PluginError::Unsupported(_)
            | PluginError::Stopped(_)
            | PluginError::NotReady(_) => {}
            _ => {
                let reason = error.text().split(';').next().unwrap_or_default();
                self.mode = Mode::Doubtful(reason.to_owned());
            }
        }
    }
}

/// The six values of a joint vector that is meant for this arm.
fn six(joints: &JointVector) -> Result<Joints, PluginError> {
    let wrong = |_| {
        let names = Joint::ALL.map(Joint::name).join(", ");
        PluginError::Refused(format!("{} joint values given; this arm has 6: {names}", joints.len()))
    };
    joints.as_slice().try_into().map_err(wrong)
}

/// Refuses a value that is no number.
fn finite(joint: Joint, value: f64) -> Result<f64, PluginError> {
    if value.is_finite() {
        return Ok(value);
    }
    Err(PluginError::Refused(format!("the value for {} is {value}; give a number", joint.name())))
}
