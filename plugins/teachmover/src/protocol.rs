//! What is said on the line: commands, replies, taught programs, pendant keys.

mod command;
mod key;
mod program;
mod reply;
mod words;

pub use command::Command;
pub use key::PendantKey;
pub use program::{ProgramLine, ProgramLineError};
pub use reply::{ControllerState, Fault, PrintableBytes, Status, parse_program, parse_state, parse_status};
