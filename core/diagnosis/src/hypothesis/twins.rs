//! Whether a formula explains more than formulas of its kind explain where there is nothing to explain. Its twins are all formulas of the same place on the same rows with
//! the signs of the residuals drawn at random, pose by pose: a randomization test of the greatest statistic (Westfall & Young 1993; Winkler et al. 2014,
//! NeuroImage 92, 381: sign flips keep what returns to one pose have in common, and unequal noise).

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use crate::cross_validation::pose_groups;
use crate::fitted::Fitted;
use crate::thresholds::HYPOTHESIS_TWINS;
use plumb_calibration::effect::Effect;
use plumb_estimation::Random;

/// Seed of the signs.
const SEED: u64 = 0x7077_696e;

/// Share of a column beyond what is fitted below which it holds rounding only.
const LEAST_LEFT: f64 = 1e-5;

/// Whether what `best` explains is more than any of `all` does with signs drawn at random.
pub(super) fn beaten(fitted: &Fitted<'_>, best: &dyn Effect, all: &[&dyn Effect]) -> bool {
    let (problem, fit) = (&fitted.problem, &fitted.fit);
    let mut probes: Vec<&dyn Effect> = vec![best];
    // A form with more numbers explains more by chance, and would beat a simpler one without being a better explanation.
    probes.extend(all.iter().filter(|one| one.parameters().len() <= best.parameters().len()));
    let block = problem.block(&fit.state, &fit.rows, &fit.weights, &probes);
    let free_parameters = problem.free_parameters().len();
    let fixed = basis(block.jacobian.rows(0, free_parameters).transpose());
    let residuals = DVector::from_vec(block.residuals);
    let mut next = free_parameters;
    let bases: Vec<DMatrix<f64>> = probes
        .iter()
        .map(|effect| {
            let columns = block.jacobian.rows(next, effect.parameters().len()).transpose();
            next += effect.parameters().len();
            beyond(&fixed, columns)
        })
        .collect();
    let left = &residuals - &fixed * fixed.tr_mul(&residuals);
    let Some(own) = bases.first().map(|basis| basis.tr_mul(&left).norm_squared()) else { return false };
    let poses = equations_by_pose(fitted);
    let mut random = Random::seeded(SEED);
    (0..HYPOTHESIS_TWINS).all(|_| {
        let mut flipped = residuals.clone();
        for pose in &poses {
            if random.uniform() < 0.5 {
                pose.iter()
                    .flat_map(Clone::clone)
                    .for_each(|equation| flipped[equation] = -flipped[equation]);
            }
        }
        // What is fitted is fitted to every twin anew.
        let left = &flipped - &fixed * fixed.tr_mul(&flipped);
        bases.iter().map(|basis| basis.tr_mul(&left).norm_squared()).fold(0.0, f64::max) < own
    })
}

/// Orthonormal columns that span the same.
fn basis(columns: DMatrix<f64>) -> DMatrix<f64> {
    let scaled = DMatrix::from_columns(
        &columns
            .column_iter()
            .map(|column| {
                let length = column.norm();
                if length > 0.0 { column / length } else { column.into_owned() }
            })
            .collect::<Vec<_>>(),
    );
    orthonormal(&scaled, LEAST_LEFT)
}

/// Orthonormal columns of what is left of some columns beyond others.
fn beyond(fixed: &DMatrix<f64>, mut columns: DMatrix<f64>) -> DMatrix<f64> {
    for mut column in columns.column_iter_mut() {
        let length = column.norm();
        if length > 0.0 {
            column /= length;
        }
    }
    let left = &columns - fixed * fixed.tr_mul(&columns);
    orthonormal(&left, LEAST_LEFT)
}

/// Gram-Schmidt, twice, leaving out columns of which less is left (Björck 1996, section 2.4).
fn orthonormal(columns: &DMatrix<f64>, least: f64) -> DMatrix<f64> {
    let mut kept: Vec<DVector<f64>> = Vec::new();
    for column in columns.column_iter() {
        let mut left = column.into_owned();
        for _ in 0..2 {
            for known in &kept {
                let along = known.dot(&left);
                left.axpy(-along, known, 1.0);
            }
        }
        let length = left.norm();
        if length > least {
            kept.push(left / length);
        }
    }
    if kept.is_empty() { DMatrix::zeros(columns.nrows(), 0) } else { DMatrix::from_columns(&kept) }
}

/// The equations of the fitted rows of each pose, by their indices in a block.
fn equations_by_pose(fitted: &Fitted<'_>) -> Vec<Vec<Range<usize>>> {
    let observations = fitted.problem.observations;
    let mut next = 0;
    let mut of_row = std::collections::BTreeMap::new();
    for row in &fitted.fit.rows {
        let count = observations.range(*row).len();
        of_row.insert(*row, next..next + count);
        next += count;
    }
    let poses = pose_groups(fitted.problem.table, &fitted.fit.rows);
    poses.iter().map(|rows| rows.iter().filter_map(|row| of_row.get(row).cloned()).collect()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whether columns are orthogonal and one long.
    fn is_orthonormal(columns: &DMatrix<f64>) -> bool {
        (columns.tr_mul(columns) - DMatrix::<f64>::identity(columns.ncols(), columns.ncols())).norm() < 1e-12
    }

    #[test]
    fn columns_of_any_length_are_made_orthonormal_and_those_that_add_nothing_left_out() {
        // The third is the sum of the first two, the fourth is nothing, and the last is a millionth as long as the others.
        let columns = DMatrix::from_columns(&[
            DVector::from_vec(vec![3.0, 4.0, 0.0, 0.0]),
            DVector::from_vec(vec![0.0, 5.0, 0.0, 0.0]),
            DVector::from_vec(vec![3.0, 9.0, 0.0, 0.0]),
            DVector::zeros(4),
            DVector::from_vec(vec![0.0, 0.0, 1e-6, 1e-6]),
        ]);
        let found = basis(columns.clone());
        assert!(found.ncols() == 3 && is_orthonormal(&found), "{found}");
        assert!((&columns - &found * found.tr_mul(&columns)).norm() < 1e-12, "they span the same");
        assert_eq!(basis(DMatrix::zeros(4, 2)).shape(), (4, 0));
    }

    #[test]
    fn beyond_others_only_what_these_do_not_span_is_left() {
        let fixed = DMatrix::from_column_slice(3, 1, &[1.0, 0.0, 0.0]);
        let columns = DMatrix::from_columns(&[
            DVector::from_vec(vec![7.0, 0.0, 0.0]),
            DVector::from_vec(vec![5.0, 0.0, -2e-3]),
            DVector::zeros(3),
        ]);
        let left = beyond(&fixed, columns);
        assert_eq!(left.shape(), (3, 1));
        assert!((left[(2, 0)].abs() - 1.0).abs() < 1e-12 && left[(0, 0)].abs() < 1e-12, "{left}");
        // How long a column is makes no difference.
        for length in [1e-6, 1.0, 1e6] {
            let any = DMatrix::from_column_slice(3, 1, &[length, 0.0, -length]);
            let left = beyond(&fixed, any);
            assert!(left.ncols() == 1 && (left[(2, 0)].abs() - 1.0).abs() < 1e-12, "{length}: {left}");
            let spanned = DMatrix::from_column_slice(3, 1, &[length, 0.9 * LEAST_LEFT * length, 0.0]);
            assert_eq!(beyond(&fixed, spanned).ncols(), 0, "{length}");
        }
        // A column that is all but spanned holds rounding only.
        let rounding = DMatrix::from_column_slice(3, 1, &[1.0, 0.9 * LEAST_LEFT, 0.0]);
        assert_eq!(beyond(&fixed, rounding).ncols(), 0);
        let enough = DMatrix::from_column_slice(3, 1, &[1.0, 1.1 * LEAST_LEFT, 0.0]);
        assert_eq!(beyond(&fixed, enough).ncols(), 1);
    }

    #[test]
    fn the_equations_of_returns_to_one_pose_go_together() {
        let lab = crate::testing::returned(4, 3);
        let fitted = lab.fit_with(&[], None, &plumb_estimation::Progress::unwatched()).unwrap();
        let poses = equations_by_pose(&fitted);
        // Three coordinates a row.
        let expected: Vec<Vec<Range<usize>>> = (0..4)
            .map(|pose| (0..3).map(|visit| 3 * pose + visit).map(|row| 3 * row..3 * row + 3).collect())
            .collect();
        assert_eq!(poses, expected);
    }
}
