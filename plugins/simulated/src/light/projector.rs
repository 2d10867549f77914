//! The projector: a laser behind a cylinder lens.

use crate::physics::rigid::{Rigid, Vector};

/// A sheet of light on the flange: in its own plane x = 0, fanned out along y about its z.
#[derive(Debug, Clone, PartialEq)]
pub struct Projector {
    /// Where it sits.
    pub flange_from_projector: Rigid,
    /// Width of the stripe at 300 mm, mm: four standard deviations.
    pub width_at_300: f64,
    /// Half of the fan, rad.
    pub half_fan: f64,
    /// How far the sheet bends out of its plane: by this times the square of the tangent in the fan, as a fraction of the distance.
    pub bow: f64,
    /// Grey level of the stripe's middle on a perfect white, square on, at 300 mm, were the lens perfect.
    pub level_at_300: f64,
    /// Contrast of the speckle in the picture, 0 to 1.
    pub speckle: f64,
}

impl Projector {
    /// The direction of a ray of the sheet, in the projector's frame, of length one; `tangent` is its position in the fan.
    pub(super) fn direction(&self, tangent: f64) -> Vector {
        let ray = Vector::new(self.bow * tangent * tangent, tangent, 1.0);
        ray * (1.0 / ray.norm())
    }

    /// How bright the fan is at a position in it, 1 in the middle: even, with soft ends.
    pub(super) fn brightness(&self, tangent: f64) -> f64 {
        let fraction = (tangent.atan() / self.half_fan).abs();
        if fraction >= 1.0 { 0.0 } else { 1.0 - fraction.powi(8) }
    }

    /// Standard deviation of the sheet's thickness at a distance, mm.
    pub(super) fn thickness(&self, distance: f64) -> f64 {
        self.width_at_300 / 4.0 * (distance / 300.0).max(0.2)
    }
}
