//! What there is to say of a model's residual map.

use serde::Serialize;

/// What a comparison says of the model's residual map.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct MapNote {
    /// Share of the variance that it takes away of what the model leaves.
    pub not_understood: f64,
    /// Rows of the table inside the region that was measured, where it acts.
    pub rows_inside: usize,
    /// All rows.
    pub rows: usize,
}

impl MapNote {
    /// In words.
    pub fn sentence(&self) -> String {
        format!(
            "a residual map takes {:.0} % of the variance that the model leaves: not understood; it acts in {} of {} rows, where was measured",
            100.0 * self.not_understood,
            self.rows_inside,
            self.rows
        )
    }
}
