//! How far measured points are off: every error that is shown is that of one measured point (the length of a target's error in space, or one scalar reading),
//! never of a row over all its targets.

use serde::Serialize;

use plumb_calibration::fit::ResidualModel;

/// The fraction of the points that lie within [`ErrorSummary::percentile_95`].
const SHARE_WITHIN: f64 = 0.95;

/// The errors of some measured points, in the unit of the table's readings (degrees of angles alone, else mm).
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ErrorSummary {
    /// Points.
    pub points: usize,
    /// Root mean square.
    pub rms: f64,
    /// Mean length.
    pub mean: f64,
    /// 95 % of the points are off by no more.
    pub percentile_95: f64,
    /// The greatest.
    pub max: f64,
}

/// The errors where the model was fitted and where it was not.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Errors {
    /// Over the rows that were fitted.
    pub fit: ErrorSummary,
    /// Blocked cross-validation: regions of pose space left out in turn.
    pub cv: Option<ErrorSummary>,
    /// Over the held-out rows; nothing if none were held out.
    pub check: Option<ErrorSummary>,
}

impl ErrorSummary {
    /// No points.
    const NONE: Self = Self { points: 0, rms: 0.0, mean: 0.0, percentile_95: 0.0, max: 0.0 };

    /// Of points whose squared errors these are, mm2 or deg2; nothing of no points.
    pub(crate) fn of(squares: impl Iterator<Item = f64>) -> Option<Self> {
        let mut lengths: Vec<f64> = squares.map(f64::sqrt).collect();
        lengths.sort_by(f64::total_cmp);
        let max = *lengths.last()?;
        let count = lengths.len() as f64;
        let squared: f64 = lengths.iter().map(|length| length * length).sum();
        // The smallest length that so many points do not exceed (Hyndman & Fan 1996, definition 1).
        let rank = ((SHARE_WITHIN * count).ceil() as usize).clamp(1, lengths.len());
        Some(Self {
            points: lengths.len(),
            rms: (squared / count).sqrt(),
            mean: lengths.iter().sum::<f64>() / count,
            percentile_95: lengths.get(rank - 1).copied().unwrap_or(max),
            max,
        })
    }

    /// The same, zero of no points.
    pub(crate) fn or_zero(summary: Option<Self>) -> Self {
        summary.unwrap_or(Self::NONE)
    }
}

/// Squared errors of a row's measured points, mm2 (deg2 in a table of angles alone): the coordinates of one target (or touched place) are one point, every other
/// reading is one of its own. Empty if nothing in that unit was measured.
pub(crate) fn point_squares(problem: &ResidualModel<'_>, residuals: &[f64], row: usize) -> Vec<f64> {
    let own = residuals.get(problem.observations.range(row)).unwrap_or(&[]);
    let equations = problem.observations.of_row(row);
    let mut points: Vec<((&str, u32), f64)> = Vec::new();
    for (equation, residual) in equations.iter().zip(own) {
        let what = equation.measurand;
        let Some(factor) = equation.factor_in(problem.observations.unit()) else { continue };
        let square = (residual * factor).powi(2);
        let key = (what.kind.name(), what.index);
        match points.iter_mut().find(|(known, _)| *known == key) {
            Some((_, sum)) => *sum += square,
            None => points.push((key, square)),
        }
    }
    points.into_iter().map(|(_, square)| square).collect()
}

/// Number of measured points in some rows.
pub(crate) fn points_in(problem: &ResidualModel<'_>, rows: &[usize]) -> usize {
    let none = vec![0.0; problem.observations.equations.len()];
    rows.iter().map(|row| point_squares(problem, &none, *row).len()).sum()
}

/// By how much the error of a measured point exceeds that of one reading where both are noise alone: the root of how many readings make a point, 1.73 for a
/// point in space.
pub(crate) fn noise_of_a_point(problem: &ResidualModel<'_>, rows: &[usize]) -> f64 {
    let unit = problem.observations.unit();
    let equations = rows.iter().flat_map(|row| problem.observations.of_row(*row));
    let readings = equations.filter(|equation| equation.factor_in(unit).is_some()).count();
    (readings as f64 / points_in(problem, rows).max(1) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use plumb_calibration::arm_model::Model;
    use plumb_calibration::measurement::Observations;
    use plumb_calibration::table::Table;

    #[test]
    fn a_summary_holds_root_mean_square_mean_and_ranks() {
        let summary = ErrorSummary::of((1..=20).map(|length| f64::from(length * length))).unwrap();
        assert_eq!((summary.points, summary.percentile_95, summary.max), (20, 19.0, 20.0));
        assert!((summary.mean - 10.5).abs() < 1e-12);
        assert!((summary.rms - (2870.0_f64 / 20.0).sqrt()).abs() < 1e-12);
        assert_eq!(ErrorSummary::of(std::iter::empty()), None);
        assert_eq!(ErrorSummary::of(std::iter::once(4.0)).unwrap().percentile_95, 2.0);
    }

    #[test]
    fn a_point_in_space_is_off_by_the_root_of_three_of_what_a_reading_is() {
        let lab = crate::testing::two_links(6, "", 0.05, 31, |_| [0.0; 2]);
        let problem = lab.problem(&[]).unwrap();
        assert!((noise_of_a_point(&problem, &[0, 2, 4]) - 3.0_f64.sqrt()).abs() < 1e-12);
        assert_eq!(points_in(&problem, &[0, 2, 4]), 3);
        // A height is a point of its own.
        let text = "q1_deg,q2_deg,on,height_mm\n0,10,table,5\n20,30,table,6\n40,50,table,7\n";
        let plane = "surfaces: {table: {plane: {normal: [0, 0, 1], offset_mm: 0}}}";
        let model = format!("{}free: []\n{plane}\n", crate::testing::TWO_LINKS);
        let model = Model::parse("model.yaml", &model).unwrap();
        let table = Table::parse("table.csv", text).unwrap();
        let observations = Observations::new(&model, &table).unwrap();
        let problem = ResidualModel::new(&model, &table, &observations, &[]).unwrap();
        assert!((noise_of_a_point(&problem, &[0, 1]) - 1.0).abs() < 1e-12);
    }
}
