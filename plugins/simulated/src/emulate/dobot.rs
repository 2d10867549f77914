//! The controller of a Dobot Magician on its serial line, so that a driver can be tried to the byte without an arm.
//!
//! Written from the maker's "Communication Protocol" V1.1.5 and "ALARM Description" V1.0.0, not from the driver: the two share no code and no text. Assumed, because
//! neither says it: what a forced stop leaves as the current index (that of the last command that ended), that an alarm holds the queue until it is cleared
//! (an owner's arm did so: github hadefuwa/rpi-dobot), that a target out of reach raises its alarm before the arm sets out, and that the angle of the base is 0
//! after power came.

mod arm;
mod controller;
mod event;
mod framing;
mod service;

pub use super::fault::{Fault, FaultKind, Way};
pub use super::line::LineOptions;
pub use arm::ArmError;
pub use event::{Event, EventError};
pub use service::{Emulator, EmulatorOptions, Status};
