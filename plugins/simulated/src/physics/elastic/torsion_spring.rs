//! Springs between a drive and its link.

use super::{ElasticPart, Loaded, Yielding};

/// A linear spring: the joint turns by `compliance` rad/(N m) times gravity's moment.
#[derive(Debug)]
pub(super) struct TorsionSpring {
    pub(super) joint: usize,
    pub(super) compliance: f64,
}

impl ElasticPart for TorsionSpring {
    fn yield_to(&self, loaded: &Loaded<'_>, yielding: &mut Yielding) {
        let moment = loaded.moments.get(self.joint).copied().unwrap_or(0.0);
        yielding.turn(self.joint, self.compliance * moment);
    }
}

/// A spring that stiffens, as the soft wind-up of harmonic drives does: `moment = knee (u + u^3)` with `u` the turn over `compliance knee`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StiffeningSpring {
    /// Joint.
    pub joint: usize,
    /// At rest, rad/(N m).
    pub compliance: f64,
    /// Moment at which a soft spring would have turned as far as makes it twice as stiff, N m.
    pub knee: f64,
}

impl StiffeningSpring {
    /// The turn under a moment of `moment` N m, rad: the one real root of the cubic (Cardano, in hyperbolic form).
    pub fn turn(&self, moment: f64) -> f64 {
        let fraction = moment / self.knee;
        let root = (1.5 * 3.0_f64.sqrt() * fraction).asinh() / 3.0;
        self.compliance * self.knee * 2.0 / 3.0_f64.sqrt() * root.sinh()
    }
}

impl ElasticPart for StiffeningSpring {
    fn yield_to(&self, loaded: &Loaded<'_>, yielding: &mut Yielding) {
        let moment = loaded.moments.get(self.joint).copied().unwrap_or(0.0);
        yielding.turn(self.joint, self.turn(moment));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_stiffening_spring_balances_its_moment() {
        let spring = StiffeningSpring { joint: 0, compliance: 2e-5, knee: 30.0 };
        for moment in [-250.0, -1.0, 0.0, 0.3, 40.0, 900.0] {
            let wound = spring.turn(moment) / (spring.compliance * spring.knee);
            assert!((spring.knee * (wound + wound.powi(3)) - moment).abs() < 1e-9, "at {moment} N m");
        }
    }
}
