//! What the times of a plan need to know of a robot's geometry.

use nalgebra::{IsometryMatrix3, Vector3};

/// The geometry of a robot, by its joints as the cell lists them, rad or mm.
pub(crate) trait Geometry {
    /// Where the flange is.
    fn flange(&self, joints: &[f64]) -> IsometryMatrix3<f64>;

    /// Where the model's point is, mm, in the model's frame of measurements, for each of these lists of joints: that of a target, or the first. None
    /// where there is no such point.
    fn tips(&self, target: Option<&str>, joints: &[Vec<f64>]) -> Option<Vec<Vector3<f64>>>;
}
