//! The orchestrator: workcell files, devices, procedures, safety and corrections.

pub mod answers;
mod check_file;
pub mod cloud;
pub mod command;
pub mod device;
mod drawing;
pub mod engine;
pub mod event;
pub mod expression;
mod file;
mod in_words;
pub mod measurement_table;
pub mod photo;
pub mod procedure;
pub mod prompt;
mod read_context;
mod run_handle;
pub mod schema;
pub mod step;
pub mod workcell;
pub mod yaml;

pub use check_file::{CheckedFile, FileKind, check_file, kind_of_file};
pub use in_words::{
    NOT_DETERMINED, change_in_words, corrected_quantity, give_or_take, known_within, left_open,
    uncertainty_digits,
};
pub use read_context::DegOrMm;
pub use run_handle::{RunHandle, StopAction, StopActions};
