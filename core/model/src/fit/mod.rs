//! Fitting: what the parameters must be, how well they are known, and which of them cannot be known at all.

mod align;
mod gauge;
mod levenberg;
mod linear;
mod machine;
mod normal;
mod observations;
mod outcome;
mod robust;
mod state;
mod tangent;

pub use gauge::Gauge;
pub use machine::Machine;
pub use observations::{Equation, Observations, ObservationsError, Reading};
pub use outcome::{Convergence, Fit, FitError};
pub use state::{Slot, State};

pub(crate) use align::{Sight, base_and_targets};
pub(crate) use linear::Factor;
pub(crate) use machine::Part;
pub(crate) use normal::{Normal, for_each, over_rows};
pub(crate) use outcome::huber_variance;
pub(crate) use robust::{Distances, corner};
pub(crate) use state::square_to;

use crate::progress::Progress;

/// How to fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FitOptions {
    /// Weigh poses down that lie far outside the others' scatter (Huber).
    pub robust: bool,
    /// Steps at most in one descent.
    pub steps: usize,
}

impl Default for FitOptions {
    fn default() -> Self {
        Self { robust: true, steps: 100 }
    }
}

impl Machine<'_> {
    /// Fits all free parameters to the rows whose `mask` is true, starting from `start`.
    ///
    /// # Errors
    /// Too few rows, poses that are all alike, numbers that leave the finite, or cancellation.
    pub fn fit(
        &self,
        start: &State,
        mask: &[bool],
        options: FitOptions,
        progress: &Progress,
    ) -> Result<Fit, FitError> {
        outcome::fit(self, start, mask, options, progress)
    }

    /// Fits again from a place that is already near: the same rows, weights to start with.
    pub(crate) fn refit(
        &self,
        start: &State,
        rows: &[usize],
        weights: &[f64],
        options: FitOptions,
        progress: &Progress,
    ) -> Result<Fit, FitError> {
        outcome::refit(self, start, rows, weights.to_vec(), options, progress)
    }
}
