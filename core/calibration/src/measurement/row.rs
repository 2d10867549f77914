//! One row of a table beside a model: what kinds of measurement read their equations from.

use super::error::ObservationsError;
use crate::arm_model::Model;
use crate::table::Table;
use crate::table::scalar::Scalar;

/// A column that names a surface or a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Named {
    /// `on`.
    On,
    /// `distance_to`.
    DistanceTo,
}

impl Named {
    fn column(self) -> &'static str {
        match self {
            Self::On => "on",
            Self::DistanceTo => "distance_to",
        }
    }
}

/// A row of a table, and the model it is compared with.
#[derive(Debug, Clone, Copy)]
pub struct RowReader<'a> {
    /// The model.
    pub model: &'a Model,
    /// The table.
    pub table: &'a Table,
    /// The row.
    pub row: usize,
}

impl RowReader<'_> {
    /// The row's number in a column that a kind of measurement declares, mm or rad; not a number where the column or the cell is missing.
    pub fn scalar(&self, scalar: &Scalar) -> f64 {
        self.table.scalar(scalar).and_then(|column| column.get(self.row)).copied().unwrap_or(f64::NAN)
    }

    /// The row's line in the table's file; 0 for a table that was made in memory.
    pub fn line(&self) -> u32 {
        self.table.lines.get(self.row).copied().unwrap_or(0)
    }

    /// An error that says what is missing.
    pub fn incomplete(&self, reason: String) -> ObservationsError {
        ObservationsError::Incomplete { table: self.table.source.clone(), reason }
    }

    /// The surface named in a column, by its index in the model; nothing where the cell is empty.
    ///
    /// # Errors
    /// The model has no target that could lie on it, or no surface of this name.
    pub fn surface(&self, named: Named) -> Result<Option<usize>, ObservationsError> {
        let names = match named {
            Named::On => &self.table.on,
            Named::DistanceTo => &self.table.distance_to,
        };
        let column = named.column();
        let Some(name) = names.name(self.row) else { return Ok(None) };
        if self.model.targets.is_empty() {
            return Err(self.incomplete(format!("column `{column}` needs a target p1 in the model")));
        }
        let known = self.model.surfaces.iter().map(|surface| surface.name.as_str());
        self.model.surface_position(name).map(Some).ok_or_else(|| ObservationsError::UnknownSurface {
            table: self.table.source.clone(),
            line: self.line(),
            name: name.to_owned(),
            column,
            suggestion: crate::suggestion::suggestion(name, known),
        })
    }
}
