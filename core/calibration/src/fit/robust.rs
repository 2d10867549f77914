//! Huber's weights, one a pose: a pose far outside the others' scatter pulls no harder than one at the edge of it.

use plumb_estimation::{chi_squared_quantile, huber_constant};

use super::residual_model::ResidualModel;

/// Distances of rows from their prediction, in sigmas, with the number of equations each.
pub struct Distances {
    /// Per row: norm of the residuals in sigmas, number of equations.
    pub rows: Vec<(f64, usize)>,
}

impl Distances {
    /// Distances of all rows of the table, from the residuals of all its equations (mm and rad).
    pub fn of(problem: &ResidualModel<'_>, residuals: &[f64]) -> Self {
        let rows = (0..problem.observations.rows())
            .map(|row| {
                let range = problem.observations.range(row);
                let own = residuals.get(range.clone()).unwrap_or(&[]);
                let equations = problem.observations.of_row(row);
                let squares: f64 =
                    own.iter().zip(equations).map(|(r, equation)| (r / equation.sigma).powi(2)).sum();
                (squares.sqrt(), range.len())
            })
            .collect();
        Self { rows }
    }

    /// Scatter of the bulk of `rows`, in sigmas: from the median, which outliers do not move, made right for the
    /// `parameters` that were fitted.
    pub fn scale(&self, rows: &[usize], parameters: usize) -> f64 {
        let mut typical = ByCount::new(|count| chi_squared_quantile(0.5, count as f64).sqrt());
        let mut relative: Vec<f64> = rows
            .iter()
            .filter_map(|row| self.rows.get(*row))
            .filter(|(_, count)| *count > 0)
            .map(|(norm, count)| norm / typical.get(*count))
            .collect();
        if relative.is_empty() {
            return 1.0;
        }
        let middle = relative.len() / 2;
        let (_, median, _) = relative.select_nth_unstable_by(middle, f64::total_cmp);
        let equations: usize =
            rows.iter().filter_map(|row| self.rows.get(*row)).map(|(_, count)| count).sum();
        let freedom = equations.saturating_sub(parameters).max(1) as f64;
        *median * (equations as f64 / freedom).sqrt()
    }

    /// Huber's weight for every row, for a scatter of `scale` sigmas.
    pub fn weights(&self, scale: f64) -> Vec<f64> {
        self.rows
            .iter()
            .map(|(norm, count)| {
                let edge = scale * huber_constant(*count);
                if *norm <= edge || *norm == 0.0 { 1.0 } else { edge / norm }
            })
            .collect()
    }
}

/// A function of the number of equations, computed once for each.
struct ByCount<F: Fn(usize) -> f64> {
    compute: F,
    known: Vec<f64>,
}

impl<F: Fn(usize) -> f64> ByCount<F> {
    fn new(compute: F) -> Self {
        Self { compute, known: Vec::new() }
    }

    fn get(&mut self, count: usize) -> f64 {
        while self.known.len() <= count {
            self.known.push((self.compute)(self.known.len()));
        }
        self.known.get(count).copied().unwrap_or(1.0)
    }
}
