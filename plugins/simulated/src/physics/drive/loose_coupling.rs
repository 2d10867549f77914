//! A coupling with a loose screw: after each move it sits in one of two positions, for no reason anyone recorded.

use crate::physics::random::Random;

/// Half of `gap` to either side, by chance.
#[derive(Debug, Clone)]
pub(in crate::physics) struct LooseCoupling {
    joint: usize,
    gap: f64,
    chance: Random,
}

impl LooseCoupling {
    pub(super) fn new(joint: usize, gap: f64, pattern: u64) -> Self {
        Self { joint, gap, chance: Random::new(pattern, "loose coupling") }
    }
}

impl LooseCoupling {
    pub(super) fn pass(&mut self, angles: &mut [f64]) {
        let side = self.chance.sign();
        if let Some(angle) = angles.get_mut(self.joint) {
            *angle += 0.5 * self.gap * side;
        }
    }
}
