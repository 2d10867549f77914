//! A simulated robot, and the world it stands in.
//!
//! [`world`] is the world itself, [`serve`] the process it lives in, [`protocol`] what is said over its socket, and [`client`]
//! the end of that socket which drivers, emulators and operators hold. [`SimulatedRobot`] is the plugin. [`emulate`] puts controllers of
//! real arms before the world, for their real drivers. [`physics`] makes measurements on serial arms of any build.

pub mod client;
pub mod emulate;
pub mod light;
mod lines;
pub mod physics;
pub mod protocol;
mod robot;
pub mod serve;
pub mod world;

pub use robot::SimulatedRobot;

plumb_plugin::export_robot!(SimulatedRobot, include_str!("../plugin.yaml"));
