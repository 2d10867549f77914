//! What a plugin author writes against.
//!
//! A plugin is a shared library that drives one kind of device. Its author implements [`Robot`] or [`Sensor`] in plain, synchronous Rust and
//! exports it with one macro; the C layer underneath (see `plumb-abi`) is generated. The library is loaded by a host process of its own, so
//! it may block in a call, but it must look at [`Host::should_stop`] at least every 50 ms while it does.
//!
//! The types of requests, replies and messages live here too, because they are what a plugin and the orchestrator have in common.

mod description;
mod device_state;
mod error;
mod host;
mod manifest;
mod reading;
mod reply;
mod request;
mod robot;
mod sensor;
mod wire;

pub mod cell_clock;
pub mod conformance;
pub mod export;
pub mod message;
pub mod recording;

pub use description::{
    Description, FieldDescription, InputDescription, JointDescription, JointUnit, LineDescription,
    NumberType, QuantityDescription, RobotCapabilities, RobotDescription, SensorDescription,
    StreamDescription,
};
pub use device_state::DeviceState;
pub use error::PluginError;
pub use host::{Host, HostInterface, LogLevel};
pub use manifest::{ContractVersion, DeviceKind, Manifest, ManifestError, ManifestJoint};
pub use message::{
    DigitalInputs, FrameHeader, Health, JogState, JointState, JointVector, MAX_JOINTS, Message, MessageError,
    Motion, MotorState, ProximityEdge, StripeFault, StripeHeader, StripePoint,
};
pub use reading::{Quantity, Reading};
pub use reply::{Answer, Reply};
pub use request::Request;
pub use robot::Robot;
pub use sensor::Sensor;
pub use wire::WireError;

/// The JSON type of a plugin's configuration, so that a plugin needs no crate of its own for it.
pub use serde_json::Value;
