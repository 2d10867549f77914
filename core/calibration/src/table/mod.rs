//! Measurement tables: what was commanded, what was measured, under which conditions.

mod columns;
mod error;
mod flange_pose;
mod header;
mod naming;
mod number;
mod orientation;
mod profile;
mod read;
mod row_column;
pub mod scalar;
mod stretch;
mod text;
mod write;

pub use columns::{Covariate, CovariateValues, MOST_LEVELS, Names, PositionColumns, Table};
pub use error::{HeaderProblem, TableError};
pub(crate) use naming::suggestion;
pub use naming::{Naming, Rename};
pub use orientation::{Body, OrientationColumns, OrientationForm, UNIT_TOLERANCE, quaternion};
pub use profile::ProfileColumns;
pub use row_column::RowColumn;
pub use stretch::Stretch;
pub use text::with_line_feeds;
pub use write::table_text;

#[cfg(test)]
mod tests;
