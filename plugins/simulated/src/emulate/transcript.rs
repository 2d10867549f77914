//! What went over a line, written down, and played to a program in place of the device.
//!
//! A [`Transcript`] is a text file that people can read and write. [`Recorder`] writes one while it passes the bytes of a program and a device on to one another.
//! [`Player`] answers as the device did, and holds what the program sends against what was sent then.

mod file;
mod player;
mod recorder;
mod replay;
mod serial_device;

pub use super::line::LineOptions;
pub use file::{Entry, Sender, Transcript, TranscriptError};
pub use player::{Difference, Player, Progress};
pub use recorder::{Device, Note, Recorder, Recording};
pub use replay::{Replay, Replayed};
pub use serial_device::SerialDevice;
