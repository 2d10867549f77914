//! The driver at an emulated controller, over the arm of a world.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on fails")]

mod cell;
mod faults;
mod motion;
mod wire;
