//! The host process itself.

mod clock;
mod context;
mod lifeline;
mod log_line;
mod memory;
mod output;
mod rest_report;
mod serve;
mod service;
mod stop;
mod watchdog;

pub(crate) use context::Context;
pub use serve::serve;
