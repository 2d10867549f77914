//! The messages that travel in streams between processes.
//!
//! A message is a plain block of bytes (`#[repr(C)]`, no padding the compiler chooses) with a versioned name. Each begins with the moment
//! it is about and its number in the stream. The number is written by the host when the message is emitted, whatever the plugin put there;
//! a gap in it is how a receiver knows that messages were lost.

mod digital_inputs;
mod frame;
mod health;
mod jog_state;
mod joint_state;
mod joint_vector;
mod json;
mod layout;
mod motion;
mod motor_state;
mod proximity_edge;
mod stripe_points;

pub use digital_inputs::DigitalInputs;
pub use frame::FrameHeader;
pub use health::Health;
pub use jog_state::JogState;
pub use joint_state::JointState;
pub use joint_vector::{JointVector, MAX_JOINTS, TooManyJoints};
pub use json::{from_json, to_json};
pub use layout::{Field, FieldType, JointQuantity, Layout, Tail};
pub use motion::Motion;
pub use motor_state::MotorState;
pub use proximity_edge::ProximityEdge;
pub use stripe_points::{StripeFault, StripeHeader, StripePoint};

/// A message of a stream: a plain block of bytes that begins with `time_ns` and `sequence`.
pub trait Message: bytemuck::Pod {
    /// The name and version of the layout, such as `joint-state/1`. A changed layout is a new name.
    const TYPE_NAME: &'static str;
}

/// A message whose length is not what its header says.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a message of {type_name} has {length} bytes; its header says {needed}")]
pub struct MessageError {
    /// Its layout.
    pub type_name: &'static str,
    /// What it should have.
    pub needed: usize,
    /// What it has.
    pub length: usize,
}

/// Where the host writes a message's number: after the eight bytes of its time.
pub const SEQUENCE_OFFSET: usize = 8;

/// The bytes every message begins with: `time_ns` and `sequence`.
pub const PREFIX_LENGTH: usize = 16;

/// The bytes of a message's layout, where the name is one of this crate's and all have as many; `None` for a message of a plugin's own.
pub fn known_length(type_name: &str) -> Option<usize> {
    Layout::known(type_name)?.length()
}
