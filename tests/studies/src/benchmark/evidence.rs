//! What the peers work with: residuals of the readings against the arm on paper, and how each effect of the library would move them.
//!
//! The signatures are differences of the simulated mechanics themselves, so every peer knows exactly what each effect does: more than it would know of a real
//! machine.

use plumb_simulated::physics::campaign::audit::{Audit, Basis, candidates};
use plumb_simulated::physics::campaign::{Case, GenerateError};

/// One effect at one site, as columns.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Regressor {
    /// Effect.
    pub(super) effect: &'static str,
    /// Site.
    pub(super) site: String,
    /// Its parameters' columns, mm over the readings.
    pub(super) columns: Vec<Vec<f64>>,
}

/// A regression problem.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Evidence {
    /// Readings of one row of the table.
    pub(super) readings_a_row: usize,
    /// Residuals against the arm on paper, all readings in a row, mm.
    pub(super) residual: Vec<f64>,
    /// What the model leaves free, as columns.
    pub(super) free: Vec<Vec<f64>>,
    /// The library.
    pub(super) regressors: Vec<Regressor>,
}

/// A problem with the free parameters projected out of everything.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Projected {
    /// What is left of the residual.
    pub(super) residual: Vec<f64>,
    /// What is left of each regressor's columns.
    pub(super) regressors: Vec<Regressor>,
    /// Readings less determined free parameters.
    pub(super) freedom: usize,
}

impl Evidence {
    /// Sets the problem up as a user would: from the arm on paper.
    pub(super) fn of(case: &Case) -> Result<Self, GenerateError> {
        let audit = Audit::new(&case.specification, &case.visits, &[])?;
        let readings = case.readings.concat();
        let residual =
            readings.iter().zip(audit.expected()).map(|(read, expected)| read - expected).collect();
        let regressors = candidates(&case.specification, &case.visits).into_iter().map(|candidate| {
            let columns =
                candidate.directions.iter().map(|one| audit.signature(one)).collect::<Result<Vec<_>, _>>()?;
            Ok(Regressor { effect: candidate.effect, site: candidate.site, columns })
        });
        Ok(Self {
            readings_a_row: case.readings.first().map_or(1, Vec::len),
            residual,
            free: audit.free_signatures().to_vec(),
            regressors: regressors.collect::<Result<Vec<_>, GenerateError>>()?,
        })
    }

    /// How many rows of the table.
    pub(super) fn rows(&self) -> usize {
        self.residual.len() / self.readings_a_row.max(1)
    }

    /// The problem of the rows kept, with the free parameters projected out.
    pub(super) fn projected(&self, keep: &[bool]) -> Projected {
        let kept = |column: &[f64]| -> Vec<f64> {
            let chunks = column.chunks(self.readings_a_row.max(1)).zip(keep);
            chunks.filter(|(_, keep)| **keep).flat_map(|(chunk, _)| chunk.iter().copied()).collect()
        };
        let free = Basis::of(self.free.iter().map(|column| kept(column)));
        let left = |column: &[f64]| {
            let mut column = kept(column);
            free.remove_from(&mut column);
            column
        };
        let residual = left(&self.residual);
        Projected {
            freedom: residual.len().saturating_sub(free.rank()),
            residual,
            regressors: self
                .regressors
                .iter()
                .map(|one| Regressor {
                    columns: one.columns.iter().map(|column| left(column)).collect(),
                    ..one.clone()
                })
                .collect(),
        }
    }
}

/// Scalar product.
pub(super) fn dot(left: &[f64], right: &[f64]) -> f64 {
    left.iter().zip(right).map(|(a, b)| a * b).sum()
}

/// Probability of a chi-square of one or two degrees of freedom above `value`.
pub(super) fn chi_square_tail(value: f64, freedom: usize) -> f64 {
    if freedom >= 2 { (-0.5 * value).exp() } else { complementary_error((0.5 * value.max(0.0)).sqrt()) }
}

/// erfc for positive arguments (Numerical Recipes' rational Chebyshev fit, relative error below 1.2e-7).
fn complementary_error(x: f64) -> f64 {
    let t = 1.0 / (1.0 + 0.5 * x);
    let coefficients = [
        0.170_872_77,
        -0.822_152_23,
        1.488_515_87,
        -1.135_203_98,
        0.278_868_07,
        -0.186_288_06,
        0.096_784_18,
        0.374_091_96,
        1.000_023_68,
        -1.265_512_23,
    ];
    t * (-x * x + coefficients.iter().fold(0.0, |sum, coefficient| sum * t + coefficient)).exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tails_are_those_of_the_tables() {
        assert!((chi_square_tail(3.841_459, 1) - 0.05).abs() < 1e-6);
        assert!((chi_square_tail(10.827_566, 1) - 0.001).abs() < 1e-7);
        assert!((chi_square_tail(5.991_465, 2) - 0.05).abs() < 1e-6);
    }
}
