//! Undeclared noise, estimated from what a fit leaves: one variance for each kind of reading.
//!
//! The estimate of Förstner (Ein Verfahren zur Schätzung von Varianz- und Kovarianzkomponenten, Allgemeine
//! Vermessungs-Nachrichten 86, 1979), whose fixed point is that of restricted maximum likelihood (Patterson and Thompson
//! 1971): the variance of a group is its sum of squares over its redundancy, the number of its equations less the sum of
//! their leverages `h = j' N^-1 j`. Found anew with the new sigmas until it stays.

use super::outcome::{Fit, FitError};
use super::residual_model::ResidualModel;
use super::{FitOptions, State};
use crate::arm_model::{AddedEffect, Model};
use crate::effect::EffectNameError;
use crate::measurement::{NoiseGroup, Observations, ObservationsError};
use crate::table::Table;
use plumb_estimation::Progress;
use thiserror::Error;

/// Rounds of estimating at most; from sigmas a hundred times off it takes five.
const ROUNDS: usize = 15;

/// Relative change of a sigma at which it is taken to stay: far below the 7 % to which a hundred readings know it.
const SETTLED: f64 = 0.01;

/// A sigma changes by this factor in one round at most: what the first fit with wrong sigmas leaves may be far off.
const STRIDE: f64 = 30.0;

/// Redundancy (equations less what the fit absorbs of them) below which a variance is not estimated: it would be known
/// to no better than 30 % (chi squared).
const LEAST_REDUNDANCY: f64 = 6.0;

/// Rows looked at, spread over the table: a sigma is then known to 2 %.
const LOOKED_AT: usize = 1500;

/// Sigma of angles from which the estimate starts where none is declared, rad: that of a spirit level (0.06 deg).
const FIRST_ANGLE: f64 = 1e-3;

/// Why no noise can be estimated.
#[derive(Debug, Error)]
pub enum NoiseEstimateError {
    /// The fit.
    #[error(transparent)]
    Fit(#[from] FitError),
    /// An effect that is fitted.
    #[error(transparent)]
    Effect(#[from] EffectNameError),
    /// The measurements.
    #[error(transparent)]
    Observations(#[from] ObservationsError),
}

/// Variance of a group in units of its present sigmas squared, and its redundancy.
#[derive(Debug, Clone, Copy)]
struct Component {
    variance: f64,
    redundancy: f64,
}

/// Noise that nobody declared, mm or rad, by its key of `noise:`, from the fit of these effects to the rows whose `mask` is
/// true. Where some noise is declared, undeclared readings are given the sigma with which they lie as far outside their noise as
/// the declared ones: what the model lacks moves both. Nothing where all is declared, or where there is but one kind of reading.
///
/// # Errors
/// See [`NoiseEstimateError`].
pub fn estimate_noise(
    model: &Model,
    table: &Table,
    observations: &Observations,
    effects: &[AddedEffect],
    mask: &[bool],
    progress: &Progress,
) -> Result<Vec<(String, f64)>, NoiseEstimateError> {
    let groups = observations.noise_groups(model);
    if groups.len() < 2 || groups.iter().all(|group| group.is_declared) {
        return Ok(Vec::new());
    }
    let mask = thinned(mask);
    let mut model = model.clone();
    model.noise.estimated = first_guess(observations, &groups);
    let mut near: Option<Fit> = None;
    for _ in 0..ROUNDS {
        let weighed = Observations::new(&model, table)?;
        let problem = ResidualModel::new(&model, table, &weighed, effects)?;
        let options = FitOptions::default();
        let fit = match &near {
            Some(near) => problem.refit(&near.state, &near.rows, &near.weights, options, progress)?,
            None => problem.fit(&problem.start(), &mask, options, progress)?,
        };
        let components = components(&problem, &fit.state, &fit, &groups);
        near = Some(fit);
        let moved = settle(&mut model.noise.estimated, &groups, &components);
        if moved < SETTLED {
            break;
        }
    }
    Ok(model.noise.estimated)
}

/// About [`LOOKED_AT`] of the rows of a mask, evenly spread.
fn thinned(mask: &[bool]) -> Vec<bool> {
    let stride = mask.iter().filter(|used| **used).count().div_ceil(LOOKED_AT).max(1);
    let mut seen = 0;
    mask.iter()
        .map(|used| {
            seen += usize::from(*used);
            *used && (seen - 1) % stride == 0
        })
        .collect()
}

/// Sigmas to start from: those declared for readings of the same unit, else 1 mm and [`FIRST_ANGLE`].
fn first_guess(observations: &Observations, groups: &[NoiseGroup]) -> Vec<(String, f64)> {
    let open = groups.iter().filter(|group| !group.is_declared);
    open.map(|group| {
        let usual = if group.is_length { 1.0 } else { FIRST_ANGLE };
        (group.key.clone(), declared_sigma(observations, group.is_length).unwrap_or(usual))
    })
    .collect()
}

/// Root mean square of the sigmas that were declared for lengths (mm), or for angles (rad).
fn declared_sigma(observations: &Observations, is_length: bool) -> Option<f64> {
    let known = observations
        .equations
        .iter()
        .filter(|equation| equation.is_declared && equation.measurand.is_length() == is_length);
    let (sum, count) = known.fold((0.0, 0.0), |(sum, count), one| (sum + one.sigma.powi(2), count + 1.0));
    (count > 0.0).then(|| f64::sqrt(sum / count))
}

/// The variance component of every group at a fit; far rows are drawn in as Huber's estimate does it.
fn components(
    problem: &ResidualModel<'_>,
    state: &State,
    fit: &Fit,
    groups: &[NoiseGroup],
) -> Vec<Component> {
    let mut group_of = vec![0; problem.observations.equations.len()];
    for (number, group) in groups.iter().enumerate() {
        for index in &group.equations {
            if let Some(entry) = group_of.get_mut(*index) {
                *entry = number;
            }
        }
    }
    let mut sums = vec![(0.0, 0.0, 0.0, 0.0); groups.len()];
    for row in &fit.rows {
        let weight = fit.weights.get(*row).copied().unwrap_or(1.0);
        let block = problem.block(state, &[*row], &fit.weights, &[]);
        let white = fit.factor.whiten(&block.jacobian);
        let columns = white.column_iter().zip(&block.residuals);
        for (index, (column, residual)) in problem.observations.range(*row).zip(columns) {
            let Some((squares, weights, count, leverage)) =
                group_of.get(index).and_then(|group| sums.get_mut(*group))
            else {
                continue;
            };
            // The residual carries the root of its weight.
            *squares += weight * residual * residual;
            *weights += weight;
            *count += 1.0;
            *leverage += column.norm_squared();
        }
    }
    sums.into_iter()
        .map(|(squares, weights, count, leverage)| {
            let redundancy = count - leverage;
            // The weight that far rows have lost is made good, as in Huber's variance (Huber 1981, section 7.6).
            let lost = count / f64::max(weights, 1e-300);
            Component { variance: squares * lost / redundancy.max(1.0), redundancy }
        })
        .collect()
}

/// Moves the sigmas to what the components say; returns the greatest relative change.
fn settle(sigmas: &mut [(String, f64)], groups: &[NoiseGroup], components: &[Component]) -> f64 {
    let all = groups.iter().zip(components).filter(|(_, one)| one.redundancy >= LEAST_REDUNDANCY);
    let declared = all.clone().filter(|(group, _)| group.is_declared);
    let (squares, redundancy) = declared.fold((0.0, 0.0), |(squares, redundancy), (_, one)| {
        (squares + one.variance * one.redundancy, redundancy + one.redundancy)
    });
    // What the model lacks moves declared readings too: the others are held to the same excess over their noise.
    let reference = if redundancy > 0.0 { squares / redundancy } else { 1.0 };
    let mut most: f64 = 0.0;
    for (group, one) in all.filter(|(group, _)| !group.is_declared) {
        // Far from the solution the weights are far off too, and with them the components: one stride at a time.
        let ratio = (one.variance / reference).sqrt().clamp(STRIDE.recip(), STRIDE);
        if let Some((_, sigma)) = sigmas.iter_mut().find(|(key, _)| *key == group.key)
            && ratio.is_finite()
        {
            *sigma *= ratio;
            most = most.max((ratio - 1.0).abs());
        }
    }
    most
}

#[cfg(test)]
mod tests {
    use super::*;
    use plumb_estimation::Random;

    #[test]
    fn a_search_begins_at_the_root_mean_square_of_what_is_declared_in_the_same_unit() {
        let model = Model::parse("m.yaml", &MODEL.replace("NOISE", "{p1_mm: 0.3, p2_mm: 0.4}")).unwrap();
        let header = ["p1", "p2", "p3"].map(|name| format!("{name}_x_mm,{name}_y_mm,{name}_z_mm")).join(",");
        let text = format!("q1_deg,q2_deg,q3_deg,{header}\n0,0,0,1,2,3,4,5,6,7,8,9\n");
        let table = Table::parse("t.csv", &text).unwrap();
        let observations = Observations::new(&model, &table).unwrap();
        assert!((declared_sigma(&observations, true).unwrap() - 0.125_f64.sqrt()).abs() < 1e-12);
        assert_eq!(declared_sigma(&observations, false), None);
    }

    #[test]
    fn a_sigma_moves_by_the_root_of_its_variance_over_that_of_what_is_declared() {
        let group = |key: &str, is_declared: bool| NoiseGroup {
            key: key.to_owned(),
            is_declared,
            is_length: true,
            equations: Vec::new(),
        };
        let groups = [group("p1_mm", true), group("p2_mm", false)];
        let settled = |declared: f64, own: f64, redundancy: f64| {
            let mut sigmas = vec![("p2_mm".to_owned(), 0.5)];
            let parts = [(declared, 40.0), (own, redundancy)]
                .map(|(variance, redundancy)| Component { variance, redundancy });
            let moved = settle(&mut sigmas, &groups, &parts);
            (sigmas[0].1, moved)
        };
        // The declared are as far out as they should be, the others twice as far.
        let (sigma, moved) = settled(1.0, 4.0, 40.0);
        assert!((sigma - 1.0).abs() < 1e-12 && (moved - 1.0).abs() < 1e-12, "{sigma} {moved}");
        // Both are too far out by the same factor: that is the model's.
        let (sigma, moved) = settled(2.25, 2.25, 40.0);
        assert!((sigma - 0.5).abs() < 1e-12 && moved < 1e-12, "{sigma} {moved}");
        let (sigma, moved) = settled(1.0, 4.0, 0.9 * LEAST_REDUNDANCY);
        assert_eq!((sigma, moved), (0.5, 0.0), "too few readings say nothing");
        let (sigma, _) = settled(1.0, 1e6, 40.0);
        assert!((sigma - 0.5 * STRIDE).abs() < 1e-12, "one stride at a time");
    }

    const MODEL: &str = "
arm: column
convention: distal
joints:
  - {name: turn, d_mm: 100, alpha_deg: -90}
  - {name: lift, a_mm: 300}
  - {name: bend, a_mm: 200}
base: {free: true}
targets: {p1: {xyz_mm: [0, 0, 30], free: true}, p2: {xyz_mm: [20, 40, 0], free: true}, p3: {xyz_mm: [10, -40, 10], free: true}}
free: []
noise: NOISE
";

    /// Three targets of a right arm, read with these sigmas (mm), the first and second declared or not.
    fn estimated(noise: &str, sigmas: [f64; 3], off_mm: f64) -> Vec<(String, f64)> {
        let model = Model::parse("model.yaml", &MODEL.replace("NOISE", noise)).unwrap();
        let mut random = Random::seeded(7);
        let mut text = "q1_deg,q2_deg,q3_deg".to_owned();
        for target in 1..=3 {
            text.push_str(&format!(",p{target}_x_mm,p{target}_y_mm,p{target}_z_mm"));
        }
        text.push('\n');
        for _ in 0..120 {
            let q = [0, 1, 2].map(|_| 120.0 * random.uniform() - 60.0);
            let bare = format!("q1_deg,q2_deg,q3_deg,p1_x_mm\n{},{},{},0\n", q[0], q[1], q[2]);
            let pose = Table::parse("pose.csv", &bare).unwrap();
            let observations = Observations::new(&model, &pose).unwrap();
            let problem = ResidualModel::new(&model, &pose, &observations, &[]).unwrap();
            let start = problem.start();
            let flange = problem.flange(0, &mut problem.scratch(&start));
            text.push_str(&format!("{},{},{}", q[0], q[1], q[2]));
            for (target, sigma) in model.targets.iter().zip(sigmas) {
                let mut point = (flange * nalgebra::Point3::from(target.xyz)).coords;
                // What the model lacks: all targets go up and down with the second joint.
                point.z += off_mm * (3.0 * q[1].to_radians()).sin();
                for part in point.iter() {
                    text.push_str(&format!(",{}", part + sigma * random.normal()));
                }
            }
            text.push('\n');
        }
        let table = Table::parse("table.csv", &text).unwrap();
        let observations = Observations::new(&model, &table).unwrap();
        let mask = vec![true; table.len()];
        estimate_noise(&model, &table, &observations, &[], &mask, &Progress::unwatched()).unwrap()
    }

    fn is_near(found: &(String, f64), name: &str, sigma: f64, part: f64) {
        assert_eq!(found.0, name);
        assert!((found.1 / sigma - 1.0).abs() < part, "{found:?} for {sigma}");
    }

    #[test]
    fn of_three_targets_the_two_undeclared_get_the_noise_they_have() {
        let found = estimated("{p1_mm: 0.02}", [0.02, 0.05, 0.3], 0.0);
        assert_eq!(found.len(), 2);
        is_near(&found[0], "p2_mm", 0.05, 0.15);
        is_near(&found[1], "p3_mm", 0.3, 0.15);
    }

    #[test]
    fn what_the_model_lacks_is_no_noise_of_the_undeclared_alone() {
        // All three are off by 0.3 mm. Against a declared 0.02 mm that must not make 0.3 mm of noise of the others.
        let found = estimated("{p1_mm: 0.02}", [0.02, 0.02, 0.02], 0.5);
        is_near(&found[0], "p2_mm", 0.02, 0.2);
        is_near(&found[1], "p3_mm", 0.02, 0.2);
    }

    #[test]
    fn where_none_is_declared_each_target_gets_its_own_and_where_all_are_nothing_is_estimated() {
        let found = estimated("{}", [0.02, 0.05, 0.3], 0.0);
        is_near(&found[0], "p1_mm", 0.02, 0.15);
        is_near(&found[1], "p2_mm", 0.05, 0.15);
        is_near(&found[2], "p3_mm", 0.3, 0.15);
        assert!(estimated("{p1_mm: 1, p2_mm: 1, p3_mm: 1}", [0.1; 3], 0.0).is_empty());
    }

    #[test]
    fn a_mask_is_thinned_evenly() {
        let kept = thinned(&vec![true; 4 * LOOKED_AT]);
        assert_eq!(kept.iter().filter(|kept| **kept).count(), LOOKED_AT);
        assert!(kept[0] && !kept[1] && kept[4]);
        assert_eq!(thinned(&[true, false, true]), [true, false, true]);
    }
}
