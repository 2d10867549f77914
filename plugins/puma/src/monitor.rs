//! The commands of the monitor that the driver uses, and what it makes of their answers.

use std::time::Duration;

use plumb_plugin::PluginError;

use crate::configuration::Configuration;
use crate::controller_error::ControllerError;
use crate::joints::{AXES, JOINTS, folded, unfolded};
use crate::line::LineError;
use crate::profile::Profile;
use crate::reply::{Ending, Reply};
use crate::typist::{Typist, Waited};

/// The point through which poses are handed over.
const POINT: &str = "#PLMB";

/// A shown angle may differ from a typed one by so much, deg: the last digit of the narrowest columns.
const SHOWN_WITHIN: f64 = 0.012;

/// Why the controller did not do what was wanted.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub(crate) enum MonitorError {
    /// The conversation failed.
    #[error(transparent)]
    Line(#[from] LineError),
    /// It reported an error.
    #[error("the controller says \"{}\"", .0.line)]
    ControllerError(ControllerError),
    /// The values it shows are not those that were typed.
    #[error(
        "joint {joint} was typed as {typed:.3} and is shown as {shown:.3} degrees; the point was not used and nothing moved"
    )]
    NotTaken {
        /// Which, from 1.
        joint: usize,
        /// What was typed, degrees.
        typed: f64,
        /// What is shown, degrees.
        shown: f64,
    },
}

impl MonitorError {
    pub(crate) fn plugin_error(&self) -> PluginError {
        match self {
            Self::Line(error) => error.plugin_error(),
            Self::ControllerError(error) => error.error(),
            Self::NotTaken { .. } => PluginError::Failed(self.to_string()),
        }
    }
}

/// How a motion ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum MotionEnd {
    Arrived,
    Stopped,
}

/// What came of teaching a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Taught {
    /// It is where it is looked for.
    Point,
    /// The arm is not where it was thought to: there is no point.
    Elsewhere,
}

/// Two readings of an arm at rest differ by no more, deg.
const SAME: f64 = 0.02;

/// Whether two readings are of one pose.
pub(crate) fn alike(one: &[f64; AXES], other: &[f64; AXES]) -> bool {
    one.iter().zip(other).all(|(one, other)| (one - other).abs() <= SAME)
}

/// The monitor of one controller.
#[derive(Debug)]
pub(crate) struct Monitor {
    typist: Typist,
    /// The SPEED last set, percent.
    speed: Option<f64>,
}

impl Monitor {
    /// Opens the port and brings the monitor to its prompt. A program that runs in the controller is stopped by this.
    pub(crate) fn open(configuration: &Configuration) -> Result<Self, MonitorError> {
        let mut monitor = Self { typist: Typist::open(configuration)?, speed: None };
        monitor.start_over()?;
        Ok(monitor)
    }

    /// Cancels whatever goes on and forgets what was thought of the controller.
    pub(crate) fn start_over(&mut self) -> Result<(), MonitorError> {
        self.typist.cancel()?;
        self.typist.rebooted = false;
        self.speed = None;
        self.typist.take_unasked()?;
        Ok(())
    }

    /// Where the time went since this was asked last.
    pub(crate) fn take_profile(&mut self) -> Profile {
        std::mem::take(&mut self.typist.profile)
    }

    /// An error that came without being asked for: power gone, panic button. That the controller was started anew counts for more: power alone would not
    /// bring its calibration back.
    pub(crate) fn unrequested_error(&mut self) -> Result<Option<ControllerError>, MonitorError> {
        let lines = self.typist.take_unasked()?;
        self.typist.require_no_new_start("listening")?;
        Ok(lines.iter().find_map(|line| ControllerError::in_line(line)))
    }

    /// Where the joints are, degrees; `near` is where they are thought to be, for angles that are shown folded.
    pub(crate) fn read(&mut self, near: &[f64; AXES]) -> Result<[f64; AXES], MonitorError> {
        let reply = self.ask("WHERE", Ending::Command)?;
        match reply.rows().as_slice() {
            [_, joints] => self.joints("WHERE", &reply, joints, near),
            _ => Err(self.unexpected("WHERE", &reply)),
        }
    }

    /// Sets the speed of motions, percent.
    pub(crate) fn set_speed(&mut self, percent: f64) -> Result<(), MonitorError> {
        if self.speed == Some(percent) {
            return Ok(());
        }
        self.ask(&format!("SPEED {}", number(percent)), Ending::Command)?;
        self.speed = Some(percent);
        Ok(())
    }

    /// Puts a pose where [`Monitor::move_to_point`] finds it: the pose the arm has, with these joints (degrees) changed. The controller shows that pose
    /// first; where it is not `near`, nothing is put anywhere.
    pub(crate) fn teach_point(
        &mut self,
        joints: &[Option<f64>; AXES],
        near: &[f64; AXES],
    ) -> Result<Taught, MonitorError> {
        self.converse(|monitor| monitor.teach_point_once(joints, near))
    }

    fn teach_point_once(
        &mut self,
        joints: &[Option<f64>; AXES],
        near: &[f64; AXES],
    ) -> Result<Taught, MonitorError> {
        let here = format!("HERE {POINT}");
        let reply = self.ask(&here, Ending::Question)?;
        let found = match self.only_row(&here, &reply, near) {
            Ok(found) => found,
            Err(error) => {
                self.typist.cancel()?;
                return Err(error);
            }
        };
        if !alike(&found, near) {
            self.typist.cancel()?;
            return Ok(Taught::Elsewhere);
        }
        let values: Vec<String> =
            joints.iter().map(|joint| joint.map_or(String::new(), |value| number(folded(value)))).collect();
        let line = values.join(",").trim_end_matches(',').to_owned();
        if !line.is_empty() {
            let reply = self.ask(&line, Ending::Question)?;
            let expected: [f64; AXES] =
                std::array::from_fn(|joint| joints.get(joint).copied().flatten().unwrap_or(0.0));
            let shown = self.only_row(&line, &reply, &expected);
            if let Err(error) = shown.and_then(|shown| taken(joints, &shown)) {
                // What is not as typed is not kept: the question is cancelled.
                self.typist.cancel()?;
                return Err(error);
            }
        }
        self.ask("", Ending::Command).map(|_| Taught::Point)
    }

    /// Goes to the pose of [`Monitor::teach_point`].
    pub(crate) fn move_to_point(
        &mut self,
        within: Duration,
        should_stop: &mut dyn FnMut() -> bool,
    ) -> Result<MotionEnd, MonitorError> {
        self.motion(&format!("DO MOVE {POINT}"), within, should_stop)
    }

    /// Turns one joint (from 0) by so many degrees.
    pub(crate) fn drive(
        &mut self,
        joint: usize,
        degrees: f64,
        percent: f64,
        within: Duration,
        should_stop: &mut dyn FnMut() -> bool,
    ) -> Result<MotionEnd, MonitorError> {
        let text = format!("DO DRIVE {},{},{}", joint + 1, number(degrees), number(percent));
        self.motion(&text, within, should_stop)
    }

    /// Goes to the ready position.
    pub(crate) fn ready(
        &mut self,
        within: Duration,
        should_stop: &mut dyn FnMut() -> bool,
    ) -> Result<MotionEnd, MonitorError> {
        self.motion("DO READY", within, should_stop)
    }

    /// Has the controller find its joints' positions after power came on; each joint moves a little.
    pub(crate) fn calibrate(
        &mut self,
        within: Duration,
        should_stop: &mut dyn FnMut() -> bool,
    ) -> Result<MotionEnd, MonitorError> {
        self.confirmed_motion("CALIBRATE", within, should_stop)
    }

    /// Has the controller take where the arm is for the ready position; each joint is driven to and fro.
    pub(crate) fn take_for_ready(
        &mut self,
        within: Duration,
        should_stop: &mut dyn FnMut() -> bool,
    ) -> Result<MotionEnd, MonitorError> {
        self.confirmed_motion("EXECUTE POTCAL", within, should_stop)
    }

    /// A motion before which the controller asks whether one is sure.
    fn confirmed_motion(
        &mut self,
        text: &str,
        within: Duration,
        should_stop: &mut dyn FnMut() -> bool,
    ) -> Result<MotionEnd, MonitorError> {
        self.converse(|monitor| {
            monitor.ask(text, Ending::Question)?;
            monitor.motion("Y", within, should_stop)
        })
    }

    /// Holds a conversation with a question in it. Where the echo of an answer was late, that line was cancelled, and the question with it: then all of it is
    /// begun once more, as any other line is typed once more. At the prompt for a command the answer would be taken for a command.
    fn converse<T>(
        &mut self,
        mut conversation: impl FnMut(&mut Self) -> Result<T, MonitorError>,
    ) -> Result<T, MonitorError> {
        let mut was_late = false;
        loop {
            self.typist.unanswered = false;
            let was_careful = self.typist.is_careful();
            match conversation(self) {
                // A message that came in place of the echo is another error.
                Err(MonitorError::Line(error))
                    if error.failure.is_of_echo() && self.typist.unanswered && !was_late =>
                {
                    was_late = was_careful;
                }
                other => return other,
            }
        }
    }

    fn motion(
        &mut self,
        text: &str,
        within: Duration,
        should_stop: &mut dyn FnMut() -> bool,
    ) -> Result<MotionEnd, MonitorError> {
        match self.typist.ask_for_motion(text, within, should_stop) {
            Ok(Waited::Answered(reply)) => match reply.controller_error() {
                Some(error) => Err(self.controller_error(error)),
                None => Ok(MotionEnd::Arrived),
            },
            Ok(Waited::Interrupted(_)) => {
                // A control C: one character, taken whether or not the controller takes commands now.
                self.typist.cancel()?;
                Ok(MotionEnd::Stopped)
            }
            Err(error) => {
                // Whatever it did, the arm is not to go on; a controller that is gone does not hear this.
                let _ = self.typist.cancel();
                Err(error.into())
            }
        }
    }

    /// Types a line and takes its answer, which has to end so.
    fn ask(&mut self, text: &str, ending: Ending) -> Result<Reply, MonitorError> {
        let reply = match self.typist.ask(text) {
            Ok(reply) => reply,
            Err(error) => {
                // A half-finished answer, or a question left open, must not be answered by the next line.
                let _ = self.typist.cancel();
                return Err(self.instead_of_echo(error));
            }
        };
        let error = reply.controller_error();
        if error.is_none() && reply.ending == ending {
            return Ok(reply);
        }
        if reply.ending != Ending::Command {
            self.typist.cancel()?;
        }
        match error {
            Some(error) => Err(self.controller_error(error)),
            None => Err(self.unexpected(text, &reply)),
        }
    }

    /// Where something else came back than was typed, a message of the controller may have come in between: then that is what happened.
    fn instead_of_echo(&mut self, error: LineError) -> MonitorError {
        match self.unrequested_error() {
            Ok(Some(message)) if error.failure.is_of_echo() => MonitorError::ControllerError(message),
            _ => error.into(),
        }
    }

    /// An error; what the controller has said before without being asked (the panic button) says better what happened.
    fn controller_error(&mut self, error: ControllerError) -> MonitorError {
        let earlier = self.unrequested_error().ok().flatten();
        MonitorError::ControllerError(earlier.unwrap_or(error))
    }

    fn only_row(&self, text: &str, reply: &Reply, near: &[f64; AXES]) -> Result<[f64; AXES], MonitorError> {
        match reply.rows().as_slice() {
            [row] => self.joints(text, reply, row, near),
            _ => Err(self.unexpected(text, reply)),
        }
    }

    /// Shown angles as joint values.
    fn joints(
        &self,
        text: &str,
        reply: &Reply,
        shown: &[f64; AXES],
        near: &[f64; AXES],
    ) -> Result<[f64; AXES], MonitorError> {
        let mut joints = *shown;
        for ((joint, value), near) in JOINTS.iter().zip(&mut joints).zip(near) {
            *value = unfolded(joint, *value, *near).ok_or_else(|| self.unexpected(text, reply))?;
        }
        Ok(joints)
    }

    fn unexpected(&self, text: &str, reply: &Reply) -> MonitorError {
        self.typist.unexpected(text, reply.lines.join("|").as_bytes()).into()
    }
}

/// Whether what is shown is what was typed.
fn taken(typed: &[Option<f64>; AXES], shown: &[f64; AXES]) -> Result<(), MonitorError> {
    for (index, (typed, shown)) in typed.iter().zip(shown).enumerate() {
        if let Some(typed) = typed.filter(|typed| (typed - shown).abs() > SHOWN_WITHIN) {
            return Err(MonitorError::NotTaken { joint: index + 1, typed, shown: *shown });
        }
    }
    Ok(())
}

/// A number as it is typed: no more digits than it needs, at most three after the point.
fn number(value: f64) -> String {
    let text = format!("{value:.3}");
    let short = text.trim_end_matches('0').trim_end_matches('.');
    if short == "-0" { "0".to_owned() } else { short.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_typed_as_short_as_they_can_be() {
        assert_eq!(
            [number(-51.656), number(90.0), number(-0.0001), number(12.5)],
            ["-51.656", "90", "0", "12.5"]
        );
    }

    #[test]
    fn two_readings_are_of_one_pose_to_a_fiftieth_of_a_degree_in_every_joint() {
        let mut other = [10.0; AXES];
        other[5] = 10.019;
        assert!(alike(&[10.0; AXES], &other) && alike(&other, &[10.0; AXES]));
        other[5] = 10.021;
        assert!(!alike(&[10.0; AXES], &other) && !alike(&other, &[10.0; AXES]));
    }

    #[test]
    fn a_joint_that_is_shown_otherwise_than_it_was_typed_is_named_by_its_number() {
        let typed = [None, Some(30.0), None, Some(-5.0), None, None];
        assert_eq!(taken(&typed, &[99.0, 30.011, 99.0, -5.011, 99.0, 99.0]), Ok(()));
        let error = taken(&typed, &[99.0, 30.011, 99.0, -5.013, 99.0, 99.0]).unwrap_err();
        assert_eq!(error, MonitorError::NotTaken { joint: 4, typed: -5.0, shown: -5.013 });
        assert!(matches!(error.plugin_error(), PluginError::Failed(_)));
    }
}
