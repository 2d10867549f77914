//! The unit in which the errors of a table's readings are shown: the one place that decides it.

use super::kind::Equation;
use crate::reading_unit::ReadingUnit;

/// The unit in which errors of these readings are shown: mm where any length was read, degrees of angles alone.
pub(super) fn unit_of(equations: &[Equation]) -> ReadingUnit {
    ReadingUnit::of(equations.is_empty() || equations.iter().any(|equation| equation.measurand.is_length()))
}

impl Equation {
    /// What the equation's residual (mm or rad) is multiplied by to be shown in `unit`; nothing where it has another: millimetres and degrees have no common
    /// root mean square, and angles beside lengths are counted for themselves.
    pub fn factor_in(&self, unit: ReadingUnit) -> Option<f64> {
        (ReadingUnit::of(self.measurand.is_length()) == unit).then(|| unit.factor())
    }
}
