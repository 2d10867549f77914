//! What a world is made of, checked and in the world's own units.

use super::drive::{HalfSteps, Joints};
use super::mechanism::Mechanism;
use super::motion::Resolution;
use super::sensor::Scene;
use crate::chance::uniform;
use crate::instrument::Instrument;

/// A whole world.
#[derive(Debug, Clone, PartialEq)]
pub struct WorldDescription {
    /// What a user calls it.
    pub title: String,
    /// From which everything that is left to chance is drawn.
    pub seed: u64,
    /// The arm.
    pub arm: ArmDescription,
    /// What it works over, and what it sees with.
    pub scene: Scene,
    /// What the operator measures with.
    pub instruments: Instruments,
    /// The text of the file, if it came under a seal: the truth is hidden until somebody breaks it.
    pub sealed_text: Option<String>,
}

/// The instruments at hand.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Instruments {
    /// On the hand: its tilt from hanging straight down, outward positive, rad.
    pub level: Instrument,
    /// From the table up to the sensor's face, mm.
    pub ruler: Instrument,
    /// With which the operator brings the hand over a mark: how far off it ends along each axis, mm.
    pub eye: Instrument,
}

/// The arm and how it was left.
#[derive(Debug, Clone, PartialEq)]
pub struct ArmDescription {
    /// Its build.
    pub mechanism: Mechanism,
    /// How finely its motors are set.
    pub resolution: Resolution,
    /// True attitudes in which it was left, rad or mm.
    pub start: Joints,
    /// How far from that, either way, the operator may have left each joint instead: drawn from the world's seed. The controller
    /// knows nothing of it, so that it adds to the zero error.
    pub start_within: Joints,
    /// How far the true attitudes are beyond what the controller believes at the start, rad or mm.
    pub zero_error: Joints,
    /// The motors' greatest speeds, half-steps/s.
    pub top_rates: HalfSteps,
    /// Speeds above which motors fall out of step, half-steps/s.
    pub pull_out_rates: Option<HalfSteps>,
}

impl WorldDescription {
    /// True attitudes in which the operator left the arm, by the world's seed.
    pub fn drawn_start(&self) -> Joints {
        let arm = &self.arm;
        let draw = |axis: usize| 2.0 * uniform(self.seed ^ 0x57a2_7000, axis as u64) - 1.0;
        arm.start.plus(&Joints(std::array::from_fn(|axis| arm.start_within.0[axis] * draw(axis))))
    }
}
