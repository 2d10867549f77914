//! Many tests at once (Holm 1979), and the median.

/// Holm's step-down adjustment of p values with weights (which sum to the number of tests): adjusted values, in the
/// order given.
pub fn holm(p_values: &[f64], weights: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..p_values.len()).collect();
    order.sort_by(|left, right| ratio(p_values, weights, *left).total_cmp(&ratio(p_values, weights, *right)));
    let mut remaining: f64 =
        (0..p_values.len()).map(|index| weights.get(index).copied().unwrap_or(1.0)).sum();
    let mut adjusted = vec![1.0; p_values.len()];
    let mut highest: f64 = 0.0;
    for index in order {
        // A test is adjusted no less than one that was more significant: the procedure stops at the first that fails.
        highest = highest.max((ratio(p_values, weights, index) * remaining).min(1.0));
        if let Some(slot) = adjusted.get_mut(index) {
            *slot = highest;
        }
        remaining -= weights.get(index).copied().unwrap_or(1.0);
    }
    adjusted
}

/// Weights below this are of tests that are not to be believed at all; zero would divide by zero.
const LEAST_WEIGHT: f64 = 1e-12;

/// The p value of a test over its weight, by which tests are ordered.
fn ratio(p_values: &[f64], weights: &[f64], index: usize) -> f64 {
    let weight = weights.get(index).copied().unwrap_or(1.0).max(LEAST_WEIGHT);
    p_values.get(index).copied().unwrap_or(1.0) / weight
}

/// The median; not a number for an empty list.
pub fn median(values: &[f64]) -> f64 {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    let middle = sorted.len() / 2;
    match (sorted.len() % 2, sorted.get(middle), middle.checked_sub(1).and_then(|below| sorted.get(below))) {
        (1, Some(value), _) => *value,
        (0, Some(above), Some(below)) => 0.5 * (above + below),
        _ => f64::NAN,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn holm_multiplies_the_smallest_by_the_number_of_tests_and_never_decreases() {
        let adjusted = holm(&[0.01, 0.04, 0.03, 0.005], &[1.0; 4]);
        let expected = [0.03, 0.06, 0.06, 0.02];
        assert!(adjusted.iter().zip(expected).all(|(a, e)| (a - e).abs() < 1e-12), "{adjusted:?}");
    }

    #[test]
    fn a_heavier_test_is_charged_less() {
        let adjusted = holm(&[0.01, 0.02], &[1.5, 0.5]);
        assert!(
            (adjusted[0] - 0.01 / 1.5 * 2.0).abs() < 1e-12 && (adjusted[1] - 0.02).abs() < 1e-12,
            "{adjusted:?}"
        );
    }

    #[test]
    fn medians_of_odd_and_even_lists() {
        assert_eq!(median(&[3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(&[4.0, 1.0, 2.0, 3.0]), 2.5);
        assert!(median(&[]).is_nan());
    }
}
