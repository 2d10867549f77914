//! The program's own reader and writer of clouds, which its binary keeps to itself.

#[path = "../../tui/src/cloud_file/number_format.rs"]
mod number_format;
#[path = "../../tui/src/cloud_file/read.rs"]
mod read;
#[path = "../../tui/src/cloud_file/write.rs"]
mod write;

pub(crate) use read::read;
pub(crate) use write::write;
