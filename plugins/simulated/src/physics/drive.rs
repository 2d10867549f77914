//! From command to joint: what motors, belts and gears do to an angle on its way.

mod eccentric_wheel;
mod gear_ratio;
mod loose_coupling;
mod lost_steps;
mod play;
mod settling;
mod stick_slip;
mod thrust_face;
mod viscous_lag;

use super::description::ArmDescription;
use super::imperfection::{Imperfection, Mechanism};
use gear_ratio::{Coupling, Ratio};
use loose_coupling::LooseCoupling;
use lost_steps::LostSteps;
use thrust_face::ThrustFace;
use viscous_lag::ViscousLag;

pub use eccentric_wheel::EccentricWheel;
pub use play::Play;
pub use settling::Settling;
pub use stick_slip::Detents;

/// One part of a drive. It sees the arm's angles at the end of each straight move, in order, and may remember; a copy remembers the same and goes its own way.
#[derive(Debug, Clone)]
pub(super) enum DrivePart {
    LostSteps(LostSteps),
    EccentricWheel(EccentricWheel),
    ThrustFace(ThrustFace),
    Ratio(Ratio),
    Coupling(Coupling),
    Play(Play),
    Detents(Detents),
    Settling(Settling),
    ViscousLag(ViscousLag),
    LooseCoupling(LooseCoupling),
}

impl DrivePart {
    /// Passes the angles (rad, or mm of a slide, as commanded so far) on to the next part, at world time `time_s`.
    pub(super) fn pass(&mut self, angles: &mut [f64], time_s: f64) {
        match self {
            Self::LostSteps(part) => part.pass(angles, time_s),
            Self::EccentricWheel(part) => part.pass(angles),
            Self::ThrustFace(part) => part.pass(angles),
            Self::Ratio(part) => part.pass(angles),
            Self::Coupling(part) => part.pass(angles),
            Self::Play(part) => part.pass(angles),
            Self::Detents(part) => part.pass(angles),
            Self::Settling(part) => part.pass(angles, time_s),
            Self::ViscousLag(part) => part.pass(angles),
            Self::LooseCoupling(part) => part.pass(angles),
        }
    }
}

/// The parts for these imperfections, in the order in which the force runs: motor, wheels, ratios, couplings, play, cables, creep.
pub(super) fn parts(arm: &ArmDescription, imperfections: &[Imperfection]) -> Vec<DrivePart> {
    let mut parts: Vec<(u8, DrivePart)> = imperfections.iter().filter_map(|one| part(arm, one)).collect();
    parts.sort_by_key(|(order, _)| *order);
    parts.into_iter().map(|(_, part)| part).collect()
}

fn part(arm: &ArmDescription, imperfection: &Imperfection) -> Option<(u8, DrivePart)> {
    let size = imperfection.size;
    Some(match imperfection.mechanism {
        Mechanism::JointStep { joint, at_s } => {
            (0, DrivePart::LostSteps(LostSteps { joint, lost: -size, at_s }))
        }
        Mechanism::JointHarmonic { joint, per_turn, phase } => {
            let wheel = EccentricWheel { joint, eccentricity: size * per_turn, per_turn, phase };
            (1, DrivePart::EccentricWheel(wheel))
        }
        Mechanism::ScrewWave { joint, pitch, per_turn, phase } => {
            (1, DrivePart::ThrustFace(ThrustFace { joint, pitch, per_turn, phase, runout: size }))
        }
        Mechanism::JointGain { joint } => (2, DrivePart::Ratio(Ratio { joint, excess: size })),
        Mechanism::JointCoupling { joint, driver } => {
            (3, DrivePart::Coupling(Coupling { joint, driver, ratio: size }))
        }
        Mechanism::JointBacklash { joint } => (4, DrivePart::Play(Play::even(joint, size))),
        Mechanism::WornGear { joint, worn_at, spread } => {
            (4, DrivePart::Play(Play::worn(joint, size, worn_at, spread)))
        }
        Mechanism::CableDrag { joint, driver } => {
            (5, DrivePart::Coupling(Coupling { joint, driver, ratio: size }))
        }
        Mechanism::StickSlip { joint, spacing, pattern } => {
            let travel = arm.joints.get(joint).map_or([0.0, 0.0], |row| row.limits);
            (6, DrivePart::Detents(Detents::new(joint, size, spacing, travel, pattern)))
        }
        Mechanism::JointSettling { joint, forgetting_s } => {
            (7, DrivePart::Settling(Settling::new(joint, size, forgetting_s)))
        }
        Mechanism::JointLag { joint } => (7, DrivePart::ViscousLag(ViscousLag::new(arm, joint, size))),
        Mechanism::LooseCoupling { joint, pattern } => {
            (8, DrivePart::LooseCoupling(LooseCoupling::new(joint, size, pattern)))
        }
        _ => return None,
    })
}
