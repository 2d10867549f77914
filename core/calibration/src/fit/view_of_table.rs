//! Where on its table the arm's own sensor looks.

use nalgebra::Vector3;

use super::state::State;
use crate::arm_model::SurfaceShape;

/// Direction cosine with the table's normal (15 degrees below the horizon) that represents any flatter view: what hardly
/// goes down does not see the table.
const FLATTEST_VIEW: f64 = -0.26;

/// The first plane of the model, which the sensor works over; without one, the plane through the origin.
pub(crate) struct ViewOfTable {
    /// Unit length.
    pub(crate) normal: Vector3<f64>,
    /// mm; nothing where the model has no plane.
    offset: Option<f64>,
}

impl ViewOfTable {
    pub(crate) fn new(state: &State) -> Self {
        let plane = state.surfaces.iter().find_map(|shape| match shape {
            SurfaceShape::Plane { normal, offset } => Some((*normal, *offset)),
            _ => None,
        });
        let (normal, offset) = plane.unzip();
        Self { normal: normal.unwrap_or_else(Vector3::z), offset }
    }

    /// How high a point is over the plane, mm; 0 without one.
    fn height(&self, point: &Vector3<f64>) -> f64 {
        self.offset.map_or(0.0, |offset| self.normal.dot(point) - offset)
    }

    /// How steeply a direction goes down to the table: its component along the normal, -1 straight down.
    pub(crate) fn steepness(&self, look: &Vector3<f64>) -> f64 {
        look.dot(&self.normal).min(FLATTEST_VIEW)
    }

    /// How far ahead of a point, seen in the direction `look`, the plane lies, mm.
    pub(crate) fn ahead(&self, point: &Vector3<f64>, look: &Vector3<f64>) -> f64 {
        // Height over sine: along the line of sight.
        -self.height(point) / self.steepness(look)
    }
}
