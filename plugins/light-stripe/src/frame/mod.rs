//! Pictures from files.

mod folder;
mod grey_picture;
mod pgm;
mod picture;

pub use folder::FrameFolder;
pub use grey_picture::Picture;
pub use picture::{FrameError, read_picture, write_pgm};
