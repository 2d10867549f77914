//! What the controller can be asked, each with its number, and how the answers are laid out. Numbers are little-endian, angles in deg as 32-bit floats.

use std::time::Duration;

use crate::alarm::{Alarms, STATE_LENGTH};
use crate::frame::Control;
use crate::joints::{AXES, Angles};
use crate::link::{Counts, Link, LinkError};

const DEVICE_VERSION: u8 = 2;
const GET_POSE: u8 = 10;
const ALARMS_STATE: u8 = 20;
const PTP_JOINT_PARAMS: u8 = 80;
const PTP_COMMON_PARAMS: u8 = 83;
const PTP_CMD: u8 = 84;
const QUEUE_START: u8 = 240;
const QUEUE_FORCE_STOP: u8 = 242;
const QUEUE_CLEAR: u8 = 245;
const QUEUE_CURRENT_INDEX: u8 = 246;

/// The mode of a move in which all joints set out and arrive together, to joint angles.
const MOVJ_ANGLE: u8 = 4;
/// GetPose answers with x, y, z, r and the four joints.
const POSE_LENGTH: usize = 8 * FLOAT;
/// Where the joints begin in it.
const POSE_JOINTS: usize = 4;
const FLOAT: usize = 4;
/// A queue's index.
const INDEX_LENGTH: usize = 8;
/// No joint shows more, deg: beyond it an answer is damage that the checksum did not catch.
const MOST_DEG: f64 = 360.0;

/// The controller.
#[derive(Debug)]
pub(crate) struct Controller {
    link: Link,
}

impl Controller {
    pub(crate) fn open(port: &str, within: Duration) -> Result<Self, LinkError> {
        Ok(Self { link: Link::open(port, within)? })
    }

    pub(crate) fn counts(&self) -> Counts {
        self.link.counts
    }

    /// The version of its program, such as `3.6.1`.
    pub(crate) fn version(&mut self) -> Result<String, LinkError> {
        let answer = self.link.ask("what version it is", DEVICE_VERSION, Control::Read, &[], 3)?;
        Ok(answer.iter().take(3).map(u8::to_string).collect::<Vec<_>>().join("."))
    }

    /// Where the joints are, deg; none for numbers that are no angles.
    pub(crate) fn angles(&mut self) -> Result<Option<Angles>, LinkError> {
        let answer = self.link.ask("where it is", GET_POSE, Control::Read, &[], POSE_LENGTH)?;
        let mut angles = [0.0; AXES];
        for (index, angle) in angles.iter_mut().enumerate() {
            *angle = float(&answer, POSE_JOINTS + index);
        }
        Ok(angles.iter().all(|angle| angle.is_finite() && angle.abs() <= MOST_DEG).then_some(angles))
    }

    pub(crate) fn alarms(&mut self) -> Result<Alarms, LinkError> {
        let answer = self.link.ask("what alarms are on", ALARMS_STATE, Control::Read, &[], STATE_LENGTH)?;
        Ok(Alarms::of_state(&answer))
    }

    pub(crate) fn clear_alarms(&mut self) -> Result<(), LinkError> {
        self.write("that its alarms are cleared", ALARMS_STATE, &[])
    }

    /// How fast the joints go and how they speed up, deg/s and deg/s2, at a ratio of 100 %.
    pub(crate) fn set_speeds(&mut self, speed: f64, acceleration: f64) -> Result<(), LinkError> {
        let numbers = [[speed; AXES], [acceleration; AXES]].concat();
        self.write("what speeds it has", PTP_JOINT_PARAMS, &floats(&numbers))
    }

    /// What part of those the next moves go with, above 0 and at most 1.
    pub(crate) fn set_ratio(&mut self, ratio: f64) -> Result<(), LinkError> {
        self.write("what speed ratio it has", PTP_COMMON_PARAMS, &floats(&[ratio * 100.0, 100.0]))
    }

    /// Puts a move into the queue, and gives its index.
    pub(crate) fn queue_move(&mut self, target: &Angles) -> Result<u64, LinkError> {
        let mut parameters = vec![MOVJ_ANGLE];
        parameters.extend(floats(target));
        let answer =
            self.link.ask("that it takes a move", PTP_CMD, Control::Queue, &parameters, INDEX_LENGTH)?;
        Ok(index(&answer))
    }

    /// The index of the command that it carried out last.
    pub(crate) fn index(&mut self) -> Result<u64, LinkError> {
        let answer = self.link.ask("how far it is", QUEUE_CURRENT_INDEX, Control::Read, &[], INDEX_LENGTH)?;
        Ok(index(&answer))
    }

    pub(crate) fn start_queue(&mut self) -> Result<(), LinkError> {
        self.write("that its queue runs", QUEUE_START, &[])
    }

    /// Ends the move under way, and then takes away what waits: the other way round a queued move could still begin.
    pub(crate) fn halt(&mut self) -> Result<(), LinkError> {
        let stopped = self.write("that it stops", QUEUE_FORCE_STOP, &[]);
        // Whatever became of the stop, nothing more may follow.
        let cleared = self.write("that its queue is empty", QUEUE_CLEAR, &[]);
        stopped.and(cleared)
    }

    fn write(&mut self, what: &'static str, id: u8, parameters: &[u8]) -> Result<(), LinkError> {
        self.link.ask(what, id, Control::Write, parameters, 0).map(drop)
    }
}

fn floats(numbers: &[f64]) -> Vec<u8> {
    numbers.iter().flat_map(|number| (*number as f32).to_le_bytes()).collect()
}

/// The float at an index, counted in floats; what is not there is not a number.
fn float(bytes: &[u8], index: usize) -> f64 {
    let four = bytes.get(index * FLOAT..).and_then(<[u8]>::first_chunk::<FLOAT>);
    four.map_or(f64::NAN, |four| f64::from(f32::from_le_bytes(*four)))
}

fn index(bytes: &[u8]) -> u64 {
    bytes.first_chunk::<INDEX_LENGTH>().map_or(0, |eight| u64::from_le_bytes(*eight))
}
