#![doc = include_str!("../README.md")]

mod central;
mod control_limits;
mod error;
mod fleet;
mod model_effects;
mod ship;

pub use central::Central;
pub use control_limits::{ControlLimits, FEWEST_VALUES};
pub use error::CentralError;
pub use fleet::{CellState, CorrectionPoint, EffectPoint, Waiting};
pub use ship::{Shipped, Shipper};
