//! Where a robot's joints are.

use bytemuck::{Pod, Zeroable};
use serde::{Deserialize, Serialize};

use super::{JointVector, Message};

/// Where a robot's joints are, as its controller knows it.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable, Serialize, Deserialize)]
pub struct JointState {
    /// When the joints were there: ns of the cell's clock.
    pub time_ns: u64,
    /// The message's number in its stream, written by the host.
    pub sequence: u64,
    /// 1 while the robot moves, 0 at rest.
    pub moving: u32,
    /// Always zero.
    #[serde(skip)]
    pub reserved: u32,
    /// The joints: rad, or mm where the description says so.
    pub joints: JointVector,
}

impl Message for JointState {
    const TYPE_NAME: &'static str = "joint-state/1";
}

impl JointState {
    /// The joints at a moment; `sequence` is left to the host.
    pub fn new(time_ns: u64, joints: JointVector, moving: bool) -> Self {
        Self { time_ns, sequence: 0, moving: u32::from(moving), reserved: 0, joints }
    }

    /// Whether the robot was moving.
    pub fn is_moving(&self) -> bool {
        self.moving != 0
    }
}
