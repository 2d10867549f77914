//! The adjustment: everything at once, by least squares.

use nalgebra::{DVector, Isometry3};

use super::options::{AdjustError, Options};
use super::problem::{Problem, State, base_from_flange, built};
use super::spread::spread;
use super::view_residuals::{ViewResidual, view_residuals};
use super::{StripePixel, StripeRig, Surface, View};
use plumb_calibration::arm_model::{AddedEffect, Model};
use plumb_calibration::effect::EffectId;

/// A number that was found.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// What: an effect with its parameter, or a number of the rig.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// How much it is beyond where it began.
    pub value: f64,
    /// Its standard error.
    pub sigma: f64,
}

/// What an adjustment has found.
#[derive(Debug, Clone)]
pub struct Adjustment {
    /// Every number, in the order of the options.
    pub found: Vec<Found>,
    /// The rig.
    pub rig: StripeRig,
    /// The surfaces, in their places.
    pub surfaces: Vec<Surface>,
    /// Distance of the points from their surfaces, root mean square, mm.
    pub rms_mm: f64,
    /// Scatter of neighbouring points of one stripe on one surface, mm: what no effect of arm or rig makes, for these change smoothly along a stripe.
    pub noise_mm: f64,
    /// The weighted sum of squares.
    pub chi_square: f64,
    /// Points that took part.
    pub points: usize,
    /// Numbers sought, the surfaces' among them.
    pub unknowns: usize,
    /// Combinations of numbers that no stripe could tell, in words.
    pub not_observable: Vec<String>,
    /// What is left of each view.
    pub views: Vec<ViewResidual>,
    values: Vec<f64>,
    effects: Vec<EffectId>,
}

/// Rounds of choosing points' surfaces anew.
const ROUNDS: usize = 4;

/// A step that gains less than this share of what is left is the last.
pub(super) const SETTLED: f64 = 1e-7;

/// Steps in a round.
const STEPS: usize = 12;

/// Adjusts rig, effects and the surfaces' places together, from about right ones.
///
/// # Errors
/// [`AdjustError`]
pub fn adjust(
    model: &Model,
    rig: &StripeRig,
    surfaces: &[Surface],
    views: &[View],
    pixels: &[StripePixel],
    options: &Options,
) -> Result<Adjustment, AdjustError> {
    let mut problem = Problem::new(model, views, options.clone())?;
    let mut state = problem.beginning(rig, surfaces);
    problem.solve(&mut state, pixels, 12.0)?;
    Ok(problem.told(state))
}

impl Problem<'_> {
    /// Chooses each point's surface and settles, in turns; points farther away than `limit` mm are left out at first.
    pub(super) fn solve(
        &mut self,
        state: &mut State,
        pixels: &[StripePixel],
        mut limit: f64,
    ) -> Result<(), AdjustError> {
        for round in 0..ROUNDS {
            self.choose(state, pixels, limit)?;
            self.settle(state, SETTLED)?;
            let rms = self.rms_mm(state);
            limit = if round == 0 { (6.0 * rms).clamp(1.0, 8.0) } else { (4.0 * rms).clamp(0.3, limit) };
        }
        Ok(())
    }

    /// Goes down until a step gains less than this share of what is left.
    pub(super) fn settle(&self, state: &mut State, enough: f64) -> Result<(), AdjustError> {
        let cost = |residuals: &DVector<f64>| residuals.iter().map(|residual| huber(*residual)).sum::<f64>();
        let mut residuals = self.residuals(state);
        let mut damping = 1e-6;
        for _ in 0..STEPS {
            let mut jacobian = self.jacobian(state);
            let weights = residuals.map(weight);
            let weighted = residuals.component_mul(&weights);
            jacobian.column_iter_mut().for_each(|mut column| column.component_mul_assign(&weights));
            let normal = jacobian.tr_mul(&jacobian);
            let toward = jacobian.tr_mul(&weighted);
            let before = cost(&residuals);
            let mut gained = false;
            for _ in 0..8 {
                let mut damped = normal.clone();
                for place in 0..damped.nrows() {
                    damped[(place, place)] += damping * normal[(place, place)].max(1e-12);
                }
                let Some(step) = damped.cholesky().map(|factor| factor.solve(&toward)) else {
                    damping *= 100.0;
                    continue;
                };
                let mut tried = state.clone();
                for (unknown, by) in step.iter().enumerate() {
                    tried = self.moved(&tried, unknown, -by);
                }
                let left = self.residuals(&tried);
                if cost(&left) <= before {
                    gained = before - cost(&left) > enough * before;
                    *state = tried;
                    residuals = left;
                    damping = (damping * 0.1).max(1e-9);
                    break;
                }
                damping *= 30.0;
            }
            if !gained {
                break;
            }
        }
        if residuals.iter().all(|residual| residual.is_finite()) {
            Ok(())
        } else {
            Err(AdjustError::Diverged)
        }
    }

    pub(super) fn told(&self, state: State) -> Adjustment {
        let residuals = self.residuals(&state);
        let jacobian = self.jacobian(&state);
        let chi_square: f64 = residuals.iter().map(|residual| huber(*residual)).sum();
        let unknowns = jacobian.ncols();
        let names = self.names();
        let (sigmas, not_observable) =
            spread(&jacobian, &names, chi_square / self.members.len().saturating_sub(unknowns).max(1) as f64);
        let values = state.rig_values.iter().chain(&state.values);
        let found = names.iter().zip(values).zip(&sigmas).map(|(((name, unit), value), sigma)| Found {
            name: name.clone(),
            unit: unit.clone(),
            value: *value,
            sigma: *sigma,
        });
        Adjustment {
            found: found.collect(),
            rms_mm: self.rms_mm(&state),
            noise_mm: self.noise_mm(&state),
            chi_square,
            points: self.members.len(),
            unknowns,
            not_observable,
            views: view_residuals(self, &state),
            rig: state.rig,
            surfaces: state.surfaces,
            values: state.values,
            effects: self.options.effects.clone(),
        }
    }
}

/// Residuals beyond so many sigmas count linearly.
const HUBER: f64 = 3.0;

/// The weight of a residual, as a factor on it.
pub(super) fn weight(residual: f64) -> f64 {
    (HUBER / residual.abs().max(HUBER)).sqrt()
}

pub(super) fn huber(residual: f64) -> f64 {
    let size = residual.abs();
    if size <= HUBER { size * size } else { 2.0 * HUBER * size - HUBER * HUBER }
}

impl Adjustment {
    /// Where the flange is under what was found.
    ///
    /// # Errors
    /// As [`adjust`], for another model than it was adjusted with.
    pub fn flange(&self, model: &Model, view: &View) -> Result<Isometry3<f64>, AdjustError> {
        let effects = built(model, &self.effects)?;
        Ok(base_from_flange(model, &effects, &self.values, view, self.rig.clock_skew_s))
    }

    /// The effects with their values, as a model file keeps them.
    ///
    /// # Errors
    /// As [`adjust`], for another model than it was adjusted with.
    pub fn added(&self, model: &Model) -> Result<Vec<AddedEffect>, AdjustError> {
        let mut values = self.values.iter().copied();
        let effects = built(model, &self.effects)?;
        let added = self.effects.iter().zip(&effects).map(|(id, effect)| AddedEffect {
            id: id.clone(),
            values: values.by_ref().take(effect.parameters().len()).collect(),
        });
        Ok(added.collect())
    }

    /// The Bayesian information criterion: less is better, and a difference of 10 is beyond doubt.
    pub fn bic(&self) -> f64 {
        self.chi_square + self.unknowns as f64 * (self.points as f64).ln()
    }
}
