//! The scatter among returns, not led astray by a few wild ones.

use nalgebra::{DMatrix, DVector};

use super::returns::Returns;
use crate::effect::EffectId;
use crate::fit::Factor;
use crate::statistics::{chi_squared_quantile, chi_squared_tail, median};

/// What is left among returns.
pub(crate) struct Scatter {
    /// Per member: deviation from its group's mean, in declared sigmas.
    pub(crate) deviations: Vec<DVector<f64>>,
    /// Degrees of freedom.
    pub(crate) freedom: usize,
    /// One sigma, in declared sigmas.
    pub(crate) sigma: f64,
    /// Sum of squares, the wild ones drawn in.
    pub(crate) squares: f64,
    /// Per member: Huber's weight.
    weights: Vec<f64>,
}

/// Share of members that lie inside the corner when nothing is wild.
const INSIDE: f64 = 0.95;

impl Returns {
    /// Scatter left after a robust fit of the `wanted` columns.
    pub(crate) fn scatter(&self, wanted: &[usize]) -> Scatter {
        let mut weights = vec![1.0; self.members.len()];
        let mut sigma = None;
        let mut scatter = None;
        for _ in 0..20 {
            let (deviations, rank) = self.fitted(&weights, wanted);
            let freedom = self.freedom().saturating_sub(rank);
            let spread = sigma.unwrap_or_else(|| self.typical(&deviations));
            weights = self.weights(&deviations, spread);
            let squares: f64 = deviations
                .iter()
                .zip(&weights)
                .map(|(deviation, weight)| weight * weight * deviation.norm_squared())
                .sum();
            let fresh = (squares / (freedom.max(1) as f64 * self.inside_share())).sqrt();
            let settled = sigma.is_some_and(|sigma: f64| (fresh / sigma - 1.0).abs() < 1e-4);
            sigma = Some(fresh);
            scatter = Some(Scatter { deviations, freedom, sigma: fresh, squares, weights: weights.clone() });
            if settled || fresh == 0.0 {
                break;
            }
        }
        scatter.unwrap_or(Scatter { deviations: Vec::new(), freedom: 0, sigma: 0.0, squares: 0.0, weights })
    }

    /// What each candidate would take away of the squares that `wanted` columns leave, and with how many parameters of its
    /// own.
    pub(crate) fn gains(&self, scatter: &Scatter, wanted: &[usize]) -> Vec<(f64, usize)> {
        let all: Vec<usize> = (0..self.columns.first().map_or(0, DMatrix::ncols)).collect();
        let (deviations, columns) = self.centred(&scatter.weights, &all);
        let explained = |chosen: &[usize]| {
            let mut matrix = DMatrix::zeros(chosen.len(), chosen.len());
            let mut gradient = DVector::zeros(chosen.len());
            for ((deviation, column), weight) in deviations.iter().zip(&columns).zip(&scatter.weights) {
                let picked = column.select_columns(chosen);
                matrix += picked.tr_mul(&picked) * *weight;
                gradient += picked.tr_mul(deviation) * *weight;
            }
            let factor = Factor::new(&matrix);
            (gradient.dot(&factor.solve(&gradient)), factor.rank())
        };
        let (known, rank) = if wanted.is_empty() { (0.0, 0) } else { explained(wanted) };
        let gain = |(_, range): &(EffectId, std::ops::Range<usize>)| {
            let chosen: Vec<usize> = wanted.iter().copied().chain(range.clone()).collect();
            let (with, with_rank) = explained(&chosen);
            ((with - known).max(0.0), with_rank.saturating_sub(rank))
        };
        self.candidates.iter().map(gain).collect()
    }

    /// Deviations after the columns' least-squares fit, and how many columns mattered.
    fn fitted(&self, weights: &[f64], wanted: &[usize]) -> (Vec<DVector<f64>>, usize) {
        let (mut deviations, columns) = self.centred(weights, wanted);
        if wanted.is_empty() {
            return (deviations, 0);
        }
        let mut matrix = DMatrix::zeros(wanted.len(), wanted.len());
        let mut gradient = DVector::zeros(wanted.len());
        for ((deviation, column), weight) in deviations.iter().zip(&columns).zip(weights) {
            matrix += column.tr_mul(column) * *weight;
            gradient += column.tr_mul(deviation) * *weight;
        }
        let factor = Factor::new(&matrix);
        let solution = factor.solve(&gradient);
        for (deviation, column) in deviations.iter_mut().zip(&columns) {
            *deviation -= column * &solution;
        }
        (deviations, factor.rank())
    }

    fn group_size(&self, group: usize) -> usize {
        self.members.iter().filter(|(_, other)| *other == group).count()
    }

    /// A member's norm for a scatter of one, at the given share of members inside.
    fn corner(&self, member: usize, equations: usize, share: f64) -> f64 {
        let group = self.members.get(member).map_or(0, |(_, group)| *group);
        let shrunk = 1.0 - 1.0 / self.group_size(group).max(2) as f64;
        (chi_squared_quantile(share, equations.max(1) as f64) * shrunk).sqrt()
    }

    fn typical(&self, deviations: &[DVector<f64>]) -> f64 {
        let relative: Vec<f64> = deviations
            .iter()
            .enumerate()
            .map(|(member, deviation)| deviation.norm() / self.corner(member, deviation.len(), 0.5))
            .collect();
        let typical = median(&relative);
        if typical.is_finite() { typical } else { 0.0 }
    }

    fn weights(&self, deviations: &[DVector<f64>], sigma: f64) -> Vec<f64> {
        deviations
            .iter()
            .enumerate()
            .map(|(member, deviation)| {
                let edge = sigma * self.corner(member, deviation.len(), INSIDE);
                let norm = deviation.norm();
                if norm <= edge || norm == 0.0 { 1.0 } else { edge / norm }
            })
            .collect()
    }

    /// The share of a normal scatter's squares that is left when the far ones are drawn in to the corner.
    fn inside_share(&self) -> f64 {
        let equations = self.residuals.first().map_or(1, DVector::len).max(1) as f64;
        let corner = chi_squared_quantile(INSIDE, equations);
        (1.0 - chi_squared_tail(corner, equations + 2.0))
            + corner / equations * chi_squared_tail(corner, equations)
    }
}
