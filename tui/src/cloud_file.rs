//! Clouds as files of other programs, and theirs as clouds. What a scan leaves by itself (PLY, PCD, the lab's tables) the cell writes.

mod number_format;
mod read;
mod write;

pub(crate) use read::read;
pub(crate) use write::{CloudCamera, write};
