//! The levels of a robot's digital input lines.

use bytemuck::{Pod, Zeroable};
use serde::{Deserialize, Serialize};

use super::{JointVector, Message};

/// The levels of a robot's digital input lines, and where the robot was when they changed.
///
/// A robot emits one at every change, and one with `changed == 0` at the end of every move whose `time_ns` is not before that of the joint
/// state the move returns: a receiver that has seen it has seen every change of that move.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable, Serialize, Deserialize)]
pub struct DigitalInputs {
    /// When the lines had these levels: ns of the cell's clock.
    pub time_ns: u64,
    /// The message's number in its stream, written by the host.
    pub sequence: u64,
    /// Bit `n` is the level of line `n`.
    pub levels: u64,
    /// Bit `n` is set when line `n` changed with this message.
    pub changed: u64,
    /// The joints at the moment of the change: rad, or mm where the description says so.
    pub joints: JointVector,
    /// The joints at the change are known to within this, each way; same units.
    pub joints_half_width: JointVector,
}

impl Message for DigitalInputs {
    const TYPE_NAME: &'static str = "digital-inputs/1";
}

impl DigitalInputs {
    /// The level of one line; a line past the last reads low.
    pub fn level(&self, bit: u32) -> bool {
        self.levels.checked_shr(bit).unwrap_or(0) & 1 == 1
    }

    /// Whether one line changed with this message.
    pub fn has_changed(&self, bit: u32) -> bool {
        self.changed.checked_shr(bit).unwrap_or(0) & 1 == 1
    }
}
