//! The orchestrator: workcell files, devices, procedures, safety and corrections.

mod answer_bounds;
pub mod answers;
mod cell_names;
mod check_cell;
mod check_context;
mod check_file;
pub mod command;
mod deg_or_mm;
pub mod device;
mod drawing;
pub mod engine;
pub mod event;
pub mod expression;
mod in_words;
mod joint_range;
pub mod measurement_table;
mod motor_quantity;
mod named_value;
mod parameter_name;
pub mod photo;
pub mod procedure;
pub mod prompt;
mod read_context;
mod run_handle;
pub mod schema;
pub mod step;
mod step_path;
mod stream_fields;
mod stream_names;
pub mod workcell;

pub use check_cell::check_cell;
pub use check_file::{CheckedFile, cells_that_name, check_file, kind_of_file};
pub use deg_or_mm::DegOrMm;
pub use in_words::{
    NOT_DETERMINED, change_in_words, corrected_quantity, give_or_take, known_within, left_open,
    sentence_case, surface_called, uncertainty_digits, with_decimals,
};
pub use run_handle::{RunHandle, StopAction, StopActions};
