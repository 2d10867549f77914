//! Control limits of a series of single values.

use serde::Serialize;

/// Mean moving range of two neighbours of a normal series, in standard deviations (the constant d2 for samples of two:
/// Montgomery, Introduction to Statistical Quality Control, appendix VI).
const MOVING_RANGE_OF_TWO: f64 = 1.128;

/// Standard deviations from the centre to a limit (Shewhart 1931): a sound series leaves them about three times in a thousand.
const LIMIT_SIGMAS: f64 = 3.0;

/// Fewest values that make limits: with fewer, one odd value sets them itself.
pub const FEWEST_VALUES: usize = 8;

/// Shewhart's limits for single values, in their unit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ControlLimits {
    /// Mean of the values.
    pub centre: f64,
    /// Below it a value is out of control.
    pub lower: f64,
    /// Above it.
    pub upper: f64,
}

impl ControlLimits {
    /// The limits of values in the order of time, from the mean moving range of neighbours (Montgomery, section 6.4). None for
    /// fewer than [`FEWEST_VALUES`], or where two neighbours never differ.
    pub fn of(values: &[f64]) -> Option<Self> {
        if values.len() < FEWEST_VALUES {
            return None;
        }
        let centre = values.iter().sum::<f64>() / values.len() as f64;
        let ranges = values.windows(2).map(|pair| (pair[1] - pair[0]).abs());
        let mean_range = ranges.sum::<f64>() / (values.len() - 1) as f64;
        let away = LIMIT_SIGMAS * mean_range / MOVING_RANGE_OF_TWO;
        (away > 0.0 && away.is_finite()).then_some(Self {
            centre,
            lower: centre - away,
            upper: centre + away,
        })
    }

    /// Whether a value lies outside.
    pub fn excludes(&self, value: f64) -> bool {
        !(self.lower..=self.upper).contains(&value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_limits_of_a_textbook_series() {
        // Montgomery, example 6.5 (viscosity of a primer paint): mean 33.52, mean moving range 0.48, limits 32.24 and 34.80.
        let batches = [
            33.75, 33.05, 34.00, 33.81, 33.46, 34.02, 33.68, 33.27, 33.49, 33.20, 33.62, 33.00, 33.54, 33.12,
            33.84,
        ];
        let limits = ControlLimits::of(&batches).expect("limits");
        assert!((limits.centre - 33.52).abs() < 0.005, "{limits:?}");
        assert!((limits.lower - 32.24).abs() < 0.015 && (limits.upper - 34.80).abs() < 0.015, "{limits:?}");
        assert!(batches.iter().all(|value| !limits.excludes(*value)) && limits.excludes(35.0));
    }

    #[test]
    fn few_values_or_values_that_never_change_have_no_limits() {
        assert_eq!(ControlLimits::of(&[1.0, 2.0, 1.0]), None);
        assert_eq!(ControlLimits::of(&[1.0; 20]), None);
        assert_eq!(ControlLimits::of(&[1.0, f64::INFINITY, 1.0, 2.0, 1.0, 2.0, 1.0, 2.0]), None);
    }
}
