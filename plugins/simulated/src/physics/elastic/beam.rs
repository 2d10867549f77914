//! A link that bends like a beam clamped at its joint (Euler and Bernoulli).

use super::{ElasticPart, Loaded, Yielding};
use crate::physics::link_frames::Load;
use crate::physics::rigid::{Rigid, Rotation, Screw, Vector};

/// The link after a joint, of bending stiffness `1 / flexibility` N m2, straight from the joint's axis to the next; see [`metal`].
///
/// A force F and a moment M at the free end of a cantilever of length L along u turn it by `(L M + L^2/2 u x F) / EI` and shift it by
/// `(L^2/2 M x u + L^3/3 F) / EI`, parts along u left out; its own weight P at distance b adds `b^2/2 u x P` and `b^2 (3L - b)/6 P`, and where
/// its centre is off the line by r, the moment m = r x P there adds `b m` and `b (L - b/2) m x u`.
#[derive(Debug)]
pub(super) struct Beam {
    pub(super) joint: usize,
    pub(super) flexibility: f64,
}

impl ElasticPart for Beam {
    fn yield_to(&self, loaded: &Loaded<'_>, yielding: &mut Yielding) {
        let (Some((start_at_home, end_at_home)), Some(motion)) =
            (metal(loaded, self.joint), loaded.link_frames.world_from_home.get(self.joint))
        else {
            return;
        };
        let (start, end) = (motion.apply(start_at_home), motion.apply(end_at_home));
        let Some(along) = (end - start).unit() else { return };
        let length = (end - start).norm() * 1e-3;
        let beyond = beyond(loaded, self.joint);
        let force = beyond.weight().across(along);
        let moment = beyond.moment_about(end).across(along);
        let mut turn = moment * length + along.cross(force) * (0.5 * length * length);
        let mut shift = moment.cross(along) * (0.5 * length * length) + force * (length.powi(3) / 3.0);
        for weight in loaded.arm.weights.iter().filter(|weight| weight.after == self.joint) {
            let mut own = Load::default();
            own.hang(weight.mass, Vector::ZERO);
            let pull = own.weight().across(along);
            let out = (motion.apply(weight.centre) - start) * 1e-3;
            let at = out.dot(along).clamp(0.0, length);
            let twist = (out - along * at).cross(own.weight()).across(along);
            turn += along.cross(pull) * (0.5 * at * at) + twist * at;
            shift += pull * (at * at * (3.0 * length - at) / 6.0)
                + twist.cross(along) * (at * (length - 0.5 * at));
        }
        let home_from_world = motion.rotation.inverse();
        let turn = home_from_world.apply(turn * self.flexibility);
        let shift = home_from_world.apply(shift * (self.flexibility * 1e3));
        yielding.bend(self.joint, Rigid::turned_about(end_at_home, Rotation::by(turn), shift));
    }
}

/// Sine of the angle below which two axes are parallel.
const PARALLEL: f64 = 0.05;

/// Where the beam begins and ends, base frame at home, mm. Between parallel axes it lies square to them, through the centre of the link's own weights, where
/// it has any: no drawing of axes reports where along them the metal is.
pub(super) fn metal(loaded: &Loaded<'_>, joint: usize) -> Option<(Vector, Vector)> {
    let screw = loaded.arm.screws.get(joint)?;
    let end = *loaded.arm.link_ends.get(joint)?;
    let out = (end - screw.point).across(screw.direction);
    let parallel = |next: &Screw| next.direction.cross(screw.direction).norm() <= PARALLEL;
    if !loaded.arm.screws.get(joint + 1).is_some_and(parallel) || out.norm() < 1e-3 {
        return Some((screw.point, end));
    }
    let mut own = Load::default();
    for weight in loaded.arm.weights.iter().filter(|weight| weight.after == joint) {
        own.hang(weight.mass, weight.centre);
    }
    let height = match own.mass > 0.0 {
        true => (own.first_moment * own.mass.recip() - screw.point).dot(screw.direction),
        false => (end - screw.point).dot(screw.direction),
    };
    let start = screw.point + screw.direction * height;
    Some((start, start + out))
}

/// What hangs beyond the link's end.
pub(super) fn beyond(loaded: &Loaded<'_>, joint: usize) -> Load {
    loaded.loads.get(joint + 1).copied().unwrap_or_else(|| {
        let mut payload = Load::default();
        payload.hang(loaded.payload, loaded.link_frames.target);
        payload
    })
}
