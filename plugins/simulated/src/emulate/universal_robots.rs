//! The controller of a Universal Robots arm (CB3 or e-Series) on the network: what a driver meets that reads RTDE and sends URScript.
//!
//! Four servers on the ports of a real one: RTDE (30004), the primary and the secondary interface (30001, 30002) and the dashboard (29999). Written from what
//! Universal Robots publishes, not from the driver: the two share no code and no text.
//!
//! - RTDE: <https://docs.universal-robots.com/tutorials/communication-protocol-tutorials/rtde-guide.html>
//! - primary and secondary interface: <https://docs.universal-robots.com/tutorials/communication-protocol-tutorials/primary-secondary-guide.html>
//! - dashboard: <https://www.universal-robots.com/how-tos-and-faqs/how-to/ur-how-tos/dashboard-server-port-29999-15690/>
//! - URScript: <https://www.universal-robots.com/manuals/EN/HTML/SW5_19/Content/prod-scriptmanual/G5/rtde_set_watchdog_variable_name.htm> and its neighbours

mod arm;
mod client;
mod controller;
mod dashboard;
mod event;
mod motion;
mod ports;
mod primary;
mod rtde;
mod running_time;
mod script;
mod service;
mod states;

pub use arm::ArmError;
pub use event::{Event, EventError};
pub use ports::{PortsError, SERVERS};
pub use service::{Emulator, EmulatorError, EmulatorOptions, Status};
pub use states::{Series, SeriesError};
