//! The scatter among returns, not led astray by a few wild ones.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::replicates::Replicates;
use crate::thresholds::INLIER_QUANTILE;
use plumb_calibration::effect::EffectId;
use plumb_estimation::RankRevealingCholesky;
use plumb_estimation::{chi_squared_quantile, median};

/// What is left among returns.
pub(crate) struct Scatter {
    /// Per member: deviation from its group's mean, in declared sigmas.
    pub(crate) deviations: Vec<DVector<f64>>,
    /// Degrees of freedom.
    pub(crate) freedom: usize,
    /// One sigma, in declared sigmas.
    pub(crate) sigma: f64,
    /// Sum of squares without the wild ones.
    pub(crate) squares: f64,
    /// Per member: 0 if it is wild, else 1.
    kept: Vec<f64>,
}

impl Replicates {
    /// Scatter left after a fit of the `wanted` columns; returns far outside the bulk are left out.
    pub(crate) fn scatter(&self, wanted: &[usize]) -> Scatter {
        let mut kept = vec![1.0; self.members.len()];
        let (mut deviations, mut rank) = self.fitted(&kept, wanted);
        let mut sigma = self.typical(&deviations, &kept);
        for _ in 0..10 {
            let fresh = self.tame(&deviations, sigma);
            let settled = fresh == kept;
            kept = fresh;
            (deviations, rank) = self.fitted(&kept, wanted);
            sigma = self.sigma(&deviations, &kept, rank);
            if settled {
                break;
            }
        }
        let squares =
            deviations.iter().zip(&kept).map(|(deviation, kept)| kept * deviation.norm_squared()).sum();
        Scatter { freedom: self.freedom(&kept).saturating_sub(rank), deviations, sigma, squares, kept }
    }

    fn sigma(&self, deviations: &[DVector<f64>], kept: &[f64], rank: usize) -> f64 {
        let squares: f64 =
            deviations.iter().zip(kept).map(|(deviation, kept)| kept * deviation.norm_squared()).sum();
        (squares / self.freedom(kept).saturating_sub(rank).max(1) as f64).sqrt()
    }

    /// What each candidate would take away of the squares that `wanted` columns leave, and with how many parameters of
    /// its own.
    pub(crate) fn gains(&self, scatter: &Scatter, wanted: &[usize]) -> Vec<(f64, usize)> {
        let all: Vec<usize> = (0..self.columns.first().map_or(0, DMatrix::ncols)).collect();
        let (deviations, columns) = self.centred(&scatter.kept, &all);
        let explained = |chosen: &[usize]| {
            let (matrix, gradient) = sums(&deviations, &columns, &scatter.kept, chosen);
            let factor = RankRevealingCholesky::new(&matrix);
            (gradient.dot(&factor.solve(&gradient)), factor.rank())
        };
        let (known, rank) = if wanted.is_empty() { (0.0, 0) } else { explained(wanted) };
        let gain = |(_, range): &(EffectId, Range<usize>)| {
            let chosen: Vec<usize> = wanted.iter().copied().chain(range.clone()).collect();
            let (with, with_rank) = explained(&chosen);
            ((with - known).max(0.0), with_rank.saturating_sub(rank))
        };
        self.candidates.iter().map(gain).collect()
    }

    /// Deviations after the columns' least-squares fit, and how many columns mattered.
    fn fitted(&self, kept: &[f64], wanted: &[usize]) -> (Vec<DVector<f64>>, usize) {
        let (mut deviations, columns) = self.centred(kept, wanted);
        if wanted.is_empty() {
            return (deviations, 0);
        }
        let all: Vec<usize> = (0..wanted.len()).collect();
        let (matrix, gradient) = sums(&deviations, &columns, kept, &all);
        let factor = RankRevealingCholesky::new(&matrix);
        let solution = factor.solve(&gradient);
        for (deviation, column) in deviations.iter_mut().zip(&columns) {
            *deviation -= column * &solution;
        }
        (deviations, factor.rank())
    }

    /// How many members of each group are kept.
    fn sizes(&self, kept: &[f64]) -> Vec<f64> {
        let mut sizes = vec![0.0; self.groups];
        for ((_, group), kept) in self.members.iter().zip(kept) {
            if let Some(size) = sizes.get_mut(*group) {
                *size += kept;
            }
        }
        sizes
    }

    /// A member's norm for a scatter of one, at the given share of members inside; `sizes` are those of the groups.
    fn huber_corner(&self, member: usize, equations: usize, share: f64, sizes: &[f64]) -> f64 {
        let group = self.members.get(member).map_or(0, |(_, group)| *group);
        let size = sizes.get(group).copied().unwrap_or(0.0);
        (chi_squared_quantile(share, equations.max(1) as f64) * (1.0 - 1.0 / size.max(2.0))).sqrt()
    }

    fn typical(&self, deviations: &[DVector<f64>], kept: &[f64]) -> f64 {
        let sizes = self.sizes(kept);
        let relative: Vec<f64> = deviations
            .iter()
            .enumerate()
            .map(|(member, deviation)| {
                deviation.norm() / self.huber_corner(member, deviation.len(), 0.5, &sizes)
            })
            .collect();
        let typical = median(&relative);
        if typical.is_finite() { typical } else { 0.0 }
    }

    fn tame(&self, deviations: &[DVector<f64>], sigma: f64) -> Vec<f64> {
        let sizes = self.sizes(&vec![1.0; deviations.len()]);
        let inside = |(member, deviation): (usize, &DVector<f64>)| {
            let edge = sigma * self.huber_corner(member, deviation.len(), INLIER_QUANTILE, &sizes);
            f64::from(u8::from(deviation.norm() <= edge || deviation.norm() == 0.0))
        };
        deviations.iter().enumerate().map(inside).collect()
    }
}

/// NormalEquations equations of some columns.
fn sums(
    deviations: &[DVector<f64>],
    columns: &[DMatrix<f64>],
    kept: &[f64],
    chosen: &[usize],
) -> (DMatrix<f64>, DVector<f64>) {
    let mut matrix = DMatrix::zeros(chosen.len(), chosen.len());
    let mut gradient = DVector::zeros(chosen.len());
    for ((deviation, column), kept) in deviations.iter().zip(columns).zip(kept) {
        let picked = column.select_columns(chosen);
        matrix += picked.tr_mul(&picked) * *kept;
        gradient += picked.tr_mul(deviation) * *kept;
    }
    (matrix, gradient)
}
