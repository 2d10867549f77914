//! The process around one plugin.
//!
//! The orchestrator starts one host process for each device ([`HostProcess::spawn`]) and talks to it over the cell's bus. The host loads
//! exactly one plugin and calls it from one thread ([`serve`]). A plugin that crashes, hangs or leaks takes nothing with it but its host.
//!
//! ```text
//!  orchestrator                              host process
//!  RobotClient, SensorClient  -- requests -> main thread: limits, plugin calls, inputs
//!  StopHandle                 -- stop -----> stop thread: sets what should_stop() reads
//!  HostProcess                -- socket ---> lifeline thread: finish, or the orchestrator is gone
//!      log, progress, exit   <-- socket ---  watchdog thread: a call past its time ends the host
//! ```

mod arguments;
mod catalogue;
mod channel;
mod child;
mod conformance;
mod context;
mod flood;
mod guard;
mod load;
mod parent;
mod process_name;
mod signal_names;
mod time_limits;

pub use arguments::{HostArguments, JointRange, MEMORY_LIMIT_MB, WiredInput};
pub use catalogue::{Catalogue, CatalogueError, CatalogueRow, Plugin};
pub use child::serve;
pub use conformance::{check_plugin, check_robot, check_sensor};
pub use guard::{MoveGuard, NoGuard};
pub use load::{LoadError, verify};
pub use parent::{
    DeviceError, ExitReason, HostCommand, HostEvent, HostProcess, RobotClient, SensorClient, SpawnError,
    StartError, StopHandle, StopOutcome,
};
pub use process_name::process_name;
