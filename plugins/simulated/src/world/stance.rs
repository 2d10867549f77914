//! How the arm stands at one moment, and all that follows from it.

use super::description::WorldDescription;
use super::drive::{HalfSteps, Joints};
use super::geometry::ArmPose;
use super::sensor::Seen;

/// An arm this near to something solid, or this deep in it, touches it, mm.
pub(super) const TOUCH: f64 = 1e-9;

/// How the arm stands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Stance {
    /// Where the motors' rotors truly are.
    pub(super) rotors: HalfSteps,
    /// Where the links stand behind the drives' play.
    pub(super) carried: Joints,
    /// True attitudes.
    pub(super) attitudes: Joints,
    /// Where the parts stand.
    pub(super) pose: ArmPose,
    /// How deep the arm is in something it cannot enter, mm.
    pub(super) trespass: f64,
    /// What the sensor sees, without its noise.
    pub(super) seen: Seen,
}

impl Stance {
    /// The arm with its rotors here and its links there.
    pub(super) fn standing(world: &WorldDescription, rotors: HalfSteps, carried: Joints) -> Stance {
        let mechanism = &world.arm.mechanism;
        let attitudes = mechanism.attitudes(&carried);
        let pose = mechanism.geometry.pose(&attitudes);
        Stance {
            rotors,
            carried,
            attitudes,
            pose,
            trespass: mechanism.trespass(&carried, &attitudes, &pose, world.scene.table.solid),
            seen: world.scene.seen(&pose),
        }
    }

    /// The arm after its rotors went straight from where they are to `rotors`.
    pub(super) fn after(&self, world: &WorldDescription, rotors: HalfSteps) -> Stance {
        Stance::standing(world, rotors, world.arm.mechanism.carried(&self.carried, &rotors))
    }

    /// The arm a share of the way to `rotors`.
    pub(super) fn part_way(&self, world: &WorldDescription, rotors: &HalfSteps, share: f64) -> Stance {
        let travelled = rotors.minus(&self.rotors).times(share);
        self.after(world, self.rotors.plus(&travelled))
    }

    /// Whether the arm is in something it cannot enter.
    pub(super) fn is_trespassing(&self) -> bool {
        self.trespass > TOUCH
    }
}
