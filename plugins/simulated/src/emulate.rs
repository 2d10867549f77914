//! Controllers of arms as a driver meets them: programs on a pseudo-terminal.

pub(crate) mod fault;
pub mod teachmover;
pub(crate) mod terminal;
pub mod val2;
pub(crate) mod wire;
