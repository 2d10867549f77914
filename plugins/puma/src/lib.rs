//! The Unimation PUMA 560, driven through the monitor terminal of its VAL-II controller.
//!
//! The driver is a typist at that terminal. The controller holds one character while it echoes another, so each is sent when the one before has
//! come back (`typist`); the carriage return that makes a line count is sent only when the whole of it came back as it was typed. What the
//! controller says is read by its numbers and prompts, not by its columns ([`reply`]), and its error messages are looked up in one table
//! ([`controller_error`]).

mod configuration;
pub mod controller_error;
pub mod joints;
mod line;
mod monitor;
mod profile;
mod puma;
pub mod reply;
mod typist;

pub use configuration::{Configuration, Typing};
pub use line::{LineError, LineFailure};
pub use profile::Profile;
pub use puma::Puma;

plumb_plugin::export_robot!(Puma, include_str!("../plugin.yaml"));
