//! How far joints go: by the limits of the cell file, and by those of the robot's own.

use super::motions::rounded;
use crate::check_context::{OwnLimits, RobotNames};
use crate::deg_or_mm::DegOrMm;

/// A position beyond limits by no more than this is within them, rad or mm: what a number loses on its way from degrees.
const ROUNDING: f64 = 1e-9;

/// Where a position (rad or mm) lies beyond the limits of a joint, these limits in words.
pub(super) fn beyond_limits(coordinate: f64, (least, most): (f64, f64), unit: DegOrMm) -> Option<String> {
    let number = |internal: f64| rounded(unit.from_internal(internal));
    let within = (least - ROUNDING..=most + ROUNDING).contains(&coordinate);
    (!within).then(|| format!("{} to {} {}", number(least), number(most), unit.symbol()))
}

/// The position nearest to a joint's range of all between two bounds, where none of them is within it; rad or mm.
pub(super) fn outside((lowest, highest): (f64, f64), (least, most): (f64, f64)) -> Option<f64> {
    if most < lowest {
        return Some(most);
    }
    (least > highest).then_some(least)
}

/// What keeps a robot's joint from a position (rad or mm), and what to do about it; nothing where it may go there, as far as that is known before the run.
pub(super) fn kept_from(robot: &RobotNames, joint: &str, coordinate: f64, unit: DegOrMm) -> Option<String> {
    let of_cell = robot.limits.iter().find(|(known, ..)| known == joint);
    let of_cell = of_cell.and_then(|(_, least, most)| beyond_limits(coordinate, (*least, *most), unit));
    if let Some(limits) = of_cell {
        return Some(format!(
            "the cell keeps it within {limits}: give a place there, or widen its limits in the cell file"
        ));
    }
    let own = robot.own_limits.iter().find(|limits| limits.joint == joint)?;
    Some(format!("{}: give a place there", own.beyond(coordinate, unit)?))
}

impl OwnLimits {
    /// The least and the greatest position (rad or mm) wherever the zero may be.
    pub(super) fn with_zero_shift(&self) -> (f64, f64) {
        (self.least - self.zero_shift, self.most + self.zero_shift)
    }

    /// Where a position (rad or mm) lies beyond them wherever the zero may be, in words.
    pub(super) fn beyond(&self, coordinate: f64, unit: DegOrMm) -> Option<String> {
        beyond_limits(coordinate, self.with_zero_shift(), unit)?;
        let number = |internal: f64| rounded(unit.from_internal(internal));
        let limits = format!(
            "the robot itself goes from {} to {} {}",
            number(self.least),
            number(self.most),
            unit.symbol()
        );
        Some(match self.zero_shift {
            0.0 => limits,
            shift => {
                format!("{limits}, and its zero is corrected by at most {} {}", number(shift), unit.symbol())
            }
        })
    }
}
