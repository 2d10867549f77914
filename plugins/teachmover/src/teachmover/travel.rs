//! Moving the arm, piece by piece.

use std::time::Instant;

use plumb_plugin::{JointState, LogLevel, Motion, PluginError};

use super::{TeachMover, finite, six};
use crate::configuration::GripSwitch;
use crate::controller::{ControllerError, MoveEnd};
use crate::cutting::Closing;
use crate::drive::{HalfSteps, Joint};
use crate::limits;
use crate::protocol::Command;
use crate::reply_line::SerialError;
use crate::speed_code::SpeedCode;

/// The most half-steps by which one piece closes the gripper while its switch is watched: half a millimetre. 32 half-steps past the contact
/// press with a pound.
const CLOSING_PIECE: u32 = 8;

/// The most half-steps by which fingers that touch already may be pressed together: four pounds, half of what the hand can do.
const HARDEST_PRESS: i32 = 128;

/// The characters of the reply to a move.
const REPLY_CHARACTERS: usize = 2;

impl TeachMover {
    /// Moves and returns where the arm came to rest.
    pub(super) fn travel(&mut self, motion: &Motion) -> Result<JointState, PluginError> {
        let start = self.observe(None)?.registers;
        self.heed_the_stop_key()?;
        let end = self.target(motion, start)?;
        limits::check(&self.joints(), &self.zero.joints(end))?;
        let travel = end.since(start);
        let speed = self.speed(motion)?;
        let opening = self.zero.cable().opening(start, travel);
        let mut grip = self.grip(opening)?;
        let closing = Closing { by: u32::try_from(-opening).unwrap_or(0), piece: CLOSING_PIECE };
        let finest = motion.speed_fraction <= self.configuration.fine_at_speed;
        let pieces = self.cutting(speed, grip.as_ref().map(|_| closing), finest).pieces(travel);
        let count = pieces.len();
        for (index, piece) in pieces.into_iter().enumerate() {
            if self.host.should_stop() {
                return Err(self.stopped("stopped"));
            }
            let piece = if grip.as_ref().is_some_and(|grip| grip.touches) {
                self.zero.cable().holding_the_opening(self.last.registers, piece)
            } else {
                piece
            };
            self.make(speed, piece)?;
            if let Some(grip) =
                grip.as_mut().filter(|grip| !grip.touches && grip.switch.is_touching(self.last.inputs))
            {
                grip.touches = true;
                let text = format!("the fingers touch something: {}", self.pose_in_words());
                self.host.log(LogLevel::Info, &text);
            }
            self.host.progress((index + 1) as f64 / count as f64, "moving");
        }
        self.report_rest()
    }

    /// Makes one piece of a move and reads where it led.
    fn make(&mut self, speed: SpeedCode, piece: HalfSteps) -> Result<(), PluginError> {
        if piece == HalfSteps::default() {
            return Ok(());
        }
        let before = self.last;
        let began = Instant::now();
        let end = self.controller.step(speed, piece, None).map_err(|error| self.broken_off(error))?;
        let command = Command::Step { speed, counts: piece, outputs: None };
        let characters = self.controller.bytes(&command).len() + REPLY_CHARACTERS;
        let on_the_line = self.controller.line().duration(characters);
        if end == MoveEnd::StopKey {
            self.observe(None)?;
            self.stop_key = false;
            return Err(self.stopped("the STOP key on the pendant ended the move"));
        }
        self.slowness.observe(speed.duration(piece.largest()), began.elapsed().saturating_sub(on_the_line));
        let expected = piece.after(before.registers);
        let now = self.observe(Some(expected))?;
        if now.registers != expected {
            return Err(self.miscounted(piece, before.registers));
        }
        self.host.emit("joints", &self.joint_state(true))?;
        self.heed_the_stop_key()
    }

    /// A STOP key pressed while no move was in the controller shows in the next reading only: it is a stop none the less.
    fn heed_the_stop_key(&mut self) -> Result<(), PluginError> {
        if std::mem::take(&mut self.stop_key) {
            return Err(self.stopped("the STOP key on the pendant was pressed"));
        }
        Ok(())
    }

    /// A move that ended early with the arm at rest.
    fn stopped(&mut self, what: &str) -> PluginError {
        match self.report_rest() {
            Ok(_) => PluginError::Stopped(format!("{what}; the arm is at {}", self.pose_in_words())),
            Err(error) => error,
        }
    }

    /// An error in the middle of a move: what is known of where the arm is.
    fn broken_off(&mut self, error: ControllerError) -> PluginError {
        let refused = matches!(error, ControllerError::Refused { .. });
        let unplugged = matches!(&error, ControllerError::Line(SerialError::WriteCommand { .. }));
        let error = PluginError::from(error);
        let where_it_is = if refused && self.observe(None).is_ok() {
            format!("the arm is at {}", self.pose_in_words())
        } else if unplugged {
            format!("the arm was at {} before", self.pose_in_words())
        } else {
            format!(
                "before that command the arm was at {}; where it is now is not known",
                self.pose_in_words()
            )
        };
        PluginError::from_status(error.status(), format!("{}; {where_it_is}", error.text()))
    }

    /// The registers a motion leads to.
    fn target(&self, motion: &Motion, start: HalfSteps) -> Result<HalfSteps, PluginError> {
        let target = six(&motion.target)?;
        let mut end = self.joints();
        for (joint, (end, target)) in Joint::ALL.into_iter().zip(end.iter_mut().zip(target)) {
            if motion.moves(joint.index()) {
                let target = finite(joint, target)?;
                *end = if motion.relative != 0 { *end + target } else { target };
            }
        }
        Ok(self.zero.registers(start, &end, |joint| motion.moves(joint.index())))
    }

    /// The speed code for the fraction of the full speed that a motion asks for.
    fn speed(&self, motion: &Motion) -> Result<SpeedCode, PluginError> {
        let fraction = motion.speed_fraction;
        if !(fraction > 0.0 && fraction <= 1.0) {
            let text = format!("the speed is {fraction} of the full speed; give more than 0 and at most 1");
            return Err(PluginError::Refused(text));
        }
        Ok(SpeedCode::at_most(self.configuration.full_speed.rate() * fraction)
            .min(self.configuration.full_speed))
    }

    /// How the grip switch is watched in a move that opens the gripper by so many half-steps, if it is.
    fn grip(&self, opening: i32) -> Result<Option<Grip>, PluginError> {
        if opening >= 0 {
            return Ok(None);
        }
        let Some(switch) = self.configuration.grip_switch else {
            let text = "no grip_switch is configured: the gripper closes by its half-steps alone";
            self.host.log(LogLevel::Warn, text);
            return Ok(None);
        };
        if !switch.is_touching(self.last.inputs) {
            return Ok(Some(Grip { switch, touches: false }));
        }
        if -opening > HARDEST_PRESS {
            let press = f64::from(HARDEST_PRESS) / self.zero.cable().half_steps_per_unit(Joint::Gripper);
            return Err(PluginError::OutOfRange(format!(
                "the fingers touch something already (gripper {:.1} mm); they may be pressed together by {press:.1} mm at most",
                self.joints().last().copied().unwrap_or_default()
            )));
        }
        Ok(None)
    }
}

/// A gripper that closes until its switch trips.
struct Grip {
    switch: GripSwitch,
    touches: bool,
}
