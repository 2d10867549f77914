//! Calibration: the arm model and its effects, measurement tables, model files, and the fit of one to the other. Knows no
//! device.

pub mod arm_model;
pub mod board_picture;
pub mod board_table;
pub mod effect;
pub mod export;
pub mod file;
pub mod fit;
pub mod forward;
pub mod measurement;
mod opened;
pub mod placeholders;
pub mod prediction;
pub mod profile_table;
mod reading_unit;
pub mod revision;
mod suggestion;
pub mod table;
pub mod template;
