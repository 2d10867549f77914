//! How likely the rows are with some effects in, beside everything that is fitted and the flexible regression: a linear mixed model. What is fitted has a flat prior
//! that all models share and is integrated out (restricted likelihood, Patterson & Thompson 1971); each component of the flexible regression has the variance under
//! which the rows are likeliest, estimated anew for each model (Rasmussen & Williams 2006, section 5.4.1); effects are not penalised.

use std::ops::Range;
use std::sync::{Arc, Mutex, PoisonError};

use nalgebra::{DMatrix, DVector};

use super::features::Features;
use super::regression::{LEAST_RATIO, Products, Reduced};
use super::symmetric::{submatrix, symmetric_inverse};
use crate::thresholds::{ABSORBED_REST, ALIKE_CORRELATION, EXPLAINABLE_FREEDOM};
use plumb_estimation::for_each;

/// Ratio of the noise's variance to a coefficient's at which the search begins, for each column of the component.
const FIRST_RATIO: f64 = 4.0;

/// Rounds of estimating the variances at most.
const ROUNDS: usize = 16;

/// Fall of twice the negative logarithm of the likelihood below which the rounds end: it changes the odds of two models by less than a fortieth.
const SETTLED: f64 = 0.05;

/// How many times what one step promises a deviance may still fall: the steps are short, and the deviance is not quite convex. Several times what any round of the fits in
/// this module's tests leaves; a bound that is nearer costs the rounds that it would have cost anyhow.
const REACH: f64 = 30.0;

/// Of each equation: its number, and what is left of it, sigmas.
pub(crate) type LeftOver = Vec<(usize, f64)>;

/// The columns of the flexible regression and of some candidates, ready to be fitted.
pub(crate) struct Mixed {
    /// Equations by what is fitted, flexible columns, candidates' columns, residuals.
    design: DMatrix<f64>,
    products: Products,
    fixed: usize,
    components: Vec<Range<usize>>,
    flexible: usize,
    reduced: Reduced,
    /// One over the root mean square of each candidate's column.
    units: Vec<f64>,
    begun: Begun,
}

/// The inverse of a flexible part's matrix, and the logarithm of its determinant.
type Inverse = (DMatrix<f64>, f64);

/// Inverses of the flexible part at ratios at which fits have begun: many sets of candidates begin at the same, and an inverse costs more than all the rest of a round.
#[derive(Default)]
struct Begun {
    known: Mutex<Vec<(Vec<f64>, Arc<Inverse>)>>,
}

impl Begun {
    /// That at these ratios, worked out where no fit has begun at them yet.
    fn at(&self, ratios: &[f64], work_out: impl FnOnce() -> Option<Inverse>) -> Option<Arc<Inverse>> {
        let known = || self.known.lock().unwrap_or_else(PoisonError::into_inner);
        let same = known().iter().find(|(own, _)| own == ratios).map(|(_, inverse)| Arc::clone(inverse));
        if same.is_some() {
            return same;
        }
        // Two threads may both work it out: neither waits for the other.
        let inverse = Arc::new(work_out()?);
        let mut known = known();
        if known.len() >= MOST_BEGUN {
            known.remove(0);
        }
        known.push((ratios.to_vec(), Arc::clone(&inverse)));
        Some(inverse)
    }
}

/// Inverses kept at most: sets are grown from a few at a time.
const MOST_BEGUN: usize = 8;

/// A model fitted.
#[derive(Debug, Clone)]
pub(crate) struct MixedFit {
    /// Twice the negative logarithm of the restricted likelihood, but for what all models on the same rows share.
    pub(crate) deviance: f64,
    /// Independent columns of candidates.
    pub(crate) rank: usize,
    /// Values of the candidates' parameters, and their covariance.
    pub(crate) values: DVector<f64>,
    pub(crate) covariance: DMatrix<f64>,
    /// Per component the noise's variance over that of a coefficient; infinite where it was given up.
    pub(crate) ratios: Vec<f64>,
    columns: Vec<usize>,
    /// Of all flexible columns and those of candidates.
    weights: DVector<f64>,
}

impl MixedFit {
    /// The same candidates beside a flexible part of other variances, for predictions.
    pub(crate) fn at_ratios(&self, ratios: Vec<f64>) -> Self {
        Self { ratios, ..self.clone() }
    }

    /// Its ratios with some components given up.
    pub(crate) fn ratios_without(&self, components: &[usize]) -> Vec<f64> {
        let mut ratios = self.ratios.clone();
        components.iter().for_each(|one| ratios[*one] = f64::INFINITY);
        ratios
    }
}

/// Some rows that are left out, by their equations, and everything else.
pub(crate) struct LeftOutRows {
    equations: Vec<usize>,
    rest: Reduced,
}

/// What the rows say of every candidate when the flexible part keeps its variances: models with any of them in are then compared without a further fit.
pub(crate) struct EvidenceAtRatios {
    information: DMatrix<f64>,
    score: DVector<f64>,
    /// Products of the candidates' columns before the flexible part took its share.
    own: DMatrix<f64>,
    squares: f64,
    freedom: f64,
}

impl EvidenceAtRatios {
    /// Twice the negative logarithm of the likelihood with these parameters in, but for what all models share, and how many of them are independent.
    pub(crate) fn deviance(&self, parameters: &[usize]) -> (f64, usize) {
        let own = self.own.select_rows(parameters).select_columns(parameters);
        let information = self.information.select_rows(parameters).select_columns(parameters);
        let score = self.score.select_rows(parameters);
        let (inverse, rank) = inverse_and_rank(&own, &information);
        let squares = self.squares - score.dot(&(&inverse * &score));
        (self.freedom * squares.max(1e-12 * self.squares).max(f64::MIN_POSITIVE).ln(), rank)
    }
}

/// What one round finds at given ratios.
struct Round {
    deviance: f64,
    rank: usize,
    candidates: DVector<f64>,
    inverse_information: DMatrix<f64>,
    noise: f64,
    columns: Vec<usize>,
    weights: DVector<f64>,
    /// Ratios under which the rows are likelier.
    better: Vec<f64>,
    /// By how much the deviance would fall at them at most, were it convex in the logarithms of the ratios: its slope times the step.
    promised: f64,
}

impl Mixed {
    /// Of flexible columns and of candidates (equations by parameters); nothing where the rows do not determine what is fitted.
    pub(crate) fn new(features: &Features, candidates: &DMatrix<f64>) -> Option<Self> {
        let all = features.design.ncols();
        let (count, fixed) = (candidates.ncols(), features.fixed);
        let flexible = all - fixed - 1;
        let mut design = DMatrix::zeros(features.design.nrows(), all + count);
        design.columns_mut(0, all - 1).copy_from(&features.design.columns(0, all - 1));
        let equations = design.nrows().max(1) as f64;
        let mut units = Vec::with_capacity(count);
        for (index, column) in candidates.column_iter().enumerate() {
            let length = column.norm() / equations.sqrt();
            // A candidate's numbers have units of their own; columns of one length keep the inverse accurate.
            let unit = if length > 0.0 { length.recip() } else { 0.0 };
            design.set_column(all - 1 + index, &(column * unit));
            units.push(unit);
        }
        design.set_column(all - 1 + count, &features.design.column(all - 1));
        let mut products = Products::of(&design);
        products.add(&features.knowledge.widened(count));
        let reduced = Reduced::of(&products, fixed)?;
        let components = features.components.clone();
        let begun = Begun::default();
        Some(Self { design, products, fixed, components, flexible, reduced, units, begun })
    }

    /// The model with these of the candidates' parameters in, from these ratios on; nothing where the numbers break down.
    pub(crate) fn fit(&self, parameters: &[usize], start: Option<&[f64]>) -> Option<MixedFit> {
        self.fit_within(ROUNDS, parameters, start)
    }

    /// The same, but only until it is known whether the deviance falls below `bound`: it has, or is so far above that it will not.
    pub(crate) fn fit_below(&self, bound: f64, parameters: &[usize], start: &[f64]) -> Option<MixedFit> {
        self.fit_until(ROUNDS, parameters, Some(start), |round| {
            round.deviance < bound || round.deviance - REACH * round.promised > bound
        })
    }

    /// The same in so many rounds at most.
    pub(crate) fn fit_within(
        &self,
        rounds: usize,
        parameters: &[usize],
        start: Option<&[f64]>,
    ) -> Option<MixedFit> {
        self.fit_until(rounds, parameters, start, |_| false)
    }

    /// The same in so many rounds at most, ended where one is `enough`.
    fn fit_until(
        &self,
        rounds: usize,
        parameters: &[usize],
        start: Option<&[f64]>,
        enough: impl Fn(&Round) -> bool,
    ) -> Option<MixedFit> {
        let candidates: Vec<usize> = parameters.iter().map(|one| self.flexible + one).collect();
        let mut ratios: Vec<f64> = match start {
            Some(start) => start.to_vec(),
            None => self.components.iter().map(|one| FIRST_RATIO * one.len() as f64).collect(),
        };
        let mut best: Option<(Vec<f64>, Round)> = None;
        for number in 0..rounds {
            let round = match number {
                0 => {
                    let inverse = self.begun.at(&ratios, || self.inverse(&self.reduced, &ratios))?;
                    self.round(&self.reduced, &candidates, &ratios, &inverse)
                }
                _ => self.round(&self.reduced, &candidates, &ratios, &self.inverse(&self.reduced, &ratios)?),
            };
            let reduction = best.as_ref().map_or(f64::INFINITY, |(_, best)| best.deviance - round.deviance);
            let (next, promised, enough) = (round.better.clone(), round.promised, enough(&round));
            // MacKay's rule may step past the optimum of a component that is hardly needed: only a better round is kept.
            if reduction > 0.0 {
                best = Some((ratios, round));
            }
            // An inverse costs more than all the rest: none is worked out to learn that it was not needed.
            if enough || reduction < SETTLED || promised < SETTLED {
                break;
            }
            ratios = next;
        }
        let (ratios, round) = best?;
        Some(self.mixed_fit(parameters, candidates, ratios, &round))
    }

    fn mixed_fit(
        &self,
        parameters: &[usize],
        columns: Vec<usize>,
        ratios: Vec<f64>,
        round: &Round,
    ) -> MixedFit {
        let units = parameters.iter().map(|one| self.units.get(*one).copied().unwrap_or(0.0));
        let units: Vec<f64> = units.collect();
        let weights = self.weights(round, &columns);
        let noise = round.noise;
        let covariance = DMatrix::from_fn(columns.len(), columns.len(), |row, column| {
            noise * round.inverse_information[(row, column)] * units[row] * units[column]
        });
        let values = DVector::from_iterator(
            columns.len(),
            round.candidates.iter().zip(&units).map(|(value, unit)| value * unit),
        );
        MixedFit { deviance: round.deviance, rank: round.rank, values, covariance, ratios, columns, weights }
    }

    /// The coefficients of all columns but those of what is fitted.
    fn weights(&self, round: &Round, candidates: &[usize]) -> DVector<f64> {
        let mut all = DVector::zeros(self.reduced.right.len());
        let flexible = round.columns.iter().zip(round.weights.iter());
        for (column, value) in flexible.chain(candidates.iter().zip(round.candidates.iter())) {
            all[*column] = *value;
        }
        all
    }

    /// One round at these ratios: everything that is fitted then, and ratios under which the rows are likelier (MacKay 1992, equations 4.9 and 4.10).
    fn round(
        &self,
        reduced: &Reduced,
        candidates: &[usize],
        ratios: &[f64],
        (inverse, logarithm): &Inverse,
    ) -> Round {
        let active: Vec<usize> = (0..self.components.len()).filter(|one| ratios[*one].is_finite()).collect();
        let (columns, of_column) = self.active_columns(ratios);
        let right = reduced.right.select_rows(&columns);
        let across = reduced.matrix.select_columns(candidates).select_rows(&columns);
        let through = inverse * &across;
        let own = reduced.matrix.select_rows(candidates).select_columns(candidates);
        let information = &own - across.tr_mul(&through);
        let score = reduced.right.select_rows(candidates) - through.tr_mul(&right);
        let (inverse_information, rank) = inverse_and_rank(&own, &information);
        let found = &inverse_information * &score;
        let weights = inverse * (&right - &across * &found);
        let squares = reduced.squares - right.dot(&(inverse * &right)) - score.dot(&found);
        // A perfect fit of made-up data must not have infinite likelihood.
        let squares = squares.max(1e-12 * reduced.squares).max(f64::MIN_POSITIVE);
        let noise = squares / reduced.freedom;
        let prior: f64 = of_column.iter().map(|ratio| ratio.ln()).sum();
        let mut better = ratios.to_vec();
        let (mut first, mut promised) = (0, 0.0);
        for one in &active {
            let range = first..first + self.components[*one].len();
            first = range.end;
            // Effective degrees of freedom of one component (MacKay 1992, equation 4.9).
            let trace: f64 = range.clone().map(|index| inverse[(index, index)] * of_column[index]).sum();
            let freedom = range.len() as f64 - trace;
            let length = weights.rows(range.start, range.len()).norm_squared();
            // By the logarithm of a ratio the deviance rises by this, which is nought where MacKay's rule comes to rest.
            let slope = ratios[*one] * length / noise - freedom;
            if freedom < EXPLAINABLE_FREEDOM || length <= 0.0 {
                better[*one] = f64::INFINITY;
                // Far out both parts of the slope go as one over the ratio: all the way on is worth one step at this slope.
                promised -= slope;
            } else {
                better[*one] = (noise * freedom / length).max(LEAST_RATIO * reduced.freedom);
                promised -= slope * (better[*one] / ratios[*one]).ln();
            }
        }
        // Restricted likelihood with the noise's variance at its own optimum: n ln s2 + ln |X'X + diag| - ln |diag|, but for constants.
        let deviance = reduced.freedom * noise.ln() + logarithm - prior;
        Round {
            deviance,
            rank,
            candidates: found,
            inverse_information,
            noise,
            columns,
            weights,
            better,
            promised,
        }
    }

    /// The inverse of the flexible part at these ratios.
    fn inverse(&self, reduced: &Reduced, ratios: &[f64]) -> Option<Inverse> {
        let ranges: Vec<Range<usize>> = self.active(ratios).map(|(component, _)| component.clone()).collect();
        let (_, of_column) = self.active_columns(ratios);
        regularized_inverse(submatrix(&reduced.matrix, &ranges), &of_column)
    }

    /// What the rows say of all candidates while the flexible part keeps these ratios; nothing where the numbers break down.
    pub(crate) fn evidence_at(&self, ratios: &[f64]) -> Option<EvidenceAtRatios> {
        let candidates: Vec<usize> = (self.flexible..self.reduced.right.len()).collect();
        let matrix = &self.reduced.matrix;
        let (columns, _) = self.active_columns(ratios);
        let begun = self.begun.at(ratios, || self.inverse(&self.reduced, ratios))?;
        let (inverse, _) = begun.as_ref();
        let right = self.reduced.right.select_rows(&columns);
        let across = matrix.select_columns(&candidates).select_rows(&columns);
        let through = inverse * &across;
        let own = matrix.select_rows(&candidates).select_columns(&candidates);
        Some(EvidenceAtRatios {
            information: &own - across.tr_mul(&through),
            score: self.reduced.right.select_rows(&candidates) - through.tr_mul(&right),
            own,
            squares: self.reduced.squares - right.dot(&(inverse * &right)),
            freedom: self.reduced.freedom,
        })
    }

    /// The components that were not given up, and the ratio of each.
    fn active<'m>(&'m self, ratios: &'m [f64]) -> impl Iterator<Item = (&'m Range<usize>, f64)> {
        let all = self.components.iter().zip(ratios.iter().copied());
        all.filter(|(_, ratio)| ratio.is_finite())
    }

    /// Their columns, and the ratio of each.
    fn active_columns(&self, ratios: &[f64]) -> (Vec<usize>, Vec<f64>) {
        let active = self.active(ratios);
        active.flat_map(|(component, ratio)| component.clone().map(move |column| (column, ratio))).unzip()
    }

    /// Sum of squares that some of a fit's parameters explain beyond what is fitted, by equation and sigma.
    pub(crate) fn squares_of(&self, fit: &MixedFit, parameters: &[usize]) -> f64 {
        self.squares_of_columns(fit, parameters.iter().map(|one| self.flexible + one).collect())
    }

    /// The same of some components together.
    pub(crate) fn squares_of_components(&self, fit: &MixedFit, components: &[usize]) -> f64 {
        let own = components.iter().filter_map(|one| self.components.get(*one).cloned());
        self.squares_of_columns(fit, own.flatten().collect())
    }

    fn squares_of_columns(&self, fit: &MixedFit, columns: Vec<usize>) -> f64 {
        let own = self.reduced.matrix.select_rows(&columns).select_columns(&columns);
        let weights = fit.weights.select_rows(&columns);
        weights.dot(&(own * &weights))
    }

    /// Ratios at which the search begins for some components, all others given up.
    pub(crate) fn ratios_of(&self, components: &[usize]) -> Vec<f64> {
        self.components
            .iter()
            .enumerate()
            .map(|(index, one)| match components.contains(&index) {
                true => FIRST_RATIO * one.len() as f64,
                false => f64::INFINITY,
            })
            .collect()
    }

    /// Which of some components can hold what a candidate does: of its squares beyond what is fitted their functions leave so little that they are alike
    /// (multiple correlation of [`ALIKE_CORRELATION`]).
    pub(crate) fn holding(&self, parameters: &[usize], components: &[usize]) -> Vec<usize> {
        let candidate: Vec<usize> = parameters.iter().map(|one| self.flexible + one).collect();
        components.iter().copied().filter(|one| self.holds(*one, &candidate)).collect()
    }

    fn holds(&self, component: usize, candidate: &[usize]) -> bool {
        let Some(columns) = self.components.get(component) else { return false };
        let columns: Vec<usize> = columns.clone().collect();
        let matrix = &self.reduced.matrix;
        let all = matrix.select_rows(candidate).select_columns(candidate).trace();
        let own = matrix.select_rows(&columns).select_columns(&columns);
        let across = matrix.select_rows(&columns).select_columns(candidate);
        let (inverse, _) = inverse_and_rank(&own, &own);
        across.tr_mul(&(inverse * &across)).trace() > ALIKE_CORRELATION.powi(2) * all
    }

    /// Equations of the rows that are looked at.
    pub(crate) fn equations(&self) -> usize {
        self.design.nrows()
    }

    /// What a model leaves of every equation, sigmas.
    pub(crate) fn residuals(&self, fit: &MixedFit) -> DVector<f64> {
        let last = self.design.ncols() - 1;
        self.design.column(last) - self.design.columns(0, last) * self.reduced.coefficients(&fit.weights)
    }

    /// Rows to leave out, each block by its equations; nothing where what is left does not determine what is fitted.
    pub(crate) fn leave_out(&self, blocks: Vec<Vec<usize>>) -> Option<Vec<LeftOutRows>> {
        let rests = for_each(&blocks, |equations| {
            let own = Products::of(&self.design.select_rows(equations));
            Reduced::of(&self.products.without(&own), self.fixed)
        });
        let pairs = blocks.into_iter().zip(rests);
        pairs.map(|(equations, rest)| Some(LeftOutRows { equations, rest: rest? })).collect()
    }

    /// A fitted model without some rows, at the same ratios: what is left of each of their equations, and the values of its parameters.
    pub(crate) fn predict(&self, fit: &MixedFit, left_out: &LeftOutRows) -> Option<(LeftOver, Vec<f64>)> {
        self.predict_each(&[fit], left_out)?.pop()
    }

    /// The same of some fitted models, in their order.
    pub(crate) fn predict_each(
        &self,
        fits: &[&MixedFit],
        left_out: &LeftOutRows,
    ) -> Option<Vec<(LeftOver, Vec<f64>)>> {
        let design = self.design.select_rows(&left_out.equations);
        let last = design.ncols() - 1;
        // An inverse costs more than all the rest: models of the same ratios share it.
        let mut inverses: Vec<(&[f64], Inverse)> = Vec::new();
        let mut predicted = Vec::new();
        for fit in fits {
            let known = inverses.iter().position(|(ratios, _)| *ratios == fit.ratios.as_slice());
            let index = known.unwrap_or(inverses.len());
            if known.is_none() {
                inverses.push((&fit.ratios, self.inverse(&left_out.rest, &fit.ratios)?));
            }
            let (_, inverse) = inverses.get(index)?;
            let round = self.round(&left_out.rest, &fit.columns, &fit.ratios, inverse);
            let coefficients = left_out.rest.coefficients(&self.weights(&round, &fit.columns));
            let left = design.column(last) - design.columns(0, last) * coefficients;
            let values = fit.columns.iter().zip(round.candidates.iter());
            let values = values.map(|(column, value)| value * self.units[column - self.flexible]).collect();
            let left = left_out.equations.iter().copied().zip(left.iter().copied()).collect();
            predicted.push((left, values));
        }
        Some(predicted)
    }
}

/// The inverse of a matrix with these ratios on its diagonal, and the logarithm of its determinant.
fn regularized_inverse(mut matrix: DMatrix<f64>, ratios: &[f64]) -> Option<(DMatrix<f64>, f64)> {
    for (index, ratio) in ratios.iter().enumerate() {
        matrix[(index, index)] += ratio;
    }
    match ratios.is_empty() {
        true => Some((DMatrix::zeros(0, 0), 0.0)),
        false => symmetric_inverse(&matrix),
    }
}

/// The inverse of what is known of candidates and its rank; directions of which hardly anything is left beyond what is fitted are dropped.
fn inverse_and_rank(own: &DMatrix<f64>, information: &DMatrix<f64>) -> (DMatrix<f64>, usize) {
    if own.is_empty() {
        return (own.clone(), 0);
    }
    let scale = own.diagonal().iter().copied().fold(0.0, f64::max);
    let eigen = information.clone().symmetric_eigen();
    let mut inverse = DMatrix::zeros(own.nrows(), own.nrows());
    let mut rank = 0;
    for (value, vector) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
        if *value > ABSORBED_REST * scale && scale > 0.0 {
            rank += 1;
            inverse += vector * vector.transpose() / *value;
        }
    }
    (inverse, rank)
}

#[cfg(test)]
mod tests;
