//! Words and pictures for people: what the other crates find, as sentences, figures, tables and pages.

pub mod csv;
pub mod figure;
pub mod json;
pub mod model_report;
pub mod plot;
pub mod run_words;
#[cfg(test)]
mod testing;
mod words;

pub use words::{
    alike_in_words, diagnosis_sentence, growth_sentence, objection_in_words, rejection_in_words,
    rest_in_words,
};
