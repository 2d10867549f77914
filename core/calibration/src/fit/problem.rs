//! Rows of a table with their weights, as a least-squares problem.

use nalgebra::DVector;
use plumb_estimation::{NormalEquations, Problem};

use super::residual_model::ResidualModel;
use super::state::State;

/// What the solver descends on: some rows of a machine's table, one weight per row of the table.
pub(crate) struct WeightedRows<'r, 'm> {
    machine: &'r ResidualModel<'m>,
    rows: &'r [usize],
    weights: &'r [f64],
}

impl<'m> ResidualModel<'m> {
    /// The least-squares problem over `rows`, each counted with its weight.
    pub(crate) fn over<'r>(&'r self, rows: &'r [usize], weights: &'r [f64]) -> WeightedRows<'r, 'm> {
        WeightedRows { machine: self, rows, weights }
    }
}

impl Problem for WeightedRows<'_, '_> {
    type State = State;

    fn normal_equations(&self, state: &State) -> NormalEquations {
        self.machine.normal(state, self.rows, self.weights, &[])
    }

    fn stepped(&self, state: &State, change: &DVector<f64>) -> State {
        state.stepped(self.machine.slots(), change.as_slice())
    }

    fn is_finite(&self, state: &State) -> bool {
        state.is_finite()
    }
}
