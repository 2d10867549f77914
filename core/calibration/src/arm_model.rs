//! What the arm and its surroundings are believed to be.

mod epochs;
mod measured_region;
mod model;
mod residual_map;
mod rig_number;
mod sensor;
mod stripe_rig;
mod surface;
#[cfg(test)]
mod tests;

pub use epochs::Epochs;
pub use measured_region::{JointRange, MeasuredRegion, Outside};
pub use model::{
    AddedEffect, Base, Board, Correction, Frame, Level, MeasuredFrom, Model, Noise, Revision, Surface,
    Target, Touch, TouchDistance, ValuePrior,
};
pub use residual_map::{Along, MapCarrier, MapEffect, ResidualMap, Side, Wave};
pub use rig_number::RigNumber;
pub use sensor::Sensor;
pub use stripe_rig::StripeRig;
pub use surface::{SurfaceShape, square_to};
