//! A simulated robot, and the world it stands in.

pub mod physics;
pub mod world;
