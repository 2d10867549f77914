//! Model files: what the machine is believed to be, in YAML people and scripts write by hand.

mod contradiction;
mod define;
mod epochs;
mod error;
mod hand;
mod noise;
mod parts;
mod raw;
mod residual_map;
mod schema;
mod urdf;
mod urdf_frames;
mod validate;
mod write;
mod yaml_text;

pub use error::{FilePosition, ModelFileError};
pub use schema::model_schema;
pub use write::model_text;

#[cfg(test)]
mod tests;
