//! Chance that can be repeated: numbers drawn from the world's seed and an index in a sequence, so that what happens at one
//! moment does not depend on how often anybody looked before.

use std::f64::consts::TAU;

/// Mixes seed and index into 64 bits that look random: the finaliser of SplitMix64 (Steele, Lea and Flood, 2014).
fn bits(seed: u64, index: u64) -> u64 {
    let mut mixed = seed ^ index.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    for (shift, factor) in [(30, 0xbf58_476d_1ce4_e5b9), (27, 0x94d0_49bb_1331_11eb)] {
        mixed = (mixed ^ (mixed >> shift)).wrapping_mul(factor);
    }
    mixed ^ (mixed >> 31)
}

/// A number evenly spread over [0, 1).
pub(crate) fn uniform(seed: u64, index: u64) -> f64 {
    (bits(seed, index) >> 11) as f64 / (1_u64 << 53) as f64
}

/// A normally distributed number of mean 0 and standard deviation 1.
pub(crate) fn normal(seed: u64, index: u64) -> f64 {
    let radius = (-2.0 * (1.0 - uniform(seed, index.wrapping_mul(2))).ln()).sqrt();
    radius * (TAU * uniform(seed, index.wrapping_mul(2).wrapping_add(1))).cos()
}

/// Noise at a moment: normal numbers one `knot_ns` apart, joined by straight lines.
pub(crate) fn noise_at(seed: u64, time_ns: u64, knot_ns: u64) -> f64 {
    let knot = time_ns / knot_ns.max(1);
    let within = (time_ns % knot_ns.max(1)) as f64 / knot_ns.max(1) as f64;
    normal(seed, knot) * (1.0 - within) + normal(seed, knot + 1) * within
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_seed_and_moment_give_the_same_noise() {
        assert_eq!(noise_at(7, 123_456_789, 1_000_000), noise_at(7, 123_456_789, 1_000_000));
        assert_ne!(noise_at(7, 123_456_789, 1_000_000), noise_at(8, 123_456_789, 1_000_000));
    }

    #[test]
    fn normal_numbers_have_mean_zero_and_deviation_one() {
        let count = 20_000;
        let drawn: Vec<f64> = (0..count).map(|index| normal(42, index)).collect();
        let mean = drawn.iter().sum::<f64>() / count as f64;
        let variance = drawn.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / count as f64;
        assert!(mean.abs() < 0.03, "mean {mean}");
        assert!((variance - 1.0).abs() < 0.04, "variance {variance}");
    }

    #[test]
    fn noise_passes_through_its_knots_without_a_jump() {
        let before = noise_at(3, 999_999, 1_000_000);
        let at = noise_at(3, 1_000_000, 1_000_000);
        assert!((before - at).abs() < 1e-4);
    }
}
