//! The host process itself.

mod context;
mod lifeline;
mod log_line;
mod serve;
mod service;
mod stop;
mod watchdog;

pub(crate) use context::Context;
pub(crate) use log_line::now_ns;
pub use serve::serve;
