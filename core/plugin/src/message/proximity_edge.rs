//! A proximity sensor's output changing.

use bytemuck::{Pod, Zeroable};
use serde::{Deserialize, Serialize};

use super::{JointVector, Message};

/// A proximity sensor's output changing, and where the robot was at that moment.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable, Serialize, Deserialize)]
pub struct ProximityEdge {
    /// When the output changed: ns of the cell's clock.
    pub time_ns: u64,
    /// The message's number in its stream, written by the host.
    pub sequence: u64,
    /// 1 when the output came on (a reflection is seen), 0 when it went off.
    pub fired: u32,
    /// Always zero.
    #[serde(skip)]
    pub reserved: u32,
    /// The robot's joints at the change: rad, or mm where its description says so.
    pub joints: JointVector,
    /// The joints at the change are known to within this, each way; same units.
    pub joints_half_width: JointVector,
}

impl Message for ProximityEdge {
    const TYPE_NAME: &'static str = "proximity-edge/1";
}

impl ProximityEdge {
    /// Whether the output came on.
    pub fn has_fired(&self) -> bool {
        self.fired != 0
    }
}
