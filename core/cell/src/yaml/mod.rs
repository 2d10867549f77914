//! Files people write by hand: YAML in which every value knows its place, and every mistake is shown where it stands.
//!
//! A file is first read into a tree of [`Node`]s; then each part of a format takes what it knows from a [`MapReader`], and what is left
//! over is a mistake. Mistakes are collected, not thrown: a reader of a file sees all of them at once.

mod map_reader;
mod node;
mod parse;
mod problem;
mod suggestion;
mod value;

pub use map_reader::MapReader;
pub use node::{Key, Node, NodeValue};
pub use parse::parse;
pub use problem::{FileProblems, Place, Problem, Problems};
pub use suggestion::{did_you_mean, one_of};
