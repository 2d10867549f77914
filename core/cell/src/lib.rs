//! The orchestrator: workcell files, devices, procedures, safety and corrections.

pub mod command;
pub mod event;
pub mod prompt;
mod run_handle;

pub use run_handle::{RunHandle, StopAction, StopActions};
