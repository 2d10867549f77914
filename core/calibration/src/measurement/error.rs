//! Why a table and a model do not go together.

use thiserror::Error;

/// Why a table and a model do not go together.
#[derive(Debug, Error, PartialEq)]
pub enum ObservationsError {
    /// Different numbers of joints.
    #[error("{table}: the table has {found} joints (q1 ... q{found}) and the arm {arm} has {expected}")]
    JointCount {
        /// The table.
        table: String,
        /// Joints in it.
        found: usize,
        /// The arm.
        arm: String,
        /// Joints it has.
        expected: usize,
    },
    /// A slide given as an angle, or a turning joint as a length.
    #[error(
        "{table}: column `{column}`: joint `{joint}` of the arm {arm} {}: give it as {}",
        if *.slides { "slides" } else { "turns" },
        joint_headers(*.number, *.slides)
    )]
    JointUnit {
        /// The table.
        table: String,
        /// Its column.
        column: String,
        /// The arm.
        arm: String,
        /// The joint.
        joint: String,
        /// Its number among the joints of the table, from 1.
        number: usize,
        /// Whether it slides; else it turns.
        slides: bool,
    },
    /// A target the model does not have.
    #[error(
        "{table}: column `{target}_x` ... measures a target the model does not have; add `{target}` under `targets:`"
    )]
    UnknownTarget {
        /// The table.
        table: String,
        /// The target.
        target: String,
    },
    /// Something named in a row that the model does not have.
    #[error(
        "{table}: line {line}: `{name}` in column `{column}` is not in the model's `surfaces:`{suggestion}"
    )]
    UnknownSurface {
        /// The table.
        table: String,
        /// Line of the file.
        line: u32,
        /// What was written.
        name: String,
        /// `on` or `distance_to`.
        column: &'static str,
        /// What may have been meant.
        suggestion: String,
    },
    /// A row that needs something the model does not say.
    #[error("{table}: {reason}")]
    Incomplete {
        /// The table.
        table: String,
        /// What is missing and where it goes.
        reason: String,
    },
    /// No number was measured at all.
    #[error("{table}: nothing was measured; the table needs {columns}{hint}")]
    Nothing {
        /// The table.
        table: String,
        /// The columns that hold measurements: `p1_x_mm ..., touch or height_mm`.
        columns: String,
        /// The option that would read its other columns, on a line of its own; empty where their names suggest nothing.
        hint: String,
    },
}

/// The headers that a joint's column may have: `number` counts from 1, and a slide's are lengths.
fn joint_headers(number: usize, slides: bool) -> String {
    let units: &[&str] = if slides { &["mm", "m", "in"] } else { &["deg", "rad"] };
    let headers: Vec<String> = units.iter().map(|unit| format!("`q{number}_{unit}`")).collect();
    headers.join(" or ")
}
