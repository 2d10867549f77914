//! Measurements: what a table's numbers are of, and how each kind of them follows from the arm.
//!
//! One file a kind. A kind reads its columns, predicts its value and says how that changes with the point (or attitude)
//! that is measured; how these move with the arm's parameters is worked out once for all of them. The kinds are listed in
//! `library.rs`.

mod board;
mod board_rotation;
mod direction;
mod distance;
mod edge;
mod error;
mod height;
mod kind;
mod library;
mod noise;
mod observations;
mod orientation;
mod position;
mod profile;
#[cfg(test)]
mod profile_tests;
mod row;
mod stripe;
#[cfg(test)]
mod tests;
mod tilt;
mod touch;
mod trigger;
mod unit;

pub use crate::reading_unit::{ReadingUnit, RmsError};
pub use error::ObservationsError;
pub use kind::{Equation, Measurand, MeasurementKind, Prediction, RowContext, SensorShift, Subject};
pub use library::kinds;
pub(crate) use noise::NoiseGroup;
pub use noise::{NoiseSource, ReadingNoise};
pub use observations::{Observations, unused_distances};
pub use row::RowReader;
