//! Controllers of arms as a driver meets them: programs on a pseudo-terminal.

pub mod teachmover;
