//! From marginal likelihoods to probabilities.

/// Probabilities in proportion to marginal likelihoods, from criteria (twice their negative logarithms).
pub(crate) fn posterior(criteria: &[f64]) -> Vec<f64> {
    let least = criteria.iter().copied().fold(f64::INFINITY, f64::min);
    let weights: Vec<f64> = criteria.iter().map(|one| (-0.5 * (one - least)).exp()).collect();
    let total: f64 = weights.iter().sum();
    weights.into_iter().map(|one| one / total).collect()
}
