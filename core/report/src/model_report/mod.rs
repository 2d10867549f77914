//! What the lab found of a model, as one page that needs no other file: how large the error is, how much of it could be explained, where it is, which effect,
//! how sure, what adding effects did, what to measure next.

mod error_picture;
mod page;
mod shown_rows;
mod tables;

pub use page::html;
