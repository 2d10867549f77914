//! The Microbot TeachMover on its serial line.
//!
//! The arm has six stepper motors and no sensors on its joints: the controller counts the half-steps it sends. It speaks a line protocol of
//! ten commands, answers each with one digit when what the command caused has ended, and cannot be interrupted from the line. This driver
//! cuts moves into pieces short enough for a stop (see [`cutting`]), reads registers and inputs after each, and holds them against what it sent.

pub mod controller;
pub mod cutting;
pub mod drive;
pub mod protocol;
pub mod reply_line;
pub mod speed_code;

mod configuration;
mod limits;
mod teachmover;

pub use configuration::{Configuration, GripSwitch, Level};
pub use teachmover::TeachMover;

plumb_plugin::export_robot!(TeachMover, include_str!("../plugin.yaml"));
