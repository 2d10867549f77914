//! Fitting: what the parameters must be, how well they are known, and which of them cannot be known at all.

mod align;
mod arm_pose;
mod assume;
mod beliefs;
mod bend_slopes;
mod bending;
mod doubt;
mod gauge;
pub mod hand_eye;
mod normal;
mod outcome;
mod picture;
mod place_bodies;
mod place_profiles;
mod problem;
mod residual_model;
mod response;
mod robust;
mod scratch;
mod seen;
mod sensor;
mod state;
mod subject_motion;
mod tangent;
mod variance_components;
mod view_of_table;

pub use doubt::FitDoubt;
pub use gauge::Gauge;
pub use outcome::{Convergence, Fit, FitError};
pub use place_bodies::SeenBody;
pub use state::{FreeParameter, State};

pub use align::{Sight, base_and_targets, rigid};
pub use arm_pose::ArmPose;
pub use beliefs::RowDetails;
pub use residual_model::{Part, ResidualModel, RowBlock};
pub use robust::Distances;
pub use variance_components::{NoiseEstimateError, estimate_noise};
pub(crate) use view_of_table::ViewOfTable;

use plumb_estimation::Progress;

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

impl ResidualModel<'_> {
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
    pub fn refit(
        &self,
        start: &State,
        rows: &[usize],
        weights: &[f64],
        options: FitOptions,
        progress: &Progress,
    ) -> Result<Fit, FitError> {
        self.refit_holding(start, (rows, weights), &[], options, progress)
    }

    /// The same with some free parameters, by their indices, held where they start. For comparing models that differ by an effect: numbers that the rows hardly determine, free in the one and
    /// held in the other, are a difference that is no effect's.
    ///
    /// # Errors
    /// As of a whole fit.
    pub fn refit_holding(
        &self,
        start: &State,
        (rows, weights): (&[usize], &[f64]),
        holding: &[usize],
        options: FitOptions,
        progress: &Progress,
    ) -> Result<Fit, FitError> {
        outcome::refit(self, start, (rows, weights.to_vec()), holding, options, progress)
    }

    /// A robust fit by one step from where it is expected to end, with the weights settled on the tangent there
    /// (a one-step M-estimate: Bickel 1975, One-step Huber estimates in the linear model, J. Am. Stat. Assoc. 70): right to second order in
    /// how far the start is off, at the cost of a few evaluations. A whole fit where the step leaves more than staying does, or where it leads to a place from which
    /// another promises much: there the tangent was none, and what is left does not say which rows lie outside.
    ///
    /// # Errors
    /// As of a whole fit.
    pub fn refit_by_one_step(
        &self,
        start: &State,
        rows: &[usize],
        weights: &[f64],
        options: FitOptions,
        progress: &Progress,
    ) -> Result<Fit, FitError> {
        match outcome::one_step(self, start, rows, weights.to_vec())? {
            Some(fit) if fit.convergence.is_near() => Ok(fit),
            Some(fit) => self.refit(&fit.state, rows, weights, options, progress),
            None => self.refit(start, rows, weights, options, progress),
        }
    }
}

#[cfg(test)]
mod tests;
