//! From command to joint: what motors, belts and gears do to an angle on its way.

mod eccentric_wheel;
mod gear_ratio;
mod loose_coupling;
mod lost_steps;
mod play;
mod settling;
mod stick_slip;
mod thrust_face;

use super::description::ArmDescription;
use super::imperfection::{Imperfection, Mechanism};

pub use eccentric_wheel::EccentricWheel;
pub use play::Play;
pub use settling::Settling;
pub use stick_slip::Detents;

/// One part of a drive. It sees the arm's angles at the end of each straight move, in order, and may remember.
pub trait DrivePart: Send {
    /// Passes the angles (rad, as commanded so far) on to the next part, at world time `time_s`.
    fn pass(&mut self, angles: &mut [f64], time_s: f64);
}

/// The parts for these imperfections, in the order in which the force runs: motor, wheels, ratios, couplings, play, creep.
pub fn parts(arm: &ArmDescription, imperfections: &[Imperfection]) -> Vec<Box<dyn DrivePart>> {
    let mut parts: Vec<(u8, Box<dyn DrivePart>)> =
        imperfections.iter().filter_map(|one| part(arm, one)).collect();
    parts.sort_by_key(|(order, _)| *order);
    parts.into_iter().map(|(_, part)| part).collect()
}

fn part(arm: &ArmDescription, imperfection: &Imperfection) -> Option<(u8, Box<dyn DrivePart>)> {
    let size = imperfection.size;
    Some(match imperfection.mechanism {
        Mechanism::JointStep { joint, at_s } => {
            (0, Box::new(lost_steps::LostSteps { joint, lost: -size, at_s }))
        }
        Mechanism::JointHarmonic { joint, per_turn, phase } => {
            (1, Box::new(EccentricWheel { joint, eccentricity: size * per_turn, per_turn, phase }))
        }
        Mechanism::ScrewWave { joint, pitch, per_turn, phase } => {
            (1, Box::new(thrust_face::ThrustFace { joint, pitch, per_turn, phase, runout: size }))
        }
        Mechanism::JointGain { joint } => (2, Box::new(gear_ratio::Ratio { joint, excess: size })),
        Mechanism::JointCoupling { joint, driver } => {
            (3, Box::new(gear_ratio::Coupling { joint, driver, ratio: size }))
        }
        Mechanism::JointBacklash { joint } => (4, Box::new(Play::even(joint, size))),
        Mechanism::WornGear { joint, worn_at, spread } => {
            (4, Box::new(Play::worn(joint, size, worn_at, spread)))
        }
        Mechanism::StickSlip { joint, spacing, pattern } => {
            let travel = arm.joints.get(joint).map_or([0.0, 0.0], |row| row.limits);
            (5, Box::new(Detents::new(joint, size, spacing, travel, pattern)))
        }
        Mechanism::JointSettling { joint, forgetting_s } => {
            (6, Box::new(Settling::new(joint, size, forgetting_s)))
        }
        Mechanism::LooseCoupling { joint, pattern } => {
            (7, Box::new(loose_coupling::LooseCoupling::new(joint, size, pattern)))
        }
        _ => return None,
    })
}
