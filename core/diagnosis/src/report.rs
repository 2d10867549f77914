//! One page that needs no other file: how large the error is, how much of it could be explained, where it is, which effect, how sure, what adding effects
//! did, what to measure next.

mod fall_picture;
mod gather;
mod page;
mod shown_rows;
mod tables;

pub use gather::{Chapter, Fall, Report, StepKind};
pub use page::html;
