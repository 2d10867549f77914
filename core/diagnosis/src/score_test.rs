//! Score tests (Rao 1948; Cox and Hinkley 1974, section 9.3): what every candidate would explain of the residuals, beyond what
//! the fitted parameters could, from one pass over the rows and without refitting.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};

use super::products::{Plan, Products};
use crate::thresholds::{ABSORBED_REST, VISIBLE_VARIANCES};
use plumb_calibration::effect::{Effect, EffectId, Search, Size};
use plumb_calibration::fit::{Fit, ResidualModel};
use plumb_estimation::f_tail;

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
    /// How the fitted parameters are expected to move beside it, one number each.
    pub(crate) beside: Vec<f64>,
    /// Expected size.
    pub(crate) size: Size,
    /// Whether some of its numbers could not be seen at any plausible size: these are zero in `values`.
    pub(crate) has_unseen: bool,
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
    pub(crate) fn of(problem: &ResidualModel<'_>, fit: &Fit) -> Self {
        let counted = fit.rows.iter().map(|row| problem.observations.range(*row).len()).sum::<usize>() as f64;
        Self { variance: fit.variance, freedom: f64::max(counted - fit.rank() as f64, 1.0) }
    }
}

/// Scores all probes at a fit.
pub(crate) fn score(problem: &ResidualModel<'_>, fit: &Fit, probes: &[Probe]) -> Vec<Score> {
    let effects: Vec<&dyn Effect> = probes.iter().map(|probe| probe.effect.as_ref()).collect();
    let plan = Plan::of(&effects, problem.model.chain.len());
    let products = Products::of(problem, fit, &plan);
    // With R'R the normal matrix, R^-T A'B is the part of the candidates that the fitted parameters span; B'B - (R^-T A'B)'(R^-T A'B) is what is left of them.
    let swallowed = fit.factor.whiten(&products.with_parameters.transpose());
    let gradient = DMatrix::from_column_slice(fit.normal.gradient.len(), 1, fit.normal.gradient.as_slice());
    let left_over = fit.factor.whiten(&gradient);
    let noise = Noise::of(problem, fit);
    probes
        .iter()
        .zip(&plan.ranges)
        .zip(&products.own)
        .map(|((probe, range), own)| {
            let shadow = swallowed.columns(range.start, range.len());
            let beyond = own - shadow.tr_mul(&shadow);
            let score =
                products.with_residuals.rows(range.start, range.len()) - shadow.tr_mul(&left_over).column(0);
            let mut score = score_one(probe, own, &beyond, &score.into_owned(), noise);
            // How the fitted parameters step back when the candidate comes in: a refit starts there, near where it ends.
            let moved = left_over.column(0) - shadow * DVector::from_column_slice(&score.values);
            score.beside = fit.factor.back(moved).as_slice().to_vec();
            score
        })
        .collect()
}

/// One over the length of each column, 0 for a column of nothing.
pub(crate) fn units(own: &DMatrix<f64>) -> DVector<f64> {
    own.diagonal().map(|square| if square > 0.0 { square.sqrt().recip() } else { 0.0 })
}

/// A matrix in units where each column has length one.
fn in_units(matrix: &DMatrix<f64>, units: &DVector<f64>) -> DMatrix<f64> {
    DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |row, column| {
        matrix[(row, column)] * units[row] * units[column]
    })
}

/// The inverse of the information on a candidate beyond the fitted parameters, and its rank. Directions in which hardly
/// anything is left (in units where each column has length one) are dropped: there the inverse is zero.
pub(crate) fn information_inverse(beyond: &DMatrix<f64>, units: &DVector<f64>) -> (DMatrix<f64>, usize) {
    let eigen = in_units(beyond, units).symmetric_eigen();
    let mut inverse = DMatrix::zeros(beyond.nrows(), beyond.nrows());
    let mut rank = 0;
    for (value, vector) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
        if *value > ABSORBED_REST {
            rank += 1;
            inverse += vector * vector.transpose() / *value;
        }
    }
    (in_units(&inverse, units), rank)
}

/// The information on a candidate beyond the fitted parameters, without what is rounding error of directions they absorb whole.
pub(super) fn information(own: &DMatrix<f64>, beyond: &DMatrix<f64>) -> DMatrix<f64> {
    let units = units(own);
    let eigen = in_units(beyond, &units).symmetric_eigen();
    let mut clean = DMatrix::zeros(own.nrows(), own.nrows());
    for (value, vector) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
        if *value > ABSORBED_REST {
            clean += vector * vector.transpose() * *value;
        }
    }
    in_units(&clean, &own.diagonal().map(|square| square.max(0.0).sqrt()))
}

/// The squared number of standard errors by which each of an effect's numbers would show at its greatest plausible size, variances.
fn shown_at_most(effect: &dyn Effect, beyond: &DMatrix<f64>) -> Vec<f64> {
    let widest = effect.parameters().iter().map(|one| one.range.0.abs().max(one.range.1.abs()));
    widest.enumerate().map(|(index, range)| range * range * beyond[(index, index)].max(0.0)).collect()
}

/// What is left of a candidate beyond the fitted parameters without the numbers that could not be seen at any plausible size, and whether there are any: their
/// estimates would be noise divided by next to nothing, as of a creep along a plane whose heights are measured.
fn without_unseen(beyond: &DMatrix<f64>, shown: &[f64], noise: Noise) -> (DMatrix<f64>, bool) {
    let unseen = |index: usize| shown.get(index).is_some_and(|squares| *squares < UNSEEN * noise.variance);
    let seen = DMatrix::from_fn(beyond.nrows(), beyond.ncols(), |row, column| {
        if unseen(row) || unseen(column) { 0.0 } else { beyond[(row, column)] }
    });
    (seen, (0..beyond.nrows()).any(unseen))
}

/// Whether values lie within an effect's plausible ranges, give or take two standard errors.
pub(crate) fn is_plausible(effect: &dyn Effect, values: &[f64], covariance: &DMatrix<f64>) -> bool {
    effect.parameters().iter().zip(values).enumerate().all(|(index, (parameter, value))| {
        // A sound size at the edge of its range comes out beyond it half of the time.
        let reach = 2.0 * covariance[(index, index)].max(0.0).sqrt();
        (parameter.range.0 - reach..=parameter.range.1 + reach).contains(value)
    })
}

/// Fraction of a candidate's squares that the fitted parameters absorb.
fn absorbed(own: &DMatrix<f64>, beyond: &DMatrix<f64>, units: &DVector<f64>) -> f64 {
    let total = in_units(own, units).trace();
    if total > 0.0 { (1.0 - in_units(beyond, units).trace() / total).clamp(0.0, 1.0) } else { 1.0 }
}

/// The F test of a gain with `freedom` parameters: squares left and their degrees of freedom, and the probability of the gain.
fn f_test(gain: f64, freedom: usize, noise: Noise) -> ((f64, f64), f64) {
    let squares = noise.variance * noise.freedom;
    let below = (noise.freedom - freedom as f64).max(1.0);
    // Weights that took a strong effect for outliers can promise more than there is.
    let left = (squares - gain).max(squares * LEAST_LEFT);
    if freedom == 0 {
        return ((left, below), 1.0);
    }
    ((left, below), f_tail(gain / freedom as f64 / (left / below), freedom as f64, below))
}

/// A number that shows less than this at its greatest plausible size is taken as zero beside others of its effect (variances). Why: its range is then a third of a
/// standard error, so that its estimate says nothing; and of a curve, 40 pieces that show no more each are needed to show as a whole.
const UNSEEN: f64 = 0.1;

/// Fraction of the squares that is taken to be left whatever a score promises.
const LEAST_LEFT: f64 = 0.01;

/// One candidate's score: `own` are the products of its derivatives, `beyond` the same after projection on what is fitted, and
/// `score` their products with the residuals, projected likewise.
fn score_one(
    probe: &Probe,
    own: &DMatrix<f64>,
    beyond: &DMatrix<f64>,
    score: &DVector<f64>,
    noise: Noise,
) -> Score {
    let units = units(own);
    let (mut inverse, mut freedom) = information_inverse(beyond, &units);
    let shown = shown_at_most(probe.effect.as_ref(), beyond);
    // An effect that could not be seen at any plausible size is no candidate.
    if shown.iter().sum::<f64>() < VISIBLE_VARIANCES * noise.variance {
        freedom = 0;
        inverse.fill(0.0);
    }
    let estimate = &inverse * score;
    let gain = score.dot(&estimate).max(0.0);
    let (left, p) = f_test(gain, freedom, noise);
    let (seen, has_unseen) = without_unseen(beyond, &shown, noise);
    let of_seen = if has_unseen && freedom > 0 { information_inverse(&seen, &units).0 } else { inverse };
    let covariance = &of_seen * (left.0 / left.1);
    let values: Vec<f64> = (&of_seen * score).iter().copied().collect();
    let first = probe.effect.parameters().first().map_or(1.0, |parameter| parameter.unit.factor);
    // Of several parameters the mean square: a wave has the same strength whatever its phase.
    let length = own.diagonal().map(|square| square.max(0.0)).sum().sqrt();
    Score {
        gain,
        freedom,
        left,
        p,
        size: probe.effect.size(&values, &covariance),
        plausible: is_plausible(probe.effect.as_ref(), &values, &covariance),
        has_unseen,
        values,
        covariance,
        beside: Vec::new(),
        absorbed: absorbed(own, beyond, &units),
        strength: length / (own.nrows().max(1) as f64).sqrt() / first,
    }
}

#[cfg(test)]
mod tests;
