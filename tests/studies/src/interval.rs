//! Shares with their uncertainty.

use serde::Serialize;

/// Standard normal quantile of a two-sided 95 % interval.
pub(crate) const Z95: f64 = 1.959_963_984_540_054;

/// So many out of so many, with Wilson's 95 % interval (Wilson 1927): right also near 0 and 1.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct Proportion {
    /// How many.
    pub(crate) count: usize,
    /// Out of how many.
    pub(crate) trials: usize,
    /// Lower end of the interval, 0 to 1.
    pub(crate) low: f64,
    /// Upper end of the interval, 0 to 1.
    pub(crate) high: f64,
}

impl Proportion {
    /// The fraction of trials for which this holds.
    pub(crate) fn of(holds: impl IntoIterator<Item = bool>) -> Self {
        let (mut count, mut trials) = (0, 0);
        for one in holds {
            trials += 1;
            count += usize::from(one);
        }
        let (low, high) = wilson(count as f64, trials as f64);
        Self { count, trials, low, high }
    }

    /// Per cent, with its interval; a dash when there were no trials.
    pub(crate) fn percent(&self) -> String {
        match self.trials {
            0 => "-".to_owned(),
            _ => {
                format!("{:.1} [{:.1}, {:.1}]", 100.0 * self.value(), 100.0 * self.low, 100.0 * self.high)
            }
        }
    }

    /// The fraction itself, 0 to 1; not a number when there were no trials.
    pub(crate) fn value(&self) -> f64 {
        self.count as f64 / self.trials as f64
    }
}

fn wilson(count: f64, trials: f64) -> (f64, f64) {
    if trials == 0.0 {
        return (0.0, 1.0);
    }
    let fraction = count / trials;
    let square = Z95 * Z95 / trials;
    let middle = (fraction + 0.5 * square) / (1.0 + square);
    let half = Z95 * (fraction * (1.0 - fraction) / trials + 0.25 * square / trials).sqrt() / (1.0 + square);
    ((middle - half).max(0.0), (middle + half).min(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_interval_is_the_published_one() {
        // Newcombe 1998, table I: 81 of 263, Wilson without continuity correction: 0.2553 to 0.3662; 0 of 20: 0 to 0.1611.
        let of = |count: usize, trials: usize| Proportion::of((0..trials).map(|index| index < count));
        let fraction = of(81, 263);
        assert!(
            (fraction.low - 0.2553).abs() < 5e-5 && (fraction.high - 0.3662).abs() < 5e-5,
            "{fraction:?}"
        );
        assert_eq!((fraction.percent().as_str(), of(0, 0).percent().as_str()), ("30.8 [25.5, 36.6]", "-"));
        let none = of(0, 20);
        assert!(none.low == 0.0 && (none.high - 0.1611).abs() < 5e-5, "{none:?}");
    }
}
