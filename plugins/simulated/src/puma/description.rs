//! What the world of a PUMA 560 is made of, checked and in its own units.

use std::path::PathBuf;
use std::sync::Arc;

use super::joints::AXES;
use crate::light::Light;
use crate::physics::description::{ArmDescription, Weight};
use crate::physics::imperfection::Imperfection;
use crate::physics::random::Random;
use crate::physics::rigid::Vector;
use crate::world::Instrument;

/// How finely the arm is set.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Resolution {
    /// Any angle; no machine is built so, but what a method itself costs is seen best with it.
    Continuous,
    /// Whole counts of the motors' encoders.
    Encoder,
}

/// The cage on the flange: a piece of tube with camera and projector.
#[derive(Debug, Clone, PartialEq)]
pub struct Cage {
    /// kg.
    pub mass_kg: f64,
    /// Where its weight acts, mm in the flange's frame.
    pub centre: Vector,
    /// How its back lies on the flange, rad about the flange's x, y and z: ideally not turned at all.
    pub lean: [f64; 3],
    /// The point whose place is asked for in the end, mm in the flange's frame.
    pub tip: Vector,
}

/// The table the arm stands on and over.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tabletop {
    /// Of its top under the arm's shoulder, mm; the shoulder is at 0.
    pub height: f64,
    /// Unit vector upward from it.
    pub normal: Vector,
}

/// A spirit level.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpiritLevel {
    /// Scatter and divisions, rad.
    pub instrument: Instrument,
    /// What it shows on a level surface, rad: the error of its own zero.
    pub zero: f64,
}

/// A whole world.
#[derive(Debug, Clone, PartialEq)]
pub struct PumaDescription {
    /// What a user calls it.
    pub title: String,
    /// From which everything that is left to chance is drawn.
    pub seed: u64,
    /// On paper.
    pub nominal: ArmDescription,
    /// How finely it is set.
    pub resolution: Resolution,
    /// Where the controller believes it to stand at the beginning, rad.
    pub start: [f64; AXES],
    /// By how much each joint truly stands beyond what is believed, rad.
    pub zero_error: [f64; AXES],
    /// By how much more, either way, drawn from the seed, rad.
    pub zero_error_within: [f64; AXES],
    /// What else is wrong with it.
    pub imperfections: Vec<Imperfection>,
    /// What it carries.
    pub cage: Cage,
    /// What it stands on.
    pub table: Tabletop,
    /// On hand.
    pub level: SpiritLevel,
    /// On hand; mm.
    pub ruler: Instrument,
    /// What the rig on the hand sees, where one is carried.
    pub light: Option<Arc<Light>>,
    /// On hand; mm, for each coordinate.
    pub tracker: Instrument,
    /// Where the controller keeps its calibration from one day to the next, if it does.
    pub calibration: Option<PathBuf>,
    /// The text of the file, if it came under a seal: the truth is hidden until somebody breaks it.
    pub sealed_text: Option<String>,
}

impl PumaDescription {
    /// The error of each joint's zero in this world, rad.
    pub fn drawn_zero_error(&self) -> [f64; AXES] {
        let mut random = Random::new(self.seed, "zero errors of a PUMA");
        let mut error = self.zero_error;
        for (error, within) in error.iter_mut().zip(&self.zero_error_within) {
            *error += within * random.between(-1.0, 1.0);
        }
        error
    }

    /// The arm on paper, with the cage's weight where it sits; whatever else is carried hangs on the middle of the flange.
    pub(super) fn arm(&self) -> ArmDescription {
        let mut arm = self.nominal.clone();
        arm.weights.push(Weight { after: AXES - 1, mass: self.cage.mass_kg, centre: self.cage.centre });
        arm.target = Vector::ZERO;
        arm
    }
}
