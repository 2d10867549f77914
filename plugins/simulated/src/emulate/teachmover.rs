//! The controller of a TeachMover on a pseudo-terminal, so that a driver can be tried to the byte without an arm.
//!
//! Written from what is known of the controller, not from the driver: the two share no code and no text, so that one's misunderstanding is not the
//! other's. Where no source says what the controller does, the code says what was assumed.

mod controller;
mod event;
mod motors;
mod order;
mod program;
mod service;

pub use super::fault::{Fault, FaultError, FaultKind, Way};
pub use super::line::LineOptions;
pub use super::terminal::TerminalError;
pub use controller::Registers;
pub use event::{Event, EventError, Key};
pub use motors::{BareMotors, End, Ending, Motors, MotorsError, MotorsInWorld, Pendant};
pub use service::{Emulator, Status};
