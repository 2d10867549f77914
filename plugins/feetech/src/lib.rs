//! Arms of Feetech STS bus servos, such as the SO-101: half-duplex serial, every servo with a number and a table of registers.
//!
//! `packet` is what travels, `bus` a conversation with its deadlines, `registers` the servos' tables, `servo` one servo's state as its table reports
//! it. [`FeetechArm`] is the robot. Sources of the protocol: the maker's memory tables of the STS series (wiki.juxitech.com and wiki.aifitlab.com
//! hold translations), and LeRobot's `motors/feetech`, whose facts agree with them.

mod arm;
mod bus;
mod calibration;
mod configuration;
mod motion;
pub mod packet;
mod registers;
mod servo;
mod servos;
mod settings;
mod travel;
mod zeros;

pub use arm::FeetechArm;
pub use configuration::Configuration;

plumb_plugin::export_robot!(FeetechArm, include_str!("../plugin.yaml"));
