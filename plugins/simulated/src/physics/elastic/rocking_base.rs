//! A base on uneven feet: it rests on one pair or on the other, whichever way the arm leans.

use super::{ElasticPart, Loaded, Yielding};
use crate::physics::rigid::Vector;

/// The base leans by `tilt` rad about a horizontal line through its origin towards the side to which the arm's weight pulls it; between the two
/// sides, within `softness` N m, the feet's rubber gives evenly.
#[derive(Debug)]
pub(super) struct RockingBase {
    pub(super) direction: f64,
    pub(super) softness: f64,
    pub(super) tilt: f64,
}

impl ElasticPart for RockingBase {
    fn yield_to(&self, loaded: &Loaded<'_>, yielding: &mut Yielding) {
        let (sine, cosine) = self.direction.sin_cos();
        let line = Vector::new(cosine, sine, 0.0);
        let moment = loaded
            .loads
            .first()
            .map_or(0.0, |load| line.dot(load.moment_about(loaded.arm.world_from_base.translation)));
        yielding.rocking += line * (self.tilt * (moment / self.softness).clamp(-1.0, 1.0));
    }
}
