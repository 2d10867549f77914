//! Sentences of what the lab finds, made from its typed results.

mod few_poses;
mod growth;
mod jumps;
mod rejection;
mod rest;
mod verdict;

pub use growth::growth_sentence;
pub use rejection::{objection_in_words, rejection_in_words};
pub use rest::rest_in_words;
pub use verdict::{alike_in_words, diagnosis_sentence};
