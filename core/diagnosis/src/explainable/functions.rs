//! Smooth functions of what is known of a row: random Fourier features (Rahimi & Recht 2007, section 3) and cosines on a range (Solin & Särkkä 2020, section 3).

use std::f64::consts::{PI, TAU};

use plumb_estimation::Random;

/// Cosines of 1, 2, ... half periods on the range of some numbers, their amplitude falling with the frequency; where a number is missing 0. None where the
/// numbers do not vary.
pub(super) fn cosines(values: Vec<f64>, count: usize) -> Vec<Vec<f64>> {
    let finite = values.iter().copied().filter(|value| value.is_finite());
    let (low, high) = finite
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
    if high - low <= 1e-9 {
        return Vec::new();
    }
    let waves = (1..=count).map(|order| order as f64).map(|order| {
        let of_rows = values.iter().map(|value| match value.is_finite() {
            // Amplitudes that fall as one over the order make the sum continuous, and no smoother: a kink of a dead zone can still be followed.
            true => (PI * order * (value - low) / (high - low)).cos() / order,
            false => 0.0,
        });
        of_rows.collect()
    });
    waves.collect()
}

/// Numbers less their mean, over their standard deviation; 0 where one is missing.
pub(super) fn centred(values: &[f64]) -> Vec<f64> {
    let finite: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
    let count = finite.len().max(1) as f64;
    let mean = finite.iter().sum::<f64>() / count;
    let spread = (finite.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / count).sqrt().max(1e-12);
    values.iter().map(|value| if value.is_finite() { (value - mean) / spread } else { 0.0 }).collect()
}

/// The products of two functions, row by row.
pub(super) fn times(one: &[f64], other: &[f64]) -> Vec<f64> {
    one.iter().zip(other).map(|(one, other)| one * other).collect()
}

/// Random Fourier features of inputs (rows by inputs) for a Gaussian kernel of this length: sine and cosine of `count` random frequencies.
pub(super) fn fourier_features(
    inputs: &[Vec<f64>],
    length: f64,
    count: usize,
    random: &mut Random,
) -> Vec<Vec<f64>> {
    let width = inputs.first().map_or(0, Vec::len);
    let mut functions = Vec::with_capacity(2 * count);
    for _ in 0..count {
        // The spectrum of a Gaussian kernel is normal, with one over its length as its standard deviation (Bochner's theorem).
        let frequency: Vec<f64> = (0..width).map(|_| random.normal() / length.max(1e-9)).collect();
        let phase = TAU * random.uniform();
        let angles = inputs
            .iter()
            .map(|input| phase + input.iter().zip(&frequency).map(|(value, rate)| value * rate).sum::<f64>());
        let angles: Vec<f64> = angles.collect();
        functions.push(angles.iter().map(|angle| angle.cos()).collect());
        functions.push(angles.iter().map(|angle| angle.sin()).collect());
    }
    functions
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cosines_cover_the_range_and_a_constant_has_none() {
        let functions = cosines(vec![2.0, 3.0, 4.0, f64::NAN], 2);
        assert_eq!(functions.len(), 2);
        assert!((functions[0][0] - 1.0).abs() < 1e-12 && functions[0][1].abs() < 1e-12);
        assert!((functions[0][2] + 1.0).abs() < 1e-12 && functions[0][3] == 0.0);
        assert!((functions[1][1] + 0.5).abs() < 1e-12, "the second has half the amplitude");
        assert!(cosines(vec![5.0; 4], 3).is_empty());
    }

    #[test]
    fn numbers_are_centred_on_their_mean_over_their_spread_and_multiplied_row_by_row() {
        // Mean 3, variance (4 + 0 + 4) / 3.
        let spread = (8.0_f64 / 3.0).sqrt();
        let found = centred(&[1.0, 3.0, f64::NAN, 5.0]);
        for (one, expected) in found.iter().zip([-2.0 / spread, 0.0, 0.0, 2.0 / spread]) {
            assert!((one - expected).abs() < 1e-12, "{found:?}");
        }
        assert_eq!(times(&[2.0, 3.0], &[4.0, -5.0]), [8.0, -15.0]);
    }

    #[test]
    fn products_of_fourier_features_approach_the_gaussian_kernel() {
        let inputs = vec![vec![0.0, 0.0], vec![0.6, -0.3]];
        let functions = fourier_features(&inputs, 0.7, 4000, &mut Random::seeded(5));
        let kernel: f64 = functions.iter().map(|one| one[0] * one[1]).sum::<f64>() / 4000.0;
        let exact = (-(0.36 + 0.09) / (2.0 * 0.49_f64)).exp();
        assert!((kernel - exact).abs() < 0.03, "{kernel} {exact}");
    }
}
