//! A peer from statistics: the lasso over all signatures at once, its strength chosen by cross-validation.

use plumb_simulated::physics::campaign::Verdict;

use super::evidence::{Evidence, Projected, dot};
use plumb::commands::trial::score::{Candidate, Diagnosis};

const FOLDS: usize = 5;
const PATH: usize = 40;
const WEAKEST: f64 = 0.02;

/// Fits; names the largest term that the cross-validated strength leaves.
pub(super) fn diagnose(evidence: &Evidence) -> Diagnosis {
    let whole = Problem::new(evidence.projected(&vec![true; evidence.rows()]));
    let strengths: Vec<f64> =
        (0..PATH).map(|step| whole.strongest() * WEAKEST.powf(step as f64 / (PATH - 1) as f64)).collect();
    let strength = choose(evidence, &strengths);
    let before: Vec<f64> = strengths.iter().copied().filter(|one| *one >= strength).collect();
    let weights = whole.path(&before).pop().unwrap_or_default();
    let mut found: Vec<(usize, f64)> = Vec::new();
    for (weight, (owner, _)) in weights.iter().zip(&whole.origins).filter(|(weight, _)| **weight != 0.0) {
        match found.iter_mut().find(|(other, _)| other == owner) {
            Some((_, sum)) => *sum = sum.hypot(*weight),
            None => found.push((*owner, weight.abs())),
        }
    }
    found.sort_by(|a, b| b.1.total_cmp(&a.1));
    let name =
        |owner: &usize| evidence.regressors.get(*owner).map(|one| Candidate::at(one.effect, &one.site));
    let candidates: Vec<Candidate> = found.iter().filter_map(|(owner, _)| name(owner)).collect();
    Diagnosis {
        verdict: if candidates.is_empty() { Verdict::AtFloor } else { Verdict::Named },
        named: candidates.first().cloned(),
        tied: candidates.clone(),
        candidates,
        ..Diagnosis::empty()
    }
}

/// Standardised columns and what the descent needs of them.
struct Problem {
    columns: Vec<Vec<f64>>,
    /// Regressor, and which of its columns.
    origins: Vec<(usize, usize)>,
    scales: Vec<f64>,
    products: Vec<f64>,
    gram: Vec<Vec<f64>>,
}

impl Problem {
    fn new(projected: Projected) -> Self {
        let (mut columns, mut origins, mut scales) = (Vec::new(), Vec::new(), Vec::new());
        for (owner, regressor) in projected.regressors.iter().enumerate() {
            for (index, column) in regressor.columns.iter().enumerate() {
                let norm = dot(column, column).sqrt();
                if norm > 1e-9 {
                    columns.push(column.iter().map(|entry| entry / norm).collect::<Vec<f64>>());
                    origins.push((owner, index));
                    scales.push(norm);
                }
            }
        }
        let products = columns.iter().map(|column| dot(column, &projected.residual)).collect();
        let gram =
            columns.iter().map(|left| columns.iter().map(|right| dot(left, right)).collect()).collect();
        Self { columns, origins, scales, products, gram }
    }

    /// The penalty above which nothing is left.
    fn strongest(&self) -> f64 {
        self.products.iter().fold(0.0, |most, product| product.abs().max(most))
    }

    /// Weights of the standardised columns for each penalty, from the strongest down (coordinate descent with warm starts).
    fn path(&self, strengths: &[f64]) -> Vec<Vec<f64>> {
        let mut weights = vec![0.0; self.columns.len()];
        let mut gradient = self.products.clone();
        let mut path = Vec::with_capacity(strengths.len());
        for strength in strengths {
            for _ in 0..200 {
                let mut moved = 0.0_f64;
                for index in 0..weights.len() {
                    let pull = gradient[index] + weights[index];
                    let weight = pull.signum() * (pull.abs() - strength).max(0.0);
                    let step = weight - weights[index];
                    if step != 0.0 {
                        weights[index] = weight;
                        gradient
                            .iter_mut()
                            .zip(&self.gram[index])
                            .for_each(|(entry, product)| *entry -= step * product);
                        moved = moved.max(step.abs());
                    }
                }
                if moved < 1e-3 * strength {
                    break;
                }
            }
            path.push(weights.clone());
        }
        path
    }
}

/// The greatest penalty whose cross-validated error is within one standard error of the least.
fn choose(evidence: &Evidence, strengths: &[f64]) -> f64 {
    let mut errors: Vec<Vec<f64>> = vec![Vec::with_capacity(FOLDS); strengths.len()];
    let whole = evidence.projected(&vec![true; evidence.rows()]);
    for fold in 0..FOLDS {
        let keep: Vec<bool> = (0..evidence.rows()).map(|row| row % FOLDS != fold).collect();
        let problem = Problem::new(evidence.projected(&keep));
        let fraction = (FOLDS - 1) as f64 / FOLDS as f64;
        let scaled: Vec<f64> = strengths.iter().map(|strength| strength * fraction.sqrt()).collect();
        for (weights, errors) in problem.path(&scaled).iter().zip(&mut errors) {
            errors.push(held_out(evidence, &whole, &problem, weights, &keep));
        }
    }
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len().max(1) as f64;
    let means: Vec<f64> = errors.iter().map(|one| mean(one)).collect();
    let Some((best, least)) = means.iter().copied().enumerate().min_by(|a, b| a.1.total_cmp(&b.1)) else {
        return 0.0;
    };
    let spread = errors.get(best).map_or(0.0, |one| {
        let squares: f64 = one.iter().map(|error| (error - least).powi(2)).sum();
        (squares / (FOLDS * (FOLDS - 1)) as f64).sqrt()
    });
    let simplest = means.iter().position(|mean| *mean <= least + spread);
    simplest.and_then(|index| strengths.get(index)).copied().unwrap_or(0.0)
}

/// Mean square of the rows left out, after the free parameters (fitted on everything, so that they do not spoil the comparison).
fn held_out(
    evidence: &Evidence,
    whole: &Projected,
    problem: &Problem,
    weights: &[f64],
    keep: &[bool],
) -> f64 {
    let mut left = whole.residual.clone();
    for ((weight, scale), (owner, column_index)) in weights.iter().zip(&problem.scales).zip(&problem.origins)
    {
        let column = whole.regressors.get(*owner).and_then(|regressor| regressor.columns.get(*column_index));
        if let (Some(column), true) = (column, *weight != 0.0) {
            left.iter_mut().zip(column).for_each(|(entry, part)| *entry -= weight / scale * part);
        }
    }
    let rows = left.chunks(evidence.readings_a_row.max(1)).zip(keep).filter(|(_, keep)| !**keep);
    let (sum, count) = rows
        .flat_map(|(row, _)| row)
        .fold((0.0, 0_usize), |(sum, count), value| (sum + value * value, count + 1));
    sum / count.max(1) as f64
}
