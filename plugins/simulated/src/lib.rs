//! A simulated robot, and the world it is in.
//!
//! [`physics`] is the mechanics of serial arms of any build, and makes measurements on them. Two worlds use it: [`world`] is that of a TeachMover,
//! [`arm`] that of any other arm (a PUMA 560, or one described by files). [`world_file`] reads the file of either, and [`served_world`] is what
//! both are to [`serve`], the process they live in. [`protocol`] is what is said over its socket, and [`client`] the end of that socket which
//! drivers, emulators and operators hold. [`SimulatedRobot`] is the plugin. [`emulate`] puts controllers of real arms before the world, for
//! their real drivers.

pub mod arm;
mod chance;
pub mod client;
pub mod emulate;
pub mod file_schemas;
pub mod instrument;
mod joint_values;
pub mod light;
mod lines;
pub mod physics;
pub mod protocol;
mod robot;
pub mod serve;
pub mod served_world;
pub mod world;
pub mod world_file;

pub use joint_values::{JointValues, MOST_JOINTS};
pub use robot::SimulatedRobot;

plumb_plugin::export_robot!(SimulatedRobot, include_str!("../plugin.yaml"));
