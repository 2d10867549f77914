//! Where something was re-set, in the order of the rows.

use serde::Serialize;

/// A position in the order of the rows where something was re-set.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Jump {
    /// The last row before it and the first after it; rows count from 1, in the order of the table.
    pub between_rows: [usize; 2],
    /// The same as lines of the file.
    pub between_lines: [u32; 2],
    /// Time of the first row after it, s; nothing where no time is logged.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at_s: Option<f64>,
}
