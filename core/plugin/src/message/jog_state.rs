//! Where a robot is while the operator drives it by hand.

use bytemuck::{Pod, Zeroable};
use serde::{Deserialize, Serialize};

use super::JointState;

/// Where a robot is while the operator drives it with its teach pendant.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable, Serialize, Deserialize)]
pub struct JogState {
    /// Where the joints are.
    pub state: JointState,
    /// The key pressed last, in the numbering of the device; 0 when none.
    pub key: u32,
    /// 1 once the operator has ended the jog on the pendant.
    pub finished: u32,
}
