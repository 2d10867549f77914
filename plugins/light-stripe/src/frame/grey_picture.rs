//! A grey picture in memory.

use crate::extract::{Image, ImageError};

/// A grey picture, 8 bits a pixel.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Picture {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// A row after the other, from the top.
    pub pixels: Vec<u8>,
}

impl Picture {
    /// For the extractor.
    ///
    /// # Errors
    /// [`ImageError`] for one whose pixels do not fit its size.
    pub fn image(&self) -> Result<Image<'_>, ImageError> {
        Image::new(self.width, self.height, &self.pixels)
    }
}
