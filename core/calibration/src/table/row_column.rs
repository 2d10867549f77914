//! The columns that a written row of measurements may have besides the coordinates of the joints: those that are understood where a table is read.

use super::header::{Meaning, known_headers, parse};
use super::orientation::Body;

/// What a column of a row is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RowColumn {
    /// A number that was measured.
    Reading,
    /// A word that says on what, or with what, it was measured.
    Word,
    /// How sure a reading is, 1 standard deviation.
    Uncertainty,
    /// A number that says under which conditions it was measured.
    Condition,
}

impl RowColumn {
    /// What a column of this header is for, with whatever unit a table may have; nothing of a column that no kind of measurement reads, or that says where the
    /// arm was.
    ///
    /// # Errors
    /// A known quantity without its unit, or with one it cannot have, in words.
    pub fn of(header: &str) -> Result<Option<Self>, String> {
        Ok(match parse(header)? {
            Meaning::Position { .. }
            | Meaning::Turn { body: Body::Target(_) | Body::Board, .. }
            | Meaning::Board { .. }
            | Meaning::Profile { .. }
            | Meaning::Scalar { .. }
            | Meaning::Tilt { .. } => Some(Self::Reading),
            Meaning::On
            | Meaning::Level
            | Meaning::BoardSeen
            | Meaning::DistanceTo
            | Meaning::Touch
            | Meaning::Session => Some(Self::Word),
            Meaning::Std { .. } => Some(Self::Uncertainty),
            Meaning::Temperature | Meaning::Payload | Meaning::Repeat => Some(Self::Condition),
            Meaning::Coordinate { .. }
            | Meaning::Flange { .. }
            | Meaning::Turn { body: Body::Flange, .. }
            | Meaning::Signal
            | Meaning::Time
            | Meaning::Approach { .. }
            | Meaning::Covariate => None,
        })
    }

    /// Headers that [`Self::of`] knows, to name one that comes near a slip.
    pub fn headers() -> Vec<String> {
        let mut known = known_headers();
        known.retain(|header| matches!(Self::of(header), Ok(Some(_))));
        known
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measurement::kinds;

    #[test]
    fn every_kind_of_measurement_has_a_column_that_a_row_may_have() {
        for kind in kinds().iter().filter(|kind| !kind.columns().is_empty()) {
            let first = kind.columns().split([' ', ',']).next().unwrap();
            assert!(matches!(RowColumn::of(first), Ok(Some(_))), "{}: `{first}`", kind.name());
        }
        assert!(RowColumn::headers().contains(&"p1_elevation_deg".to_owned()));
    }

    #[test]
    fn where_the_arm_was_and_what_no_kind_reads_are_no_columns_of_a_row() {
        for header in ["q1_deg", "flange_x_mm", "approach_q2", "time_s", "humidity"] {
            assert_eq!(RowColumn::of(header), Ok(None), "{header}");
        }
        assert!(RowColumn::of("p1_azimuth").unwrap_err().contains("p1_azimuth_deg"));
    }
}
