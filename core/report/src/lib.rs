//! Words and pictures for people: what the other crates find, as sentences, figures, tables and pages.

pub mod csv;
pub mod figure;
pub mod json;
pub mod model_report;
mod phrase;
pub mod plot;
pub mod run_words;
#[cfg(test)]
mod testing;
mod words;

pub use phrase::{is_determined, noise_text, percent};
pub use words::{
    alike_in_words, comparison_sentence, diagnosis_sentence, explainable_sentence, gauge_in_words,
    growth_sentence, hypothesis_sentence, instead_in_words, map_in_words, map_sentence, next_poses_sentence,
    note_in_words, objection_in_words, rejection_in_words, rest_in_words, why_held_in_words,
};
