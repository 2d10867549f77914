//! Why a table cannot be read.

use plumb_document::counted;
use thiserror::Error;

use crate::opened::why;

/// Why a table cannot be read. The message names the place and what would be right.
#[derive(Debug, Error)]
pub enum TableError {
    /// The file cannot be opened or read.
    #[error("{path}: {}", why(cause))]
    Open {
        /// The file.
        path: String,
        /// What the system said.
        cause: std::io::Error,
    },
    /// Nothing in it, or no rows.
    #[error("{path}: {reason}")]
    Empty {
        /// The file.
        path: String,
        /// What is missing.
        reason: String,
    },
    /// The header cannot be understood.
    #[error("{path}: line 1, column {column} (`{name}`): {reason}")]
    Header {
        /// The file.
        path: String,
        /// Counted from 1.
        column: usize,
        /// The header's text.
        name: String,
        /// What is wrong and what would be right.
        reason: String,
    },
    /// Several headers cannot be understood.
    #[error("{path}: {} columns of line 1 cannot be read{}", problems.len(), problems.iter().map(ToString::to_string).collect::<String>())]
    Headers {
        /// The file.
        path: String,
        /// Each of them.
        problems: Vec<HeaderProblem>,
    },
    /// A cell cannot be understood.
    #[error("{path}: line {line}, column {column} (`{name}`): {reason}")]
    Cell {
        /// The file.
        path: String,
        /// Line of the file.
        line: u64,
        /// Counted from 1.
        column: usize,
        /// The column's header.
        name: String,
        /// What is wrong and what would be right.
        reason: String,
    },
    /// A row has more or fewer cells than the header.
    #[error("{path}: line {line}: {cells} where the header has {expected}{hint}", cells = counted(*found, "cell", "cells"))]
    RowLength {
        /// The file.
        path: String,
        /// Line of the file.
        line: u64,
        /// Cells in the row.
        found: usize,
        /// Cells in the header.
        expected: usize,
        /// What may be the reason.
        hint: &'static str,
    },
    /// Not text that can be split into cells.
    #[error("{path}: {reason}")]
    Malformed {
        /// The file.
        path: String,
        /// What the reader said.
        reason: String,
    },
}

/// A header that cannot be understood.
#[derive(Debug, Error)]
#[error("\n  column {column} (`{name}`): {reason}")]
pub struct HeaderProblem {
    /// Counted from 1.
    pub column: usize,
    /// The header's text.
    pub name: String,
    /// What is wrong and what would be right.
    pub reason: String,
}
