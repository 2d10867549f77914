//! The model lab: measurement tables, effects, fitting, criticism and next poses. Knows no device.

pub mod diagnosis;
pub mod effect;
pub mod file;
pub mod fit;
pub mod floor;
pub mod forward;
pub mod laboratory;
mod opened;
pub mod plot;
pub mod prediction;
pub mod progress;
pub mod report;
pub mod revision;
pub mod split;
pub mod statistics;
pub mod stripe;
pub mod table;
pub mod template;
mod validation;
