//! The C contract between plumb and a plugin. `include/plumb_plugin.h` says the same in C, with who may call what on which thread.
//!
//! A plugin is a shared library with one data symbol: an [`Entry`] named `plumb_plugin_` and the library's own name (see [`entry_symbol`]).
//! The entry begins with a magic number and the version of the contract, so that a library of another version is distinguished before anything
//! in it is called. What a device can do beyond being created and destroyed is asked for by name ([`ROBOT_EXTENSION`], [`SENSOR_EXTENSION`]):
//! the contract grows by new names, and tables only ever grow at their end.
//!
//! The operations of a device are declared once, in the table of `operations.rs`.
//!
//! Nothing that one side allocated is freed by the other. Nothing unwinds across: a panic ends as [`Status::PANICKED`].

#![no_std]
#![allow(unsafe_code, reason = "this crate is the boundary to C")]

mod bytes;
mod entry;
mod function_tables;
mod host_functions;
mod operations;
mod sink;
mod status;

pub use bytes::Bytes;
pub use entry::{Entry, EntryName, Instance, MAGIC, entry_symbol};
pub use function_tables::{ROBOT_EXTENSION, RobotFunctions, SENSOR_EXTENSION, SensorFunctions};
pub use host_functions::HostFunctions;
pub use sink::Sink;
pub use status::Status;

/// The major version of the contract: a plugin of another major version is not loaded.
pub const CONTRACT_MAJOR: u32 = 1;

/// The minor version of the contract: grows when something is added; a plugin of any minor version is loaded.
pub const CONTRACT_MINOR: u32 = 1;
