//! Sentences of what the lab finds, made from its typed results.

mod comparison;
mod explainable;
mod few_poses;
mod growth;
mod hypothesis;
mod jumps;
mod next_poses;
mod note;
mod rejection;
mod residual_map;
mod rest;
mod verdict;

pub use comparison::{comparison_sentence, gauge_in_words, why_held_in_words};
pub use explainable::explainable_sentence;
pub use growth::growth_sentence;
pub use hypothesis::hypothesis_sentence;
pub use next_poses::{instead_in_words, next_poses_sentence};
pub use note::note_in_words;
pub use rejection::{objection_in_words, rejection_in_words};
pub use residual_map::{map_in_words, map_sentence};
pub use rest::rest_in_words;
pub use verdict::{alike_in_words, diagnosis_sentence};
