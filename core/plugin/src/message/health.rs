//! How a device and its host are.

use bytemuck::{Pod, Zeroable};
use serde::{Deserialize, Serialize};

use super::Message;

/// How a device and its host are, emitted by the host itself.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable, Serialize, Deserialize)]
pub struct Health {
    /// When this was so: ns of the cell's clock.
    pub time_ns: u64,
    /// The message's number in its stream, written by the host.
    pub sequence: u64,
    /// The device's state, as [`DeviceState::code`](crate::DeviceState::code).
    pub state: u32,
    /// Always zero.
    #[serde(skip)]
    pub reserved: u32,
    /// How many requests have been served.
    pub requests: u64,
    /// How many requests ended in an error.
    pub failures: u64,
    /// The longest request so far: ns.
    pub longest_ns: u64,
}

impl Message for Health {
    const TYPE_NAME: &'static str = "health/1";
}
