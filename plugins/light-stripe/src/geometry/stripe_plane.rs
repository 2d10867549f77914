//! The sheet of light.

use nalgebra::{Unit, Vector3};

/// The sheet of light: n.x + d = 0 in the flange's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StripePlane {
    /// Of length one.
    pub normal: Vector3<f64>,
    /// mm.
    pub d_mm: f64,
}

impl StripePlane {
    /// The plane of a normal of any length; none of length 0.
    pub fn new(normal: Vector3<f64>, d_mm: f64) -> Option<Self> {
        let unit = Unit::try_new(normal, 1e-9)?;
        Some(Self { normal: unit.into_inner(), d_mm: d_mm / normal.norm() })
    }
}
