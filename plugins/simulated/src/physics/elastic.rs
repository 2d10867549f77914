//! What yields under load: springs in the drives, beams for links, cables, feet. All act at once and on the yielded arm.

mod beam;
mod guideway;
mod rocking_base;
mod shaft;
mod torsion_spring;
mod wind_up;

use std::fmt::Debug;

use super::imperfection::{Imperfection, Mechanism};
use super::link_frames::{LinkFrames, Load};
use super::rigid::{Rigid, Vector};
use super::shape::Arm;

pub use torsion_spring::StiffeningSpring;

/// An arm under load, as the elastic parts see it.
pub struct Loaded<'arm> {
    /// The arm at home.
    pub arm: &'arm Arm,
    /// Its pose, all yielding included.
    pub link_frames: &'arm LinkFrames,
    /// The joints' angles, yielding included, rad.
    pub angles: &'arm [f64],
    /// What hangs beyond each joint.
    pub loads: &'arm [Load],
    /// Gravity's moment on each drive, N m: on each joint, where each has a drive of its own.
    pub moments: &'arm [f64],
    /// At the target, kg.
    pub payload: f64,
}

/// How far everything has yielded.
#[derive(Debug, Clone, PartialEq)]
pub struct Yielding {
    /// Turn of each drive, rad: of each joint, where each has a drive of its own.
    pub turns: Vec<f64>,
    /// Motion of each link's far end, base frame at home.
    pub bends: Vec<Rigid>,
    /// Turn of the base, a rotation vector in the world, rad.
    pub rocking: Vector,
}

impl Yielding {
    /// Nothing has yielded yet.
    pub fn none(drives: usize) -> Self {
        Self { turns: vec![0.0; drives], bends: Vec::new(), rocking: Vector::ZERO }
    }

    /// Adds to a drive's turn.
    pub fn turn(&mut self, drive: usize, angle: f64) {
        if let Some(turn) = self.turns.get_mut(drive) {
            *turn += angle;
        }
    }

    /// Adds to a link's bending.
    pub fn bend(&mut self, joint: usize, bend: Rigid) {
        self.bends.resize(self.turns.len(), Rigid::IDENTITY);
        if let Some(entry) = self.bends.get_mut(joint) {
            *entry = *entry * bend;
        }
    }
}

/// One part that yields.
pub trait ElasticPart: Debug + Send + Sync {
    /// Adds how far this part yields to the present load.
    fn yield_to(&self, loaded: &Loaded<'_>, yielding: &mut Yielding);
}

/// The elastic parts among these imperfections.
pub fn parts(imperfections: &[Imperfection]) -> Vec<Box<dyn ElasticPart>> {
    imperfections.iter().filter_map(part).collect()
}

fn part(imperfection: &Imperfection) -> Option<Box<dyn ElasticPart>> {
    let size = imperfection.size;
    Some(match imperfection.mechanism {
        Mechanism::JointCompliance { joint } => {
            Box::new(torsion_spring::TorsionSpring { joint, compliance: size })
        }
        Mechanism::JointStiffening { joint, knee } => {
            Box::new(StiffeningSpring { joint, compliance: size, knee })
        }
        Mechanism::LinkSag { joint } => Box::new(beam::Beam { joint, flexibility: size }),
        Mechanism::LinkTorsion { joint } => Box::new(shaft::Shaft { joint, flexibility: size }),
        Mechanism::AxisRoll { joint } => Box::new(guideway::Twisted { joint, twist: size }),
        Mechanism::AxisPitch { joint } => {
            Box::new(guideway::Bowed { joint, curvature: size, toward: guideway::Toward::Up })
        }
        Mechanism::AxisYaw { joint } => {
            Box::new(guideway::Bowed { joint, curvature: size, toward: guideway::Toward::Left })
        }
        Mechanism::CableWindUp { joint, slack } => Box::new(wind_up::WindUp { joint, pull: size, slack }),
        Mechanism::RockingBase { direction, softness } => {
            Box::new(rocking_base::RockingBase { direction, softness, tilt: size })
        }
        _ => return None,
    })
}
