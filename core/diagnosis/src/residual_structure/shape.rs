//! In what shape the rest goes with one covariate.

use crate::thresholds::SHAPE_FRACTION;
use plumb_calibration::measurement::ReadingUnit;

/// Mean over the rows of one level of a covariate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct LevelMean {
    /// Of the covariate.
    pub(crate) at: f64,
    /// Of the residual, mm.
    pub(crate) mean: f64,
    /// Rows.
    pub(crate) count: f64,
}

/// In what shape a residual goes with a covariate. Residuals in the unit of the table's readings, places in the covariate's unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ResidualShape {
    /// A wave of a rotating joint.
    Periodic {
        /// Periods a rotation.
        order: u32,
        /// Of the wave, mm.
        amplitude: f64,
    },
    /// Two or three levels.
    Levels {
        /// Last level above the first, mm.
        difference: f64,
        /// The first level.
        first: f64,
        /// The last level.
        last: f64,
    },
    /// One sudden change.
    Step {
        /// mm.
        height: f64,
        /// Where.
        at: f64,
    },
    /// In proportion.
    Linear {
        /// From one end to the other, mm.
        rise: f64,
        /// One end.
        from: f64,
        /// The other end.
        to: f64,
    },
    /// Anything else that is smooth.
    Curved {
        /// Residual, mm, and where.
        lowest: (f64, f64),
        /// Residual, mm, and where.
        highest: (f64, f64),
    },
}

/// What a covariate's levels explain, in terms of a straight line and of a step.
struct Fits {
    /// mm a unit.
    slope: f64,
    /// Fraction of the variance between the levels that a line explains.
    line: f64,
    /// The same for the best step, its height and the index of the first level after it.
    step: (f64, f64, usize),
}

/// Mean over levels, weighed by their rows.
fn average(levels: &[LevelMean], of: impl Fn(&LevelMean) -> f64) -> f64 {
    let weight: f64 = levels.iter().map(|level| level.count).sum();
    levels.iter().map(|level| level.count * of(level)).sum::<f64>() / weight
}

impl Fits {
    fn of(levels: &[LevelMean]) -> Option<Self> {
        let (middle, mean) = (average(levels, |level| level.at), average(levels, |level| level.mean));
        // Weighed by rows: levels of equal numbers of rows are not of equal width.
        let spread = average(levels, |level| (level.mean - mean).powi(2)).max(1e-300);
        let extent = average(levels, |level| (level.at - middle).powi(2));
        let together = average(levels, |level| (level.at - middle) * (level.mean - mean));
        let slope = together / extent.max(1e-300);
        // Every place between two levels is tried.
        let steps = (1..levels.len()).map(|first| {
            let (low, high) = levels.split_at(first);
            let height = average(high, |level| level.mean) - average(low, |level| level.mean);
            // Variance between two groups of shares f and 1 - f whose means are h apart: f (1 - f) h^2.
            let fraction = rows_of(low) / rows_of(levels);
            (fraction * (1.0 - fraction) * height * height / spread, height, first)
        });
        let step = steps.max_by(|left, right| left.0.total_cmp(&right.0))?;
        Some(Self { slope, line: slope * slope * extent / spread, step })
    }
}

/// Rows in some levels.
fn rows_of(levels: &[LevelMean]) -> f64 {
    levels.iter().map(|level| level.count).sum()
}

/// The simplest shape that explains most of what the levels do: a wave where one was found, then few levels, a step, a line,
/// else a curve. Nothing without levels.
pub(crate) fn classify(levels: &[LevelMean], wave: Option<(u32, f64)>) -> Option<ResidualShape> {
    let (first, last) = (*levels.first()?, *levels.last()?);
    // A wave's levels may look like a line or a step where little of it was seen; that it is one was tested before.
    if let Some((order, amplitude)) = wave {
        return Some(ResidualShape::Periodic { order, amplitude });
    }
    if levels.len() <= 3 {
        return Some(ResidualShape::Levels {
            difference: last.mean - first.mean,
            first: first.at,
            last: last.at,
        });
    }
    let fits = Fits::of(levels)?;
    let (explained, height, after) = fits.step;
    if explained > SHAPE_FRACTION && explained > fits.line {
        let at = 0.5 * (levels.get(after - 1)?.at + levels.get(after)?.at);
        return Some(ResidualShape::Step { height, at });
    }
    if fits.line > SHAPE_FRACTION {
        let rise = fits.slope * (last.at - first.at);
        return Some(ResidualShape::Linear { rise, from: first.at, to: last.at });
    }
    // Neither: only where it is least and most.
    let highest = levels.iter().max_by(|left, right| left.mean.total_cmp(&right.mean))?;
    let lowest = levels.iter().min_by(|left, right| left.mean.total_cmp(&right.mean))?;
    Some(ResidualShape::Curved { lowest: (lowest.mean, lowest.at), highest: (highest.mean, highest.at) })
}

/// How one component of the rest goes with one covariate.
#[derive(Debug, Clone, PartialEq)]
pub struct Trend {
    /// The component, such as `along x`.
    pub along: String,
    /// The covariate.
    pub against: String,
    /// Its unit as shown.
    pub unit: &'static str,
    /// The unit of what is left.
    pub of_residual: ReadingUnit,
    /// Whether it is kept in radians and shown in degrees.
    pub in_degrees: bool,
    /// The shape.
    pub shape: ResidualShape,
}

/// What one component of the rest is on average in each category of a column of words.
#[derive(Debug, Clone, PartialEq)]
pub struct CategoryMeans {
    /// The component, such as `along x`.
    pub along: String,
    /// The column.
    pub against: String,
    /// The unit of what is left.
    pub of_residual: ReadingUnit,
    /// Category and mean of what is left, in the order in which the categories appear in the table.
    pub means: Vec<(String, f64)>,
}

/// What the rest goes with.
#[derive(Debug, Clone, PartialEq)]
pub enum Description {
    /// It goes with a covariate of numbers.
    Trend(Trend),
    /// It goes with a column of words.
    Categories(CategoryMeans),
    /// It goes with none of these conditions.
    Unrelated(Vec<String>),
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Eight levels of ten rows each.
    fn levels(of: impl Fn(f64) -> f64) -> Vec<LevelMean> {
        (0..8).map(|at| LevelMean { at: f64::from(at), mean: of(f64::from(at)), count: 10.0 }).collect()
    }

    #[test]
    fn a_line_a_step_and_a_curve_are_distinguished() {
        let line = classify(&levels(|at| 0.5 * at - 1.0), None).unwrap();
        assert_eq!(line, ResidualShape::Linear { rise: 3.5, from: 0.0, to: 7.0 });
        let step = classify(&levels(|at| if at < 2.5 { 0.0 } else { 2.0 }), None).unwrap();
        assert_eq!(step, ResidualShape::Step { height: 2.0, at: 2.5 });
        let curve = classify(&levels(|at| (at - 3.0).powi(2)), None).unwrap();
        assert_eq!(curve, ResidualShape::Curved { lowest: (0.0, 3.0), highest: (16.0, 7.0) });
    }

    #[test]
    fn a_line_that_explains_too_little_is_a_curve() {
        // A line with a bend b(at) on top: of the variance it explains s^2 V / (s^2 V + B), by construction of the two orthogonal.
        let bend = [1.0, -1.0, -1.0, 1.0, 1.0, -1.0, -1.0, 1.0];
        let with = |fraction: f64| {
            let slope = (fraction / (1.0 - fraction) / 5.25).sqrt();
            classify(&levels(|at| slope * at + bend[at as usize]), None).unwrap()
        };
        assert!(matches!(with(SHAPE_FRACTION + 0.02), ResidualShape::Linear { .. }));
        assert!(matches!(with(SHAPE_FRACTION - 0.02), ResidualShape::Curved { .. }));
    }

    #[test]
    fn few_levels_are_compared_and_a_wave_goes_before_everything() {
        let two = &levels(|at| 3.0 * at)[..2];
        assert_eq!(
            classify(two, None),
            Some(ResidualShape::Levels { difference: 3.0, first: 0.0, last: 1.0 })
        );
        let wave = classify(&levels(|at| at), Some((4, 0.2)));
        assert_eq!(wave, Some(ResidualShape::Periodic { order: 4, amplitude: 0.2 }));
        assert_eq!(classify(&[], None), None);
    }
}
