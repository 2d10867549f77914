//! Normal equations of a residual model over rows of its table.

use std::collections::BTreeSet;

use nalgebra::DVector;
use plumb_estimation::{NormalEquations, over_chunks};

use super::residual_model::ResidualModel;
use super::scratch::Scratch;
use super::state::{FreeParameter, State};
use crate::effect::Effect;

/// Share of a step over which its second derivative is taken: a tenth, so that rounding is no matter and the third order hardly.
const SECOND_DIFFERENCE: f64 = 0.1;

impl ResidualModel<'_> {
    /// Normal equations of the free parameters and the probes over `rows`.
    pub fn normal(
        &self,
        state: &State,
        rows: &[usize],
        weights: &[f64],
        probes: &[&dyn Effect],
    ) -> NormalEquations {
        let mut total = self.gathered(state, rows, weights, probes);
        self.known_besides_rows(state, rows, &mut total);
        total
    }

    /// Normal equations of some rows alone, without what is known between places.
    pub fn normal_of_rows(&self, state: &State, rows: &[usize], weights: &[f64]) -> NormalEquations {
        self.gathered(state, rows, weights, &[])
    }

    /// The equations of some rows, chunk by chunk: the derivatives of all of a large table would take more room than the table.
    fn gathered(
        &self,
        state: &State,
        rows: &[usize],
        weights: &[f64],
        probes: &[&dyn Effect],
    ) -> NormalEquations {
        // Columns of the probes follow those of the free numbers.
        let size =
            self.free_parameters.len() + probes.iter().map(|probe| probe.parameters().len()).sum::<usize>();
        let mut total = NormalEquations::zeros(size);
        over_chunks(
            rows,
            || NormalEquations::zeros(size),
            |sum, chunk| {
                let block = self.block(state, chunk, weights, probes);
                sum.take(&block.residuals, &block.jacobian);
            },
            |sum| total.add(&sum),
        );
        total
    }

    /// The derivatives of the predictions over `rows` times their second derivative along a change of the free numbers (Transtrum and Sethna 2012, arXiv:1201.5885). By
    /// central differences: beside what the first derivatives promise an error of theirs, divided by the fraction of the step, would look like a bend.
    pub(super) fn second_derivative_along(
        &self,
        state: &State,
        change: &DVector<f64>,
        rows: &[usize],
        weights: &[f64],
    ) -> DVector<f64> {
        let [ahead, behind] = [SECOND_DIFFERENCE, -SECOND_DIFFERENCE]
            .map(|fraction| state.stepped(&self.free_parameters, (change * fraction).as_slice()));
        let mut total = DVector::zeros(self.free_parameters.len());
        over_chunks(
            rows,
            || {
                let scratches = [&ahead, &behind].map(|moved| self.scratch(moved));
                (DVector::zeros(self.free_parameters.len()), scratches, Vec::new())
            },
            |(sum, scratches, residuals), chunk| {
                let block = self.block(state, chunk, weights, &[]);
                // Predictions grow as residuals fall.
                let mut second = DVector::from_vec(block.residuals) * 2.0;
                for scratch in scratches {
                    self.scaled_residuals(chunk, weights, scratch, residuals);
                    second.iter_mut().zip(&*residuals).for_each(|(second, residual)| *second -= residual);
                }
                let squared = SECOND_DIFFERENCE * SECOND_DIFFERENCE;
                sum.gemv(1.0 / squared, &block.jacobian, &second, 1.0);
            },
            |(sum, _, _)| total += sum,
        );
        total
    }

    /// Residuals of some rows, divided by the sigmas and weighted as in a [`RowBlock`](super::RowBlock), in place of what `out` held.
    fn scaled_residuals(
        &self,
        rows: &[usize],
        weights: &[f64],
        scratch: &mut Scratch<'_>,
        out: &mut Vec<f64>,
    ) {
        out.clear();
        for row in rows {
            let first = out.len();
            self.row_residuals(*row, scratch, out);
            let weight = weights.get(*row).copied().unwrap_or(1.0).sqrt();
            let own = out.iter_mut().skip(first);
            for (residual, equation) in own.zip(self.observations.of_row(*row)) {
                *residual *= weight / equation.sigma;
            }
        }
    }

    /// Weighted sum of squares over `rows`, in declared sigmas squared, without derivatives.
    pub fn squares(&self, state: &State, rows: &[usize], weights: &[f64]) -> f64 {
        let mut total = 0.0;
        over_chunks(
            rows,
            || (0.0, self.scratch(state), Vec::new()),
            |(sum, scratch, residuals), chunk| {
                self.scaled_residuals(chunk, weights, scratch, residuals);
                *sum += residuals.iter().map(|residual| residual * residual).sum::<f64>();
            },
            |(sum, _, _)| total += sum,
        );
        let mut constraints = NormalEquations::zeros(self.free_parameters.len());
        self.known_besides_rows(state, rows, &mut constraints);
        // What is known between places counts like any measurement.
        total + constraints.squares
    }

    /// Residuals of all equations of the table, mm and rad, in order.
    pub fn residuals(&self, state: &State) -> Vec<f64> {
        let mut scratch = self.scratch(state);
        let mut out = Vec::with_capacity(self.observations.equations.len());
        for row in 0..self.observations.rows() {
            self.row_residuals(row, &mut scratch, &mut out);
        }
        out
    }

    /// Residuals of all equations when `held` rows were not fitted: places that none of the `fitted` rows touched are
    /// put where the held rows themselves say, so that what is left is how far these disagree.
    pub fn residuals_apart(&self, state: &State, held: &[usize], fitted: &[usize]) -> Vec<f64> {
        let mut state = state.clone();
        let known = self.touched(fitted);
        // Where the held rows alone would have their places.
        let mut alone = state.clone();
        super::align::place_touched(self, &mut alone, held);
        for place in self.touched(held) {
            let index = place as usize;
            if !known.contains(&place)
                && let (Some(entry), Some(own)) = (state.places.get_mut(index), alone.places.get(index))
            {
                *entry = *own;
            }
        }
        let mut scratch = self.scratch(&state);
        let mut out = vec![f64::NAN; self.observations.equations.len()];
        let mut residuals = Vec::new();
        for row in held {
            residuals.clear();
            self.row_residuals(*row, &mut scratch, &mut residuals);
            if let Some(entries) = out.get_mut(self.observations.range(*row)) {
                entries.copy_from_slice(&residuals);
            }
        }
        out
    }

    /// The places that some rows touched.
    fn touched(&self, rows: &[usize]) -> Vec<u32> {
        rows.iter().filter_map(|row| self.table.touch.of_row.get(*row).copied().flatten()).collect()
    }

    /// Adds what is known besides the rows that are fitted: distances between places that these touched, and what the model file knows beforehand of values.
    pub fn known_besides_rows(&self, state: &State, rows: &[usize], total: &mut NormalEquations) {
        self.place_distances(state, rows, total);
        for (index, free_parameter) in self.free_parameters.iter().enumerate() {
            let Some((value, sd)) = self.known_beforehand(state, free_parameter) else { continue };
            // An observation of zero.
            total.matrix[(index, index)] += 1.0 / (sd * sd);
            total.gradient[index] -= value / (sd * sd);
            total.squares += value * value / (sd * sd);
            total.equations += 1;
        }
    }

    /// The value of a free parameter and the standard deviation that the model file knows of it; nothing where it knows none.
    fn known_beforehand(&self, state: &State, free_parameter: &FreeParameter) -> Option<(f64, f64)> {
        let FreeParameter::Effect(part, which) = *free_parameter else { return None };
        let prior = self.model.prior(&self.parts.get(part)?.id)?;
        let sd = prior.sd.get(which).copied().flatten()?;
        Some((state.effects.get(part)?.get(which).copied()?, sd))
    }

    /// Known distances between touched places. How far a place is from one that no fitted row touched says nothing: that one may be anywhere.
    fn place_distances(&self, state: &State, rows: &[usize], total: &mut NormalEquations) {
        if self.observations.place_distances.is_empty() {
            return;
        }
        let touched: BTreeSet<usize> = self.touched(rows).into_iter().map(|place| place as usize).collect();
        for known in &self.observations.place_distances {
            if !touched.contains(&known.first) || !touched.contains(&known.second) {
                continue;
            }
            let (Some(first), Some(second)) = (state.places.get(known.first), state.places.get(known.second))
            else {
                continue;
            };
            let offset = first - second;
            let length = offset.norm();
            let residual = (known.length - length) / known.sigma;
            let mut row = DVector::zeros(total.gradient.len());
            // Places upon each other have no direction in which they move apart; any lets the fit begin.
            let away = if length > 1e-6 { offset / length } else { nalgebra::Vector3::x() };
            for (index, free_parameter) in self.free_parameters.iter().enumerate() {
                if let FreeParameter::Place(place, axis) = *free_parameter {
                    let sign = f64::from(u8::from(place == known.first))
                        - f64::from(u8::from(place == known.second));
                    row[index] = sign * away.get(axis).copied().unwrap_or(0.0) / known.sigma;
                }
            }
            total.matrix.ger(1.0, &row, &row, 1.0);
            total.gradient.axpy(residual, &row, 1.0);
            total.squares += residual * residual;
            total.equations += 1;
        }
    }
}
