//! How fast the motors run for the speed number of a command.

use std::time::Duration;

/// The speed number of a command, 0 (slowest) to 245.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct SpeedCode(u8);

/// The period of a half-step for each unit of `255 - code`: s.
///
/// From one figure alone: code 183 makes 141 half-steps a second. That the period is proportional to `255 - code` follows from the byte the
/// controller stores in a taught program.
const PERIOD_UNIT: f64 = 1.0 / (72.0 * 141.0);

impl SpeedCode {
    /// The slowest: 40 half-steps a second.
    pub const SLOWEST: Self = Self(0);
    /// The largest number the controller takes.
    pub const FASTEST: Self = Self(245);

    /// The code of a number, or `None` for one the controller does not take.
    pub fn new(code: u8) -> Option<Self> {
        (code <= Self::FASTEST.0).then_some(Self(code))
    }

    /// The number in the command.
    pub fn number(self) -> u8 {
        self.0
    }

    /// The fastest code that makes no more than `rate` half-steps a second; the slowest code when even that is faster.
    pub fn at_most(rate: f64) -> Self {
        let units = (1.0 / (rate.max(f64::MIN_POSITIVE) * PERIOD_UNIT)).ceil();
        let code = (255.0 - units).clamp(0.0, f64::from(Self::FASTEST.0));
        Self(code as u8)
    }

    /// Half-steps a second of the motor that makes the most of them.
    pub fn rate(self) -> f64 {
        1.0 / (f64::from(255 - self.0) * PERIOD_UNIT)
    }

    /// How long `half_steps` of the motor that makes the most of them take.
    pub fn duration(self, half_steps: u32) -> Duration {
        Duration::from_secs_f64(f64::from(half_steps) / self.rate())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_one_figure_that_is_known_is_met() {
        assert!((SpeedCode(183).rate() - 141.0).abs() < 1e-9);
    }

    #[test]
    fn the_code_for_a_rate_is_never_faster() {
        for rate in [1.0, 40.0, 88.0, 141.0, 290.0, 677.0, 1e9] {
            let code = SpeedCode::at_most(rate);
            assert!(code.rate() <= rate + 1e-9 || code == SpeedCode::SLOWEST, "{rate}");
        }
        assert_eq!(SpeedCode::at_most(141.0 + 1e-6), SpeedCode(183));
        assert_eq!(SpeedCode::at_most(0.0), SpeedCode::SLOWEST);
        assert_eq!(SpeedCode::at_most(1e9), SpeedCode::FASTEST);
    }

    #[test]
    fn a_code_beyond_the_controllers_is_none() {
        assert_eq!(SpeedCode::new(246), None);
    }
}
