//! Inverse kinematics in closed form for the arms here: every configuration that reaches a pose, and what cannot be reached said with the reason.

mod puma;
mod teachmover;

pub use puma::{Elbow, PumaConfiguration, PumaGeometry, Shoulder, Wrist};
pub use teachmover::{Side, TeachMoverConfiguration, TeachMoverGeometry, TeachMoverPose};

/// Why no joints bring the arm there.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum NoSolution {
    /// Too far out, or too near.
    #[error("{away_mm:.2} mm out of reach")]
    OutOfReach {
        /// By how much the arm is too short, or too long, mm.
        away_mm: f64,
    },
    /// The place is on, or too near to, the axis of the first joint: it cannot be determined which way the joint is to turn.
    #[error(
        "{radius_mm:.3} mm from the first joint's axis, where its angle is not determined: go round the axis at some distance"
    )]
    OnFirstAxis {
        /// Distance from the axis, mm.
        radius_mm: f64,
    },
}

/// An angle brought to between -pi and pi.
fn wrapped(angle: f64) -> f64 {
    let turn = std::f64::consts::TAU;
    (angle + turn / 2.0).rem_euclid(turn) - turn / 2.0
}
