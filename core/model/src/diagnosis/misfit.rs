//! Lack of fit: does more remain than noise?

use super::score::Noise;
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
    /// Of a plain fit from which wild rows were left out; nothing if the floor is not known.
    pub(crate) fn of(fitted: &Fitted<'_>, floor: &Floor) -> Option<Self> {
        Self::beside(Noise::of(&fitted.machine, &fitted.fit), floor)
    }

    /// Of what a fit leaves; nothing if the floor is not known.
    pub(crate) fn beside(noise: Noise, floor: &Floor) -> Option<Self> {
        let scale = floor.scale?;
        let p = chance(noise.variance * noise.freedom, noise.freedom, floor)?;
        Some(Self { ratio: noise.variance.sqrt() / scale, p })
    }

    /// Whether more than noise remains.
    pub(crate) fn fires(&self) -> bool {
        self.p < MISFIT_LEVEL
    }
}

/// Probability of such a sum of squares (declared sigmas squared) if nothing but noise is left; nothing if the floor is not
/// known.
pub(crate) fn chance(squares: f64, freedom: f64, floor: &Floor) -> Option<f64> {
    let scale = floor.scale?;
    let ratio = squares / freedom.max(1.0) / (scale * scale);
    Some(match floor.source {
        FloorSource::Repeats => f_tail(ratio, freedom, floor.dof as f64),
        FloorSource::Declared | FloorSource::Unknown => chi_squared_tail(ratio * freedom, freedom),
    })
}
