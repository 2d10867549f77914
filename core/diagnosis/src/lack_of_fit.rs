//! Lack of fit: does more remain than noise? An F test against the replicates' scatter, or a chi-squared test against declared
//! sigmas (Draper and Smith 1998, Applied Regression Analysis, section 2.1).

use crate::fitted::Fitted;
use crate::noise_floor::{Floor, FloorSource};
use crate::score_test::Noise;
use crate::thresholds::LACK_OF_FIT_LEVEL;
use plumb_estimation::{chi_squared_tail, f_tail};

/// What remains, against the floor.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LackOfFit {
    /// Root of what remains over the floor: 1 when nothing but noise is left.
    pub(crate) ratio: f64,
    /// Probability of so much if nothing but noise is left.
    pub(crate) p: f64,
}

impl LackOfFit {
    /// Of a plain fit from which outliers were left out; nothing if the floor is not known.
    pub(crate) fn of(fitted: &Fitted<'_>, floor: &Floor) -> Option<Self> {
        Self::beside(Noise::of(&fitted.problem, &fitted.fit), floor)
    }

    /// Of what a fit leaves; nothing if the floor is not known.
    pub(crate) fn beside(noise: Noise, floor: &Floor) -> Option<Self> {
        let scale = floor.scale?;
        let p = probability_of_noise(noise.variance * noise.freedom, noise.freedom, floor)?;
        Some(Self { ratio: noise.variance.sqrt() / scale, p })
    }

    /// Whether more than noise remains.
    pub(crate) fn is_significant(&self) -> bool {
        self.p < LACK_OF_FIT_LEVEL
    }
}

/// Probability of such a sum of squares (declared sigmas squared) if nothing but noise is left; nothing if the floor is not
/// known.
pub(crate) fn probability_of_noise(squares: f64, freedom: f64, floor: &Floor) -> Option<f64> {
    let scale = floor.scale?;
    let ratio = squares / freedom.max(1.0) / (scale * scale);
    Some(match floor.source {
        // A scatter that was measured is itself uncertain; a declared one is taken at its word.
        FloorSource::Repeats => f_tail(ratio, freedom, floor.dof as f64),
        FloorSource::Declared | FloorSource::Unknown => chi_squared_tail(ratio * freedom, freedom),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn floor(source: FloorSource, dof: usize, scale: Option<f64>) -> Floor {
        Floor { sigma_mm: scale, source, dof, scale, allowed_for: Vec::new() }
    }

    #[test]
    fn declared_noise_is_held_against_chi_squared() {
        // Upper 0.2 % point of chi squared with 10 degrees of freedom: 27.72 (R: qchisq(0.998, 10)).
        let declared = floor(FloorSource::Declared, 0, Some(2.0));
        let p = |squares: f64| probability_of_noise(squares, 10.0, &declared).unwrap();
        assert!((p(4.0 * 27.722) - 0.002).abs() < 1e-5, "{}", p(4.0 * 27.722));
        let lack = |squares: f64| LackOfFit { ratio: 1.0, p: p(squares) };
        assert!(lack(4.0 * 27.9).is_significant() && !lack(4.0 * 27.5).is_significant());
        assert!(
            !LackOfFit { ratio: 1.0, p: LACK_OF_FIT_LEVEL }.is_significant(),
            "the level itself is noise"
        );
    }

    #[test]
    fn measured_noise_is_held_against_f_with_its_own_degrees_of_freedom() {
        // Upper 5 % point of F with 3 and 20 degrees of freedom: 3.0984.
        let measured = floor(FloorSource::Repeats, 20, Some(1.0));
        let p = probability_of_noise(3.0 * 3.098_391, 3.0, &measured).unwrap();
        assert!((p - 0.05).abs() < 1e-6, "{p}");
        let fewer = floor(FloorSource::Repeats, 5, Some(1.0));
        assert!(
            probability_of_noise(3.0 * 3.098_391, 3.0, &fewer).unwrap() > 0.1,
            "a floor on 5 degrees knows less"
        );
    }

    #[test]
    fn the_ratio_is_one_where_nothing_but_noise_is_left_and_unknown_without_a_floor() {
        let noise = Noise { variance: 9.0, freedom: 40.0 };
        let lack = LackOfFit::beside(noise, &floor(FloorSource::Declared, 0, Some(3.0))).unwrap();
        assert!((lack.ratio - 1.0).abs() < 1e-12 && !lack.is_significant());
        let twice = LackOfFit::beside(noise, &floor(FloorSource::Declared, 0, Some(1.5))).unwrap();
        assert!((twice.ratio - 2.0).abs() < 1e-12 && twice.is_significant());
        assert!(LackOfFit::beside(noise, &floor(FloorSource::Unknown, 0, None)).is_none());
    }
}
