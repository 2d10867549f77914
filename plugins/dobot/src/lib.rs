//! Dobot Magician arms on their USB line.
//!
//! `frame` is what travels, `link` a conversation with its deadlines, `controller` what the controller can be asked, `alarm` what it complains of. [`DobotArm`] is
//! the robot. Sources: "Dobot Magician Communication Protocol", V1.1.5 of 2019-08-05, and "Dobot Magician ALARM Description", V1.0.0 of 2018-12-07, both of
//! Shenzhen Yuejiang Technology (dobot.cc); where they leave something open, the table in README.md says what is assumed.

mod alarm;
mod arm;
mod configuration;
mod controller;
pub mod frame;
mod joints;
mod link;
mod travel;

pub use arm::DobotArm;
pub use configuration::Configuration;

plumb_plugin::export_robot!(DobotArm, include_str!("../plugin.yaml"));
