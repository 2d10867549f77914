//! Controllers of arms as a driver meets them: programs on a pseudo-terminal or on the network.

pub mod dobot;
mod emulator;
pub(crate) mod fault;
pub mod feetech;
mod line;
mod mover;
pub mod teachmover;
pub(crate) mod terminal;
pub mod transcript;
pub mod universal_robots;
pub mod val2;
pub(crate) mod wire;
mod world_motion;

pub use emulator::{Controls, Emulator, EmulatorError};
