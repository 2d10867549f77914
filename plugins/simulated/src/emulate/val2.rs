//! The monitor of VAL-II, the controller of a PUMA 560, on a pseudo-terminal: what a driver that plays the typist meets.
//!
//! Written from what is known of the controller, not from the driver: the two share no code and no text. Where sources differ or are silent
//! (column widths, the wording of messages, what `DO` does while the arm moves), there are [`Dialect`]s, and a driver must get along with each.

mod arm;
mod dialect;
mod event;
mod format;
mod monitor;
mod service;
mod words;

pub use crate::emulate::fault::{Fault, FaultError, FaultKind, Way};
pub use crate::emulate::line::LineOptions;
pub use arm::ArmError;
pub use dialect::Dialect;
pub use event::{Event, EventError};
pub use service::{Emulator, EmulatorOptions, Status};
