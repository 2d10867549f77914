//! The small constant errors every arm has, and which of them the user's model leaves free.

use crate::physics::imperfection::{Imperfection, Mechanism};
use crate::physics::random::Random;

use super::specification::{Free, Specification};

/// Whether the user's model leaves the base's pose free: not when something of the base or the instrument's level is to be found.
pub(super) fn frees_base(specification: &Specification) -> bool {
    !hides(specification, &["base_tilt", "base_position", "drift", "instrument_tilt"])
}

/// Whether it leaves the target free.
pub(super) fn frees_target(specification: &Specification) -> bool {
    !hides(specification, &["tool_offset"])
}

fn hides(specification: &Specification, names: &[&str]) -> bool {
    specification.hidden.iter().any(|requested| names.contains(&requested.choice.name.as_str()))
}

/// Draws the arm's constant errors: of everything the model leaves free, and nothing else.
pub(super) fn nuisances(specification: &Specification, seed: u64) -> Vec<Imperfection> {
    let mut random = Random::new(seed, "nuisances");
    let mut all = Vec::new();
    let mut add = |mechanism: Mechanism, size: f64| all.push(Imperfection { mechanism, size });
    let direction = random.between(0.0, std::f64::consts::TAU);
    let tilt = Mechanism::BaseTilt { axis: [direction.cos(), direction.sin(), 0.0] };
    let tilt_size = 0.2_f64.to_radians() * random.normal();
    let shift = Mechanism::BasePosition { direction: random.direction().into() };
    let shift_size = random.between(0.5, 4.0);
    if frees_base(specification) {
        add(tilt, tilt_size);
        add(shift, shift_size);
    }
    let offset = Mechanism::ToolOffset { direction: random.direction().into() };
    let offset_size = random.between(0.2, 1.5);
    if frees_target(specification) {
        add(offset, offset_size);
    }
    for joint in 0..specification.arm.joints.len() {
        let sizes = [random.normal(), random.normal(), random.normal(), random.normal(), random.normal()];
        if specification.free != Free::None {
            add(Mechanism::JointZero { joint }, 0.1_f64.to_radians() * sizes[0]);
        }
        if specification.free == Free::Geometry {
            add(Mechanism::LinkLength { joint }, 0.3 * sizes[1]);
            add(Mechanism::LinkOffset { joint }, 0.3 * sizes[2]);
            add(Mechanism::LinkTwist { joint }, 0.03_f64.to_radians() * sizes[3]);
            add(Mechanism::AxisSkew { joint }, 0.03_f64.to_radians() * sizes[4]);
        }
    }
    all
}
