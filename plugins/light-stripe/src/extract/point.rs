//! What is found in a row.

use bytemuck::{Pod, Zeroable};

/// The stripe in one row.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq, Pod, Zeroable)]
pub struct RowPoint {
    /// The row, pixels from the top.
    pub row: u32,
    /// What is special about it, see the constants.
    pub flags: u32,
    /// The stripe's centre, pixels; the middle of the first pixel is 0.
    pub centre: f32,
    /// The centre's standard uncertainty, pixels.
    pub sigma: f32,
    /// Lit pixels in the row.
    pub width: f32,
    /// The brightest grey level.
    pub peak: f32,
}

impl RowPoint {
    /// Pixels of it are as bright as can be: its middle is not known as well as it looks.
    pub const SATURATED: u32 = 1;
    /// A spur was joined to it in this very row and cut off.
    pub const SPUR: u32 = 2;
    /// The picture's edge cuts it.
    pub const AT_EDGE: u32 = 4;

    /// Whether one of these flags is set.
    pub fn is(&self, flags: u32) -> bool {
        self.flags & flags != 0
    }
}
