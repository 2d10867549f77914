//! Model files: what the machine is believed to be, in YAML people and scripts write by hand.

mod contradiction;
mod define;
mod error;
mod model;
mod raw;
mod sensor;
mod syntax;
mod urdf;
mod validate;
mod write;

pub(crate) use error::suggestion;
pub use error::{ModelFileError, Place};
pub use model::{
    AddedEffect, Base, Frame, Level, MeasuredFrom, Model, Noise, Revision, Surface, SurfaceShape, Target,
    Touch, TouchDistance,
};
pub use sensor::Sensor;
pub use write::model_text;
