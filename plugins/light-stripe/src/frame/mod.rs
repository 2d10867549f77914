//! Pictures from files.

mod folder;
mod pgm;
mod picture;

pub use folder::FrameFolder;
pub use picture::{FrameError, Picture, read_picture, write_pgm};
