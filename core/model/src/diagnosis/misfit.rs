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
        let scale = floor.scale?;
        let noise = Noise::of(&fitted.machine, &fitted.fit);
        let ratio = noise.variance / (scale * scale);
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
