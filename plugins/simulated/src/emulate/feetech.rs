//! Servos of Feetech's STS series on a half-duplex bus, so that a driver can be tried to the byte without an arm.
//!
//! Written from the maker's memory table and protocol, not from the driver: the two share no code and no text. Assumed, because no source says it: what
//! a servo does with a goal while its torque is off (it keeps it and does not move), and that a write to a locked register works until the power goes.

mod bus;
mod event;
mod framing;
mod service;
mod servo;
mod shafts;

pub use super::fault::{Fault, FaultKind, Way};
pub use super::line::LineOptions;
pub use event::{Event, EventError};
pub use service::{Emulator, EmulatorOptions, Status};
pub use shafts::ShaftError;
