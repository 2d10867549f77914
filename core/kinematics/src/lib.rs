//! Frames and chains of joints: forward kinematics, derivatives, gravity moments, inverse.
//!
//! Lengths are millimetres, angles radians. A chain is a row of joints; each joint's row of numbers is read in the
//! distal (standard) or the proximal (modified) Denavit-Hartenberg convention. Every error a row can have
//! ([`Deviation`]) moves the tip by a small twist about a known axis, so derivatives are exact and axes that are
//! parallel are no special case.

mod chain;
pub mod closed_form;
mod gravity;
mod half_space;
mod inverse;
mod link_frames;
pub mod urdf;
pub mod yang_siegel;

pub use chain::{Chain, ChainError, Convention, Joint, Motion};
pub use gravity::{GRAVITY, Mass, Sag, Weights};
pub use half_space::HalfSpace;
pub use inverse::{OutOfReach, inverse};
pub use link_frames::{Deviation, DhParameter, JointFrame, LinkFrames, Twist};
