//! How rows that are left out are predicted with an effect beside the flexible part, and by that part alone; and how its size differs from block to block.

use super::bench::{Bench, Foremost, Set};
use crate::block_errors;
use crate::cross_validation::{joint_blocks, pose_groups, region_blocks, session_blocks};
use crate::explainable::{LeftOutRows, MixedFit};
use crate::predictive_gain::Gain;
use plumb_estimation::{for_each, huber_constant, median};

/// What blocks of rows say of one effect.
pub(super) struct Predictions {
    /// By how many standard errors the rows are predicted better with it than by everything else, in the way of leaving blocks out in which it does least.
    pub(super) gain: f64,
    /// The same where the flexible part keeps the variances it has beside the candidate, and so cannot take its place.
    pub(super) gain_beside: f64,
    /// The same without what the flexible part has of the candidate's own kind at its joint ([`Foremost::own_functions`]).
    pub(super) gain_apart: f64,
    /// Its values without the flexible part.
    pub(super) plain: Vec<f64>,
    /// Its values without each region, beside the flexible part and without it.
    pub(super) values: Vec<Vec<f64>>,
    pub(super) plain_values: Vec<Vec<f64>>,
}

impl Predictions {
    /// Of a candidate of `set`; `without` is the same set without it. Nothing where what is left without a block does not determine what is fitted.
    pub(super) fn of(bench: &Bench<'_>, asked: &Foremost<'_>, without: &Set) -> Option<Self> {
        let (candidate, set) = (asked.member, asked.set);
        let table = bench.stage.fitted.problem.table;
        // An infinite ratio gives a component up: nothing flexible is left.
        let stiff = vec![f64::INFINITY; bench.nothing.ratios.len()];
        let plain = bench.mixed.fit(&bench.parameters(&set.members), Some(&stiff))?;
        let joint = bench.candidates.get(candidate)?.id.joint();
        let scale = robust_scale(bench.mixed.residuals(&set.fit).as_slice());
        let mut ways = vec![region_blocks(table, &bench.rows)];
        ways.extend(joint.map(|joint| joint_blocks(table, &bench.rows, joint)));
        ways.extend(session_blocks(table, &bench.rows));
        let compared = comparisons(without, asked);
        let mut predictions = Self {
            gain: f64::INFINITY,
            gain_beside: f64::INFINITY,
            gain_apart: f64::INFINITY,
            plain: bench.part(set, candidate, plain.values.as_slice()).to_vec(),
            values: Vec::new(),
            plain_values: Vec::new(),
        };
        for (number, blocks) in ways.iter().enumerate() {
            let equations = blocks.iter().map(|block| bench.equations_of(block)).collect();
            let left_out = bench.mixed.leave_out(equations)?;
            let blocks =
                for_each(&left_out, |one| compared_without(bench, (&set.fit, &compared), one, scale));
            let mut reductions = vec![vec![0.0; bench.mixed.equations()]; compared.len()];
            for (block, left_out) in blocks.into_iter().zip(&left_out) {
                let (values, own) = block?;
                for (reductions, own) in reductions.iter_mut().zip(&own) {
                    own.iter().for_each(|(equation, reduction)| reductions[*equation] = *reduction);
                }
                // The jackknife wants blocks of one kind: regions, the first way.
                if number == 0 {
                    let (_, plain_values) = bench.mixed.predict(&plain, left_out)?;
                    predictions.values.push(bench.part(set, candidate, &values).to_vec());
                    predictions.plain_values.push(bench.part(set, candidate, &plain_values).to_vec());
                }
            }
            let least = [&mut predictions.gain, &mut predictions.gain_beside, &mut predictions.gain_apart];
            for (least, reductions) in least.into_iter().zip(&reductions) {
                *least = least.min(bench.gain_over(reductions));
            }
        }
        if asked.own_functions.is_empty() {
            predictions.gain_apart = predictions.gain_beside;
        }
        Some(predictions)
    }
}

/// A fit without the candidate, and one with it where that is not the set's own.
type Comparison = (MixedFit, Option<MixedFit>);

/// Equations of a block, each with the fall of its loss.
type Reductions = Vec<(usize, f64)>;

/// What is compared: a fit without the candidate, and one with it where that is not the set's own. Without functions of the candidate's own kind there is nothing to leave out:
/// the third comparison is the second.
fn comparisons(without: &Set, asked: &Foremost<'_>) -> Vec<Comparison> {
    let (own, with) = (&asked.own_functions, &asked.set.fit);
    let mut all = vec![(without.fit.clone(), None), (without.fit.at_ratios(with.ratios.clone()), None)];
    if !own.is_empty() {
        let ratios = with.ratios_without(own);
        all.push((without.fit.at_ratios(ratios.clone()), Some(with.at_ratios(ratios))));
    }
    all
}

/// The set's own fit and each comparison without a block of rows: the values of the set's parameters, and by how much the loss falls at each of the block's equations.
fn compared_without(
    bench: &Bench<'_>,
    (own, compared): (&MixedFit, &[Comparison]),
    left_out: &LeftOutRows,
    scale: f64,
) -> Option<(Vec<f64>, Vec<Reductions>)> {
    let fits = compared.iter().flat_map(|(before, with)| [before, with.as_ref().unwrap_or(own)]);
    let fits: Vec<&MixedFit> = std::iter::once(own).chain(fits).collect();
    let predicted = bench.mixed.predict_each(&fits, left_out)?;
    let ((_, values), pairs) = predicted.split_first()?;
    let reductions = pairs.as_chunks::<2>().0.iter().map(|[(before, _), (after, _)]| {
        let equations = before.iter().zip(after);
        equations
            .map(|((equation, before), (_, after))| (*equation, reduction(*before, *after, scale)))
            .collect()
    });
    Some((values.clone(), reductions.collect()))
}

/// Standard errors of the values of the effect that is asked, beside the flexible part, as blocks of rows have them; nothing where what is left without a block does not
/// determine what is fitted.
pub(super) fn errors_by_blocks(bench: &Bench<'_>, asked: &Foremost<'_>) -> Option<Vec<f64>> {
    let (candidate, set) = (asked.member, asked.set);
    let mut errors = vec![0.0; bench.parameters(&[candidate]).len()];
    for blocks in block_errors::ways(bench.stage.fitted.problem.table, &bench.rows) {
        let equations = blocks.iter().map(|block| bench.equations_of(block)).collect();
        let mut without = Vec::new();
        let left_out = bench.mixed.leave_out(equations)?;
        for predicted in for_each(&left_out, |one| bench.mixed.predict(&set.fit, one)) {
            let (_, values) = predicted?;
            without.push(bench.part(set, candidate, &values).to_vec());
        }
        block_errors::raise(&mut errors, &without);
    }
    Some(errors)
}

impl Bench<'_> {
    /// By how many standard errors losses fall, over poses; from the fall at every equation.
    fn gain_over(&self, reductions: &[f64]) -> f64 {
        let poses = pose_groups(self.stage.fitted.problem.table, &self.rows);
        let reductions =
            poses.iter().map(|rows| self.equations_of(rows).into_iter().map(|one| reductions[one]).sum());
        let reductions: Vec<f64> = reductions.collect();
        Gain::over(&reductions).map_or(0.0, |gain| gain.total / gain.error.max(f64::MIN_POSITIVE))
    }

    /// Equations of some of the rows.
    fn equations_of(&self, rows: &[usize]) -> Vec<usize> {
        let indices = rows.iter().filter_map(|row| self.rows.binary_search(row).ok());
        indices.filter_map(|index| self.features.equations.get(index).cloned()).flatten().collect()
    }
}

/// Huber's loss of a residual, whose sigma is `scale` (Huber 1981): a few rows that everything misses must not decide what predicts the others better.
fn loss(residual: f64, scale: f64) -> f64 {
    let (size, constant) = (residual.abs(), huber_constant(1) * scale);
    if size <= constant { residual * residual } else { constant * (2.0 * size - constant) }
}

/// By how much a residual's loss falls: below zero where it is predicted worse.
fn reduction(before: f64, after: f64, scale: f64) -> f64 {
    loss(before, scale) - loss(after, scale)
}

/// Sigma of some residuals by the median of their amounts; they have mean zero.
fn robust_scale(residuals: &[f64]) -> f64 {
    let sizes: Vec<f64> = residuals.iter().map(|one| one.abs()).collect();
    // The median of the amount of a normal number is 0.6745 sigma. Without residuals any scale does.
    let sigma = median(&sizes) / 0.6745;
    if sigma.is_nan() { 1.0 } else { sigma.max(f64::MIN_POSITIVE) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_residual_counts_by_its_square_up_to_the_constant_and_by_its_amount_beyond() {
        let constant = 2.0 * huber_constant(1);
        assert!((loss(-0.99 * constant, 2.0) - (0.99 * constant).powi(2)).abs() < 1e-12);
        let (near, far) = (loss(3.0 * constant, 2.0), loss(4.0 * constant, 2.0));
        assert!((far - near - 2.0 * constant * constant).abs() < 1e-9, "{near} {far}");
        assert!((reduction(0.5, -0.25, 2.0) - (0.25 - 0.0625)).abs() < 1e-12);
        assert!((reduction(-0.25, 0.5, 2.0) + (0.25 - 0.0625)).abs() < 1e-12, "it grows");
    }

    #[test]
    fn the_scale_of_residuals_does_not_feel_a_few_outliers() {
        let mut residuals: Vec<f64> = (1..100).map(|one| f64::from(one - 50) * 0.06).collect();
        let sound = robust_scale(&residuals);
        // Amounts of 0 to 2.94, evenly: their median is 1.5, a sigma 1.5 / 0.6745.
        assert!((sound - 1.5 / 0.6745).abs() < 0.05, "{sound}");
        residuals.extend([1e6; 4]);
        assert!((robust_scale(&residuals) / sound - 1.0).abs() < 0.1);
        assert_eq!(robust_scale(&[]), 1.0);
    }
}
