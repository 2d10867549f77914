//! A link that twists like a shaft clamped at its joint (Saint-Venant).

use super::beam::{beyond, metal};
use super::{ElasticPart, Loaded, Yielding};
use crate::physics::link_frames::Load;
use crate::physics::rigid::{Rigid, Rotation, Vector};

/// The link after a joint, of torsional stiffness `1 / flexibility` N m2, from the joint's axis to the next as the beam has it.
///
/// A torque T at the free end of a shaft of length L twists it by `T L / GJ`; a link's own weight at distance b from the clamped end twists it by `T b / GJ`, and
/// what is beyond turns along.
#[derive(Debug)]
pub(super) struct Shaft {
    pub(super) joint: usize,
    pub(super) flexibility: f64,
}

impl ElasticPart for Shaft {
    fn yield_to(&self, loaded: &Loaded<'_>, yielding: &mut Yielding) {
        let (Some((start_at_home, end_at_home)), Some(motion)) =
            (metal(loaded, self.joint), loaded.link_frames.world_from_home.get(self.joint))
        else {
            return;
        };
        let (start, end) = (motion.apply(start_at_home), motion.apply(end_at_home));
        let Some(along) = (end - start).unit() else { return };
        let length = (end - start).norm() * 1e-3;
        let mut angle = beyond(loaded, self.joint).moment_about(end).dot(along) * length;
        for weight in loaded.arm.weights.iter().filter(|weight| weight.after == self.joint) {
            let mut own = Load::default();
            own.hang(weight.mass, motion.apply(weight.centre));
            let at = ((motion.apply(weight.centre) - start).dot(along) * 1e-3).clamp(0.0, length);
            angle += own.moment_about(start).dot(along) * at;
        }
        let line = motion.rotation.inverse().apply(along);
        let twist = Rotation::by(line * (angle * self.flexibility));
        yielding.bend(self.joint, Rigid::turned_about(end_at_home, twist, Vector::ZERO));
    }
}
