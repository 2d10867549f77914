//! Rows of a table with their weights, as a least-squares problem.

use nalgebra::DVector;
use plumb_estimation::{NormalEquations, Problem};

use super::doubt::Prior;
use super::residual_model::ResidualModel;
use super::state::State;

/// What the solver descends on: some rows of a residual model's table, one weight per row of the table.
pub(crate) struct WeightedRows<'r, 'm> {
    problem: &'r ResidualModel<'m>,
    rows: &'r [usize],
    weights: &'r [f64],
    /// The plausible ranges of the geometry; nothing where they do not count.
    prior: Option<&'r Prior>,
}

impl<'r> WeightedRows<'r, '_> {
    /// The same, with the plausible ranges of the geometry as weak prior knowledge.
    pub(super) fn knowing(self, prior: Option<&'r Prior>) -> Self {
        Self { prior, ..self }
    }
}

impl<'m> ResidualModel<'m> {
    /// The least-squares problem over `rows`, each counted with its weight.
    pub(crate) fn over<'r>(&'r self, rows: &'r [usize], weights: &'r [f64]) -> WeightedRows<'r, 'm> {
        WeightedRows { problem: self, rows, weights, prior: None }
    }
}

impl Problem for WeightedRows<'_, '_> {
    type State = State;

    fn normal_equations(&self, state: &State) -> NormalEquations {
        let mut normal = self.problem.normal(state, self.rows, self.weights, &[]);
        if let Some(prior) = self.prior {
            prior.add(self.problem, state, &mut normal);
        }
        normal
    }

    fn stepped(&self, state: &State, change: &DVector<f64>) -> State {
        state.stepped(self.problem.free_parameters(), change.as_slice())
    }

    fn is_finite(&self, state: &State) -> bool {
        state.is_finite()
    }

    fn second_derivative_along(&self, state: &State, change: &DVector<f64>) -> Option<DVector<f64>> {
        // Plausible ranges are linear in the numbers; distances between places are nearly so in a step.
        Some(self.problem.second_derivative_along(state, change, self.rows, self.weights))
    }
}
