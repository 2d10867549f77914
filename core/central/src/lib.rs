#![doc = include_str!("../README.md")]

mod attention;
mod central;
mod comparison;
mod control_limits;
mod error;
mod fleet;
mod inspection;
mod model_effects;
mod reader;
mod ship;
mod sql;

pub use attention::{BadEnd, OpenStep};
pub use central::Central;
pub use comparison::{CellSummary, CellValues, compare};
pub use control_limits::{ControlLimits, FEWEST_VALUES};
pub use error::CentralError;
pub use fleet::{CellState, CorrectionPoint, EffectPoint, Quantity, Waiting};
pub use inspection::{Inspection, Shipment};
pub use reader::Reader;
pub use ship::{Shipped, Shipper};
