//! Guideways of slides that are not straight: the carriage goes along an arc, or rolls as it goes. They yield to nothing; where the carriage is decides.

use super::{ElasticPart, Loaded, Yielding};
use crate::physics::rigid::{Rigid, Rotation, Vector};

/// To which side a guideway is bowed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Toward {
    Up,
    Left,
}

/// The carriage as it was at home: where it sat on the guideway, which way it goes (as its reading grows), and how far it has gone, mm; base frame.
fn carriage(loaded: &Loaded<'_>, joint: usize) -> Option<(Vector, Vector, f64)> {
    let screw = loaded.arm.screws.get(joint)?;
    let sign = loaded.arm.signs.get(joint).copied().unwrap_or(1.0);
    Some((screw.point, screw.direction * sign, *loaded.angles.get(joint)?))
}

/// Up and left of a travel (base frame). A travel that is nearer to upright than to level has none: along the base's x is then called up.
fn sides(loaded: &Loaded<'_>, travel: Vector) -> (Vector, Vector) {
    let up = loaded.arm.world_from_base.rotation.inverse().apply(Vector::Z);
    let level = up.across(travel);
    let up = match level.norm() < std::f64::consts::FRAC_1_SQRT_2 {
        true => Vector::X.across(travel),
        false => level,
    };
    let up = up.unit().unwrap_or(Vector::Z);
    (up, up.cross(travel))
}

/// A guideway that is an arc of a circle: it leaves the straight line at the slide's zero, where it is its tangent.
#[derive(Debug)]
pub(super) struct Bowed {
    pub(super) joint: usize,
    /// One over the radius, 1/mm.
    pub(super) curvature: f64,
    pub(super) toward: Toward,
}

impl ElasticPart for Bowed {
    fn yield_to(&self, loaded: &Loaded<'_>, yielding: &mut Yielding) {
        let Some((sat, travel, gone)) = carriage(loaded, self.joint) else { return };
        let (up, left) = sides(loaded, travel);
        let side = if self.toward == Toward::Up { up } else { left };
        let angle = self.curvature * gone;
        if angle == 0.0 {
            return;
        }
        // The end of an arc of length `gone`: `sin(angle) / curvature` ahead and `(1 - cos(angle)) / curvature` aside.
        let ahead = angle.sin() / self.curvature - gone;
        let aside = 2.0 * (0.5 * angle).sin().powi(2) / self.curvature;
        let turned = Rotation::about(travel.cross(side), angle);
        yielding.bend(self.joint, Rigid::turned_about(sat, turned, travel * ahead + side * aside));
    }
}

/// A guideway that is twisted about its own line.
#[derive(Debug)]
pub(super) struct Twisted {
    pub(super) joint: usize,
    /// rad for a mm.
    pub(super) twist: f64,
}

impl ElasticPart for Twisted {
    fn yield_to(&self, loaded: &Loaded<'_>, yielding: &mut Yielding) {
        let Some((sat, travel, gone)) = carriage(loaded, self.joint) else { return };
        let turned = Rotation::about(travel, self.twist * gone);
        yielding.bend(self.joint, Rigid::turned_about(sat, turned, Vector::ZERO));
    }
}
