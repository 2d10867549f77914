//! The surroundings of a state taken as flat: residuals and derivatives of some rows, on which robust weights settle without the
//! arm being posed anew.

use nalgebra::{DMatrix, DVector};

use super::doubt::Prior;
use super::residual_model::ResidualModel;
use super::robust::Distances;
use super::state::State;
use plumb_estimation::NormalEquations;
use plumb_estimation::full_step;

/// Derivatives held at most; larger tables settle their weights row by row.
const MOST: usize = 4_000_000;

/// Rounds of weighing at most, and the change of a weight that ends them.
const ROUNDS: usize = 20;
const SETTLED: f64 = 1e-3;

pub(super) struct Tangent<'t> {
    problem: &'t ResidualModel<'t>,
    rows: &'t [usize],
    /// Measured less predicted, in declared sigmas.
    residuals: DVector<f64>,
    /// Slots by equations, in declared sigmas.
    jacobian: DMatrix<f64>,
    /// First equation of each row, and one past the last.
    first: Vec<usize>,
    /// Normal equations of what is known besides the rows: distances between places, and plausible ranges where they count.
    known: NormalEquations,
}

impl<'t> Tangent<'t> {
    /// At a state; nothing if the table is too large for it. Ranges that count in the fit must count here: without them a step to where the rows alone point
    /// leads far from the fit, and the weights of that place are none of the fit's.
    pub(super) fn at(
        problem: &'t ResidualModel<'t>,
        state: &State,
        rows: &'t [usize],
        prior: Option<&Prior>,
    ) -> Option<Self> {
        let mut first = vec![0];
        for row in rows {
            first.push(first.last().copied().unwrap_or(0) + problem.observations.range(*row).len());
        }
        let free_parameters = problem.free_parameters().len();
        // Beyond 32 MB the rows are worked out anew in each round.
        if first.last().copied().unwrap_or(0) * free_parameters > MOST {
            return None;
        }
        let block = problem.block(state, rows, &[], &[]);
        let mut known = NormalEquations::zeros(free_parameters);
        problem.known_besides_rows(state, rows, &mut known);
        if let Some(prior) = prior {
            prior.add(problem, state, &mut known);
        }
        let residuals = DVector::from_vec(block.residuals);
        Some(Self { problem, rows, residuals, jacobian: block.jacobian, first, known })
    }

    /// The same with steps damped: so much is added to the diagonal of the normal equations.
    pub(super) fn damped(mut self, diagonal: &DVector<f64>) -> Self {
        for (index, damping) in diagonal.iter().enumerate() {
            self.known.matrix[(index, index)] += damping;
        }
        self
    }

    /// Weights every row by how far it lies from the fit with these weights, again and again until nothing changes. Returns the
    /// step to that fit, and the weights, one per row of the table.
    pub(super) fn settle(
        &self,
        mut weights: Vec<f64>,
        held: &[usize],
        parameters: usize,
    ) -> (DVector<f64>, Vec<f64>) {
        let mut normal = self.normal(&weights);
        // Iteratively reweighted least squares (Holland and Welsch 1977) on the linear problem.
        for _ in 0..ROUNDS {
            let distances = self.distances(&full_step(&normal, held));
            let fresh = distances.weights(distances.scale(self.rows, parameters));
            // Only what changed is added: most rows keep their full weight from round to round.
            let changes: Vec<f64> = fresh.iter().zip(&weights).map(|(fresh, old)| fresh - old).collect();
            let of_rows = self.rows.iter().filter_map(|row| changes.get(*row));
            let moved = of_rows.fold(0.0, |most: f64, change| most.max(change.abs()));
            self.weigh(&mut normal, |row| changes.get(row).copied().unwrap_or(0.0));
            weights = fresh;
            if moved < SETTLED {
                break;
            }
        }
        (full_step(&normal, held), weights)
    }

    /// The normal equations at the state itself, as the residual model has them with these weights.
    pub(super) fn normal(&self, weights: &[f64]) -> NormalEquations {
        let mut normal = self.known.clone();
        self.weigh(&mut normal, |row| weights.get(row).copied().unwrap_or(1.0));
        normal.squares = self.squares(weights);
        normal.equations += self.residuals.len();
        normal
    }

    /// The weighted sum of squares at the state itself.
    pub(super) fn squares(&self, weights: &[f64]) -> f64 {
        let rows = self.rows.iter().enumerate();
        self.known.squares + rows.map(|(index, row)| self.weighted_square(index, *row, weights)).sum::<f64>()
    }

    /// What one row adds to that sum.
    fn weighted_square(&self, index: usize, row: usize, weights: &[f64]) -> f64 {
        let own = self.range(index);
        weights.get(row).copied().unwrap_or(1.0) * self.residuals.rows(own.start, own.len()).norm_squared()
    }

    /// Adds every row, times its share, to normal equations.
    fn weigh(&self, normal: &mut NormalEquations, fraction: impl Fn(usize) -> f64) {
        let mut indices = Vec::new();
        let mut fractions = Vec::new();
        for (index, row) in self.rows.iter().enumerate() {
            let fraction = fraction(*row);
            if fraction != 0.0 {
                indices.extend(self.range(index));
                fractions.resize(indices.len(), fraction);
            }
        }
        let columns = self.jacobian.select_columns(&indices);
        let mut shared = columns.clone();
        for (mut column, fraction) in shared.column_iter_mut().zip(&fractions) {
            column *= *fraction;
        }
        normal.matrix.gemm(1.0, &shared, &columns.transpose(), 1.0);
        normal.gradient.gemv(1.0, &shared, &self.residuals.select_rows(&indices), 1.0);
    }

    fn range(&self, index: usize) -> std::ops::Range<usize> {
        let [start, end] = [index, index + 1].map(|index| self.first.get(index).copied().unwrap_or(0));
        start..end
    }

    /// How far every row would be from its prediction after a step.
    fn distances(&self, step: &DVector<f64>) -> Distances {
        let off = &self.residuals - self.jacobian.tr_mul(step);
        let mut rows = vec![(0.0, 0); self.problem.table.len()];
        for (index, row) in self.rows.iter().enumerate() {
            let own = self.range(index);
            if let Some(distance) = rows.get_mut(*row) {
                *distance = (off.rows(own.start, own.len()).norm(), own.len());
            }
        }
        Distances { rows }
    }
}
