//! What the arm and its surroundings are believed to be.

mod epochs;
mod model;
mod sensor;
mod surface;

pub use epochs::Epochs;
pub use model::{
    AddedEffect, Base, Correction, Frame, Level, MeasuredFrom, Model, Noise, Revision, Surface, Target,
    Touch, TouchDistance,
};
pub use sensor::Sensor;
pub use surface::{SurfaceShape, square_to};
