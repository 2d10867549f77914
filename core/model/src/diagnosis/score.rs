//! Efficient scores: what every candidate would explain of the residuals, beyond what the fitted parameters could, from
//! one pass over the rows and without refitting.

use std::ops::Range;
use std::sync::Arc;

use nalgebra::{DMatrix, DVector};

use super::products::{Plan, Products};
use crate::effect::{Effect, EffectId, Search, Size};
use crate::fit::{Fit, Machine};
use crate::statistics::f_tail;

/// A candidate effect ready to be scored.
pub(crate) struct Probe {
    pub(crate) id: EffectId,
    pub(crate) effect: Arc<dyn Effect>,
    /// What inside it is searched for.
    pub(crate) search: Search,
    /// Probes that differ only in what is searched for share a number.
    pub(crate) family: usize,
    /// Weight in Holm's correction: families of many are charged together.
    pub(crate) weight: f64,
    /// What its search costs in the information criterion.
    pub(crate) search_cost: f64,
}

/// What the residuals say of one candidate.
#[derive(Debug, Clone)]
pub(crate) struct Score {
    /// Fall of the weighted sum of squares, in declared sigmas squared.
    pub(crate) gain: f64,
    /// Independent parameters it adds.
    pub(crate) freedom: usize,
    /// Sum of squares left with it in, and its degrees of freedom.
    pub(crate) left: (f64, f64),
    /// Probability of such a gain by chance.
    pub(crate) p: f64,
    /// Expected values of its parameters.
    pub(crate) values: Vec<f64>,
    /// Covariance of the values.
    pub(crate) covariance: DMatrix<f64>,
    /// How the fitted parameters are expected to move beside it, one a slot.
    pub(crate) beside: Vec<f64>,
    /// Expected size.
    pub(crate) size: Size,
    /// Whether the values are those of a real machine, within two standard errors.
    pub(crate) plausible: bool,
    /// Share of its squares the fitted parameters swallow.
    pub(crate) absorbed: f64,
    /// Root of its squares per unit size, in declared sigmas: what it would do if nothing swallowed it.
    pub(crate) strength: f64,
}

impl Score {
    /// Charges one more parameter: one that was searched for, not fitted.
    pub(crate) fn charge_parameter(&mut self) {
        let (left, below) = self.left;
        let (above, below) = (self.freedom as f64 + 1.0, (below - 1.0).max(1.0));
        self.p = f_tail(self.gain / above / (left / below), above, below);
    }
}

/// The noise of a fit, for tests: Huber's variance and its degrees of freedom.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Noise {
    /// Variance of one equation as the weighted metric sees it, declared sigmas squared.
    pub(crate) variance: f64,
    /// Equations less parameters.
    pub(crate) freedom: f64,
}

impl Noise {
    pub(crate) fn of(machine: &Machine<'_>, fit: &Fit) -> Self {
        let counted = fit.rows.iter().map(|row| machine.observations.range(*row).len()).sum::<usize>() as f64;
        Self { variance: fit.variance, freedom: f64::max(counted - fit.rank() as f64, 1.0) }
    }
}

/// Scores all probes at a fit.
pub(crate) fn score(machine: &Machine<'_>, fit: &Fit, probes: &[Probe]) -> Vec<Score> {
    let effects: Vec<&dyn Effect> = probes.iter().map(|probe| probe.effect.as_ref()).collect();
    let plan = Plan::of(&effects, machine.model.chain.len());
    let products = Products::of(machine, fit, &plan);
    let swallowed = fit.factor.whiten(&products.with_parameters.transpose());
    let gradient = DMatrix::from_column_slice(fit.normal.gradient.len(), 1, fit.normal.gradient.as_slice());
    let left_over = fit.factor.whiten(&gradient);
    let noise = Noise::of(machine, fit);
    let scored = |((probe, range), own): ((&Probe, &Range<usize>), &DMatrix<f64>)| {
        let shadow = swallowed.columns(range.start, range.len());
        let beyond = own - shadow.tr_mul(&shadow);
        let score =
            products.with_residuals.rows(range.start, range.len()) - shadow.tr_mul(&left_over).column(0);
        let mut score = one(probe, own, &beyond, &score.into_owned(), noise);
        let moved = left_over.column(0) - shadow * DVector::from_column_slice(&score.values);
        score.beside = fit.factor.back(moved).as_slice().to_vec();
        score
    };
    probes.iter().zip(&plan.ranges).zip(&products.own).map(scored).collect()
}

/// Squares (in variances) the greatest plausible size must have beyond the fitted parameters.
const SEEN: f64 = 4.0;

/// Share of a candidate's squares below which nothing of it counts as left.
pub(super) const SWALLOWED: f64 = 1e-6;

fn one(
    probe: &Probe,
    own: &DMatrix<f64>,
    beyond: &DMatrix<f64>,
    score: &DVector<f64>,
    noise: Noise,
) -> Score {
    let count = own.nrows();
    // In units where each column has length one, directions with hardly anything left are dropped.
    let scales = DVector::from_iterator(count, own.diagonal().iter().map(|square| square.max(0.0).sqrt()));
    let unit = |index: usize| if scales[index] > 0.0 { 1.0 / scales[index] } else { 0.0 };
    let scaled =
        DMatrix::from_fn(count, count, |row, column| beyond[(row, column)] * unit(row) * unit(column));
    let eigen = scaled.symmetric_eigen();
    let mut inverse = DMatrix::zeros(count, count);
    let mut freedom = 0;
    for (value, vector) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
        if *value > SWALLOWED {
            freedom += 1;
            inverse += vector * vector.transpose() / *value;
        }
    }
    for row in 0..count {
        for column in 0..count {
            inverse[(row, column)] *= unit(row) * unit(column);
        }
    }
    // An effect that could not be seen at any plausible size is no candidate.
    let widest = probe
        .effect
        .parameters()
        .iter()
        .map(|parameter| parameter.range.0.abs().max(parameter.range.1.abs()));
    let visible: f64 =
        widest.zip(beyond.diagonal().iter()).map(|(range, square)| range * range * square.max(0.0)).sum();
    if visible < SEEN * noise.variance {
        freedom = 0;
        inverse.fill(0.0);
    }
    let estimate = &inverse * score;
    let gain = score.dot(&estimate).max(0.0);
    let squares = noise.variance * noise.freedom;
    let below = (noise.freedom - freedom as f64).max(1.0);
    // Weights that took a strong effect for outliers can promise more than there is.
    let left = (squares - gain).max(squares * 0.01);
    let p = if freedom == 0 {
        1.0
    } else {
        f_tail(gain / freedom as f64 / (left / below), freedom as f64, below)
    };
    let covariance = &inverse * (left / below);
    let values: Vec<f64> = estimate.iter().copied().collect();
    let size = probe.effect.size(&values, &covariance);
    let plausible =
        probe.effect.parameters().iter().zip(&values).enumerate().all(|(index, (parameter, value))| {
            let reach = 2.0 * covariance[(index, index)].max(0.0).sqrt();
            (parameter.range.0 - reach..=parameter.range.1 + reach).contains(value)
        });
    let trace = |matrix: &DMatrix<f64>| {
        (0..count).map(|index| matrix[(index, index)] * unit(index) * unit(index)).sum::<f64>()
    };
    let total = trace(own);
    let absorbed = if total > 0.0 { (1.0 - trace(beyond) / total).clamp(0.0, 1.0) } else { 1.0 };
    let first = probe.effect.parameters().first().map_or(1.0, |parameter| parameter.unit.factor);
    Score {
        gain,
        freedom,
        left: (left, below),
        p,
        plausible,
        values,
        covariance,
        beside: Vec::new(),
        size,
        absorbed,
        strength: scales.norm() / (count.max(1) as f64).sqrt() / first,
    }
}
