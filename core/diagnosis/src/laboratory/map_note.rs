//! What a model's residual map does to a table.

use serde::Serialize;

/// What a comparison finds of the model's residual map.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct MapNote {
    /// Fraction of the variance that it takes away of what the model leaves.
    pub not_understood: f64,
    /// Rows of the table inside the region that was measured, where it acts.
    pub rows_inside: usize,
    /// All rows.
    pub rows: usize,
}
