//! The C contract between plumb and a plugin.

mod status;

pub use status::Status;

/// The major version of the contract: a plugin of another major version is not loaded.
pub const CONTRACT_MAJOR: u32 = 1;

/// The minor version of the contract: grows when something is added; a plugin of any minor version is loaded.
pub const CONTRACT_MINOR: u32 = 0;
