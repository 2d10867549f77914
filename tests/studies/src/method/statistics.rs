//! What many results have in common.

/// Mean, spread and worst of some numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Summary {
    pub(super) count: usize,
    pub(super) mean: f64,
    /// Standard deviation about the mean, one degree of freedom taken off.
    pub(super) spread: f64,
    /// Greatest distance from zero.
    pub(super) worst: f64,
}

impl Summary {
    /// Of no numbers, everything is unknown.
    pub(super) fn of(values: &[f64]) -> Self {
        let count = values.len();
        let mean = values.iter().sum::<f64>() / count as f64;
        let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
        let spread = if count > 1 { (squares / (count - 1) as f64).sqrt() } else { f64::NAN };
        let worst = values.iter().fold(f64::NAN, |worst: f64, value| worst.max(value.abs()));
        Self { count, mean, spread, worst }
    }

    /// Root mean square: the distance from zero that bias and spread make together.
    pub(super) fn rms(&self) -> f64 {
        let shrunk = self.spread.powi(2) * (self.count.saturating_sub(1)) as f64 / self.count as f64;
        (self.mean.powi(2) + shrunk).sqrt()
    }
}

/// How numbers change from one to the next: the slope of the straight line through them and its standard error.
pub(super) fn drift(values: &[(f64, f64)]) -> (f64, f64) {
    let count = values.len() as f64;
    let middle = values.iter().map(|(x, _)| x).sum::<f64>() / count;
    let mean = values.iter().map(|(_, y)| y).sum::<f64>() / count;
    let width: f64 = values.iter().map(|(x, _)| (x - middle).powi(2)).sum();
    let slope = values.iter().map(|(x, y)| (x - middle) * (y - mean)).sum::<f64>() / width;
    let left: f64 = values.iter().map(|(x, y)| (y - mean - slope * (x - middle)).powi(2)).sum();
    (slope, (left / (count - 2.0) / width).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bias_and_spread_make_the_root_mean_square() {
        let summary = Summary::of(&[1.0, 2.0, 3.0, 6.0]);
        assert_eq!((summary.count, summary.mean, summary.worst), (4, 3.0, 6.0));
        assert!((summary.spread - (14.0_f64 / 3.0).sqrt()).abs() < 1e-12);
        assert!((summary.rms() - 12.5_f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn a_steady_drift_is_found_and_its_error_follows_the_scatter() {
        let (slope, error) = drift(&[(0.0, 1.0), (1.0, 3.0), (2.0, 5.0), (3.0, 7.0)]);
        assert!((slope - 2.0).abs() < 1e-12 && error < 1e-12);
        let (slope, error) = drift(&[(0.0, 1.0), (1.0, -1.0), (2.0, 1.0), (3.0, -1.0)]);
        assert!(slope.abs() < 2.0 * error);
    }
}
