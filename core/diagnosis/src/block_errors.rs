//! Standard errors as blocks of rows have them. A fit takes what is left for independent noise. On a real machine neighbouring rows share what the model lacks, and a size
//! then moves by more from one part of the table to another than its standard error says. Leaving out blocks of rows in turn shows by how much (the grouped jackknife:
//! Efron & Tibshirani 1993, section 11.5; Künsch 1989 for rows that depend on each other).

use nalgebra::DMatrix;

use crate::cross_validation::{Derivatives, Without, regions, stretches};
use crate::thresholds::ERROR_BLOCKS;
use plumb_calibration::fit::{Fit, ResidualModel};
use plumb_calibration::table::Table;
use plumb_estimation::{NormalEquations, for_each};

/// The ways in which the fitted rows are cut: into regions of pose space, and into stretches of the order in which they were measured.
pub(crate) fn ways(table: &Table, rows: &[usize]) -> [Vec<Vec<usize>>; 2] {
    [regions(table, rows, ERROR_BLOCKS), stretches(table, rows, ERROR_BLOCKS)]
}

/// Standard errors of the free parameters of a fit (internal units) by the grouped jackknife: the fit without each block of rows is one Gauss-Newton step away. Of the ways
/// of cutting the one with the greater error counts; zero where too little is left without a block. A block at a time is worked out anew: a large table's derivatives are
/// too many to keep.
pub(crate) fn errors(problem: &ResidualModel<'_>, fit: &Fit) -> Vec<f64> {
    by_jackknife(problem.table, fit, |block| problem.normal_of_rows(&fit.state, block, &fit.weights))
}

/// The same from derivatives that are known.
pub(crate) fn errors_from(derivatives: &Derivatives<'_>, table: &Table, fit: &Fit) -> Vec<f64> {
    by_jackknife(table, fit, |block| derivatives.normal(block))
}

fn by_jackknife(
    table: &Table,
    fit: &Fit,
    normal_of: impl Fn(&[usize]) -> NormalEquations + Sync,
) -> Vec<f64> {
    let mut errors = vec![0.0; fit.covariance.nrows()];
    for blocks in ways(table, &fit.rows) {
        let steps =
            for_each(&blocks, |block| Some(Without::of(&fit.normal, fit.rank(), &normal_of(block))?.step));
        if let Some(steps) = steps.into_iter().collect::<Option<Vec<_>>>() {
            raise(&mut errors, &steps);
        }
    }
    errors
}

/// Raises standard errors to those of the jackknife, from the values without each block.
pub(crate) fn raise(errors: &mut [f64], without: &[Vec<f64>]) {
    for (index, error) in errors.iter_mut().enumerate() {
        *error = error.max(jackknife(without.iter().filter_map(|values| values.get(index).copied())));
    }
}

/// A covariance whose standard errors are at least these, at the same correlations.
pub(crate) fn at_least(covariance: &DMatrix<f64>, errors: &[f64]) -> DMatrix<f64> {
    let wider = factors(covariance, errors);
    let factor = |index: usize| wider.get(index).copied().unwrap_or(1.0);
    covariance.map_with_location(|row, column, value| value * factor(row) * factor(column))
}

/// By how much the standard error of the number that is known best grows, for a size of which some numbers are not to be seen.
pub(crate) fn factor_of_the_best_known(covariance: &DMatrix<f64>, errors: &[f64]) -> f64 {
    let variances = covariance.diagonal();
    let known = variances.iter().zip(factors(covariance, errors));
    let known = known.filter(|(variance, _)| **variance > 0.0);
    known.min_by(|one, other| one.0.total_cmp(other.0)).map_or(1.0, |(_, factor)| factor)
}

/// By how much each standard error grows to be at least these. What is held has no variance, and stays without.
fn factors(covariance: &DMatrix<f64>, errors: &[f64]) -> Vec<f64> {
    let own = covariance.diagonal().map(|variance| variance.max(0.0).sqrt());
    let pairs = own.iter().zip(errors);
    pairs.map(|(own, error)| if *own > 0.0 { (error / own).max(1.0) } else { 1.0 }).collect()
}

/// The jackknife's standard error of a number, from its values without each of some blocks (Efron & Tibshirani 1993, section 11.5).
pub(crate) fn jackknife(values: impl Iterator<Item = f64>) -> f64 {
    let values: Vec<f64> = values.collect();
    let count = values.len() as f64;
    if count < 2.0 {
        return 0.0;
    }
    let mean = values.iter().sum::<f64>() / count;
    ((count - 1.0) / count * values.iter().map(|one| (one - mean).powi(2)).sum::<f64>()).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::laboratory::Laboratory;
    use crate::testing::two_links;
    use plumb_estimation::Progress;

    #[test]
    fn the_jackknife_of_a_mean_is_its_standard_error_and_one_value_has_none() {
        // Means of 1, 2, 6 with each left out: 4, 3.5, 1.5. Their standard error is that of the mean, sqrt(7 / 3).
        let left_out = [4.0, 3.5, 1.5];
        assert!((jackknife(left_out.into_iter()) - (7.0_f64 / 3.0).sqrt()).abs() < 1e-12);
        // Means of 1, 2, 3, 4 without each of them; the standard error of the mean is 0.6455.
        assert!((jackknife([3.0, 8.0 / 3.0, 7.0 / 3.0, 2.0].into_iter()) - 0.645_497).abs() < 1e-6);
        // Of two: sqrt(1 / 2 (1 + 1)).
        assert!((jackknife([1.0, 3.0].into_iter()) - 1.0).abs() < 1e-12);
        assert_eq!((jackknife([5.0].into_iter()), jackknife(std::iter::empty())), (0.0, 0.0));
    }

    #[test]
    fn a_covariance_is_raised_at_the_same_correlations_and_never_lowered() {
        let covariance = DMatrix::from_row_slice(3, 3, &[4.0, 1.0, 0.0, 1.0, 9.0, 0.0, 0.0, 0.0, 0.0]);
        let raised = at_least(&covariance, &[6.0, 1.0, 5.0]);
        let requested = DMatrix::from_row_slice(3, 3, &[36.0, 3.0, 0.0, 3.0, 9.0, 0.0, 0.0, 0.0, 0.0]);
        assert!((raised - requested).norm() < 1e-12, "what is held stays without an error");
        assert_eq!(factor_of_the_best_known(&covariance, &[6.0, 1.0, 5.0]), 3.0);
        assert_eq!(factor_of_the_best_known(&covariance, &[]), 1.0);
        let mut errors = [0.5, 2.0];
        raise(&mut errors, &[vec![1.0, 1.0], vec![3.0, 3.0]]);
        assert_eq!(errors, [1.0, 2.0]);
    }

    /// Error of the elbow's gain, as the fit has it and as blocks have it.
    fn errors_of_gain(lab: &Laboratory) -> (f64, f64) {
        let fitted = lab.fit_with(&[], None, &Progress::unwatched()).unwrap();
        assert_eq!(fitted.fit.covariance.shape(), (1, 1), "the gain is all that is fitted");
        (fitted.fit.covariance[(0, 0)].sqrt(), errors(&fitted.problem, &fitted.fit)[0])
    }

    #[test]
    fn independent_noise_has_the_error_of_the_fit_and_what_rows_share_a_greater_one() {
        // Nine degrees of freedom of each way: both errors are between a half and twice the true one in all but one case in a hundred.
        let (alone, blocks) = errors_of_gain(&two_links(200, "joint_gain(elbow)", 0.05, 3, |_| [0.0; 2]));
        assert!((0.5..2.0).contains(&(blocks / alone)), "{blocks} {alone}");
        // What is left is a wave of the elbow, of which the rows of a region see the same part.
        let wave = |q: [f64; 2]| [0.0, 0.004 * (2.0 * q[1] + 0.4).sin()];
        let (alone, blocks) = errors_of_gain(&two_links(200, "joint_gain(elbow)", 0.05, 3, wave));
        assert!(blocks > 2.0 * alone, "{blocks} {alone}");
    }

    #[test]
    fn rows_that_share_their_time_are_seen_where_regions_see_nothing() {
        // An elbow that is off by another angle every twenty rows, at poses drawn at random.
        let steps =
            |row: usize| 0.004 * [1.0, -1.0, 2.0, -0.5, 0.0, -1.5, 1.2, -0.8, 0.6, -1.0][row / 20 % 10];
        let row = std::cell::Cell::new(0);
        let drift = |q: [f64; 2]| {
            let now = row.replace(row.get() + 1);
            [0.0, steps(now) * q[1]]
        };
        let (alone, blocks) = errors_of_gain(&two_links(200, "joint_gain(elbow)", 0.02, 5, drift));
        assert!(blocks > 2.0 * alone, "{blocks} {alone}");
    }

    #[test]
    fn too_few_rows_to_leave_any_out_say_nothing() {
        let lab = two_links(2, "joint_gain(*), joint_zero(*)", 0.05, 3, |_| [0.0; 2]);
        let fitted = lab.fit_with(&[], None, &Progress::unwatched()).unwrap();
        assert_eq!(errors(&fitted.problem, &fitted.fit), [0.0; 4]);
    }
}
