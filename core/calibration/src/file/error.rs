//! What can be wrong with a model file, with the place and what would be right.

use std::fmt;

use plumb_document::FileProblems;
use thiserror::Error;

/// A place in a file, counted from 1; line 0 when the place is not known.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct FilePosition {
    /// The file.
    pub path: String,
    /// Line.
    pub line: u64,
    /// Column.
    pub column: u64,
}

impl fmt::Display for FilePosition {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.line {
            0 => write!(formatter, "{}", self.path),
            line => write!(formatter, "{}: line {line}, column {}", self.path, self.column),
        }
    }
}

/// Why a model file cannot be used: every mistake in it.
#[derive(Debug, Error)]
#[error(transparent)]
pub struct ModelFileError(#[from] pub FileProblems);
