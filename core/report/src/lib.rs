//! Words and pictures for people: what the other crates find, as figures, tables and pages.

pub mod csv;
pub mod figure;
pub mod run_words;
