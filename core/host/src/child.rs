//! The host process itself.

mod ending;
mod lifeline;
mod memory;
mod output;
mod own_log;
mod rest_report;
mod serve;
mod service;
mod stop;
mod watchdog;

pub use serve::serve;
