#![doc = include_str!("../README.md")]

mod counted;
mod error;
mod file;
mod kind;
mod kinds;
mod map_reader;
mod node;
mod parse;
mod problem;
mod read;
mod spanned_value;
mod suggestion;
mod typed;
mod value;

pub use counted::counted;
pub use error::ReadError;
pub use file::read_document;
pub use kind::FileKind;
pub use kinds::{DocumentKind, kind_of, parse_as};
pub use map_reader::MapReader;
pub use node::{Key, Node, NodeValue};
pub use parse::parse;
pub use problem::{FileProblems, Problem, Problems, Span};
pub use read::{LimitedReader, lines, open, read_bytes, read_text, text_of};
pub use suggestion::{did_you_mean, nearest, one_of};
pub use typed::{OtherKeys, Spanned, schema_of, typed, typed_with, with_words};
