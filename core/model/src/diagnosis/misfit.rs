//! Lack of fit: does more remain than noise?

use super::score::Noise;
use crate::fit::{Fit, Machine, corner};
use crate::floor::{Floor, FloorSource};
use crate::statistics::{chi_squared_tail, f_tail};

use super::trial::Fitted;

/// What remains, against the floor.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Misfit {
    /// Root of what remains over the floor: 1 when nothing but noise is left.
    pub(crate) ratio: f64,
    /// Probability of so much if nothing but noise is left.
    pub(crate) p: f64,
}

/// Probability below which more than noise remains.
pub(crate) const MISFIT_LEVEL: f64 = 0.002;

impl Misfit {
    /// Nothing if the floor is not known.
    pub(crate) fn of(fitted: &Fitted<'_>, floor: &Floor) -> Option<Self> {
        Self::of_fit(&fitted.machine, &fitted.fit, floor)
    }

    /// The same of a machine and its fit.
    pub(crate) fn of_fit(machine: &Machine<'_>, fit: &Fit, floor: &Floor) -> Option<Self> {
        let scale = floor.scale?;
        let noise = Noise::of(machine, fit);
        let ratio = variance(machine, fit, noise) / (scale * scale);
        let p = match floor.source {
            FloorSource::Repeats => f_tail(ratio, noise.freedom, floor.dof as f64),
            FloorSource::Declared | FloorSource::Unknown => {
                chi_squared_tail(ratio * noise.freedom, noise.freedom)
            }
        };
        Some(Self { ratio: ratio.sqrt(), p })
    }

    /// Whether more than noise remains.
    pub(crate) fn fires(&self) -> bool {
        self.p < MISFIT_LEVEL
    }
}

/// Variance of one equation with far poses drawn in to Huber's corner, made right for what that takes away from a normal
/// scatter.
fn variance(machine: &Machine<'_>, fit: &Fit, noise: Noise) -> f64 {
    let (mut drawn_in, mut expected) = (0.0, 0.0);
    for row in &fit.rows {
        let weight = fit.weights.get(*row).copied().unwrap_or(1.0);
        let equations = machine.observations.of_row(*row);
        let residuals = fit.residuals.get(machine.observations.range(*row)).unwrap_or(&[]);
        let square: f64 =
            residuals.iter().zip(equations).map(|(r, equation)| (r / equation.sigma).powi(2)).sum();
        drawn_in += weight * weight * square;
        expected += kept(equations.len());
    }
    let share = if noise.equations > 0.0 { expected / noise.equations } else { 1.0 };
    drawn_in / noise.freedom / share.max(1e-9)
}

/// Expected square of a row of standard normal equations when rows beyond the corner are drawn in to it.
fn kept(equations: usize) -> f64 {
    let count = equations as f64;
    if equations == 0 {
        return 0.0;
    }
    let corner = corner(equations).powi(2);
    count * (1.0 - chi_squared_tail(corner, count + 2.0)) + corner * chi_squared_tail(corner, count)
}
