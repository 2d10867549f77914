//! Universal Robots arms (CB3 and e-Series), driven over the network.
//!
//! - [`rtde`]: states come, and the sign of life goes out, by the Real-Time Data Exchange, port 30004:
//!   <https://docs.universal-robots.com/tutorials/communication-protocol-tutorials/rtde-guide.html>
//! - [`program`]: a move is a URScript program sent to the primary interface, port 30001. It writes its number to a register when it begins and when it ends, and the controller
//!   ends it when the sign of life stays out (`rtde_set_watchdog`):
//!   <https://www.universal-robots.com/manuals/EN/HTML/SW5_19/Content/prod-scriptmanual/G5/rtde_set_watchdog_variable_name.htm>
//! - [`primary`]: what the controller says of a program that does not run:
//!   <https://docs.universal-robots.com/tutorials/communication-protocol-tutorials/primary-secondary-guide.html>
//! - `dashboard`: whether it is in remote control, and a second way to stop a program, port 29999.

mod configuration;
mod dashboard;
mod freshness;
mod link;
pub mod modes;
pub mod primary;
pub mod program;
mod robot;
pub mod rtde;
mod scripts;
mod socket;

pub use configuration::Configuration;
pub use robot::UniversalRobot;

plumb_plugin::export_robot!(UniversalRobot, include_str!("../plugin.yaml"));
