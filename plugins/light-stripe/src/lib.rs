//! A light stripe sensor: stripes found in camera frames, and the points they mean.

pub mod extract;
pub mod geometry;
