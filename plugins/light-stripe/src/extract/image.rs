//! A grey picture as the extractor sees it.

/// A grey picture, 8 bits a pixel, rows from the top, borrowed from wherever it lies.
#[derive(Debug, Clone, Copy)]
pub struct Image<'a> {
    pixels: &'a [u8],
    width: usize,
    height: usize,
}

/// The widest and highest picture, pixels.
pub const LARGEST_SIDE: usize = 16_384;

/// A picture whose bytes do not fit its size.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum ImageError {
    /// Too few or too many bytes.
    #[error("a picture of {width} x {height} has {} bytes; these are {bytes}", width * height)]
    Length {
        /// Pixels in a row.
        width: usize,
        /// Rows.
        height: usize,
        /// What was given.
        bytes: usize,
    },
    /// No pixels, or more than can be.
    #[error("a picture of {width} x {height} pixels cannot be used; each side is 1 to {LARGEST_SIDE}")]
    Size {
        /// Pixels in a row.
        width: usize,
        /// Rows.
        height: usize,
    },
}

impl<'a> Image<'a> {
    /// A picture over its bytes, a row after the other.
    ///
    /// # Errors
    /// [`ImageError`] when the bytes are not `width * height`.
    pub fn new(width: usize, height: usize, pixels: &'a [u8]) -> Result<Self, ImageError> {
        if !(1..=LARGEST_SIDE).contains(&width) || !(1..=LARGEST_SIDE).contains(&height) {
            return Err(ImageError::Size { width, height });
        }
        if pixels.len() != width * height {
            return Err(ImageError::Length { width, height, bytes: pixels.len() });
        }
        Ok(Self { pixels, width, height })
    }

    /// Pixels in a row.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// All pixels.
    pub fn pixels(&self) -> &'a [u8] {
        self.pixels
    }

    /// The rows from one on.
    #[inline]
    pub(super) fn rows_from(&self, row: usize) -> impl Iterator<Item = &'a [u8]> {
        self.pixels.get(row * self.width..).unwrap_or_default().chunks_exact(self.width)
    }

    /// A row; empty past the last.
    pub fn row(&self, row: usize) -> &'a [u8] {
        self.pixels.get(row * self.width..(row + 1) * self.width).unwrap_or_default()
    }
}
