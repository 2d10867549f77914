//! What was searched for on a coarse grid (a time constant, the moment at which a joint stiffens) is settled, and what is not
//! known of it widens the error of the size.

use std::collections::BTreeMap;

use nalgebra::DVector;

use super::forward_selection::Stage;
use crate::laboratory::{Laboratory, LaboratoryError};
use plumb_calibration::arm_model::AddedEffect;
use plumb_calibration::effect::{self, EffectId, Search, joint_step};
use plumb_calibration::fit::FitOptions;
use plumb_estimation::{Progress, bic_above, for_each};

/// Steps of the logarithm of what is searched for, from coarse to fine.
const STEPS: [f64; 3] = [0.35, 0.2, 0.1];

/// How far the logarithm may move in one of them.
const FARTHEST: f64 = 0.7;

/// Rows that may not see the joint before and after its jump.
const BLIND_ROWS: usize = 2;

/// A refit with what is searched for at one place.
struct Tried {
    squares: f64,
    /// Numbers that the rows determine.
    numbers: f64,
    values: DVector<f64>,
    covariance: nalgebra::DMatrix<f64>,
}

/// An effect with what is searched for inside it at a value.
fn with_inner(id: &EffectId, inner: f64) -> EffectId {
    EffectId { inner: Some(inner), ..id.clone() }
}

/// How far the logarithm of what is searched for is to move from the middle of three places a `step` apart, where these squares are left: to the bottom of the
/// parabola through them; where it opens downward, a long step downhill.
fn to_the_bottom([low, middle, high]: [f64; 3], step: f64) -> f64 {
    let bend = low + high - 2.0 * middle;
    let slope = 0.5 * (high - low);
    let farthest = if bend > 0.0 { -slope / bend * step } else { -slope.signum() * FARTHEST };
    farthest.clamp(-FARTHEST, FARTHEST)
}

/// Variance of that logarithm, where the middle of the three leaves its squares on so many degrees of freedom.
fn variance_of_logarithm([low, middle, high]: [f64; 3], step: f64, freedom: f64) -> f64 {
    // Second derivative of the squares by the logarithm: twice the noise's variance over it is the variance of the logarithm.
    let bend = (low + high - 2.0 * middle) / (step * step);
    // Of what is searched for nothing is known beyond a factor of e when the squares do not bend.
    (2.0 * middle / freedom / bend.max(1e-300)).clamp(0.0, 1.0)
}

impl Laboratory {
    /// Settles what the likeliest fitted candidate searched for.
    pub(super) fn refine(&self, stage: &mut Stage<'_>, progress: &Progress) -> Result<(), LaboratoryError> {
        let Some(first) = stage.fitted_candidates.first().filter(|first| first.passes()) else {
            return Ok(());
        };
        match effect::kind(&first.id.name).map(|kind| kind.search) {
            Some(Search::Smooth) => self.settle(stage, progress),
            Some(Search::Jumps) => self.date(stage, progress),
            _ => Ok(()),
        }
    }

    /// The moment of a jump, to the row: all moments between the neighbours of the one that was tried. Rows that do not see the
    /// joint date nothing: of moments that explain as much the last is taken, that of the first row that shows the jump.
    fn date(&self, stage: &mut Stage<'_>, progress: &Progress) -> Result<(), LaboratoryError> {
        let Some(first) = stage.fitted_candidates.first() else { return Ok(()) };
        let Some(tried) = first.id.inner else { return Ok(()) };
        let (id, start) = (first.id.clone(), first.values.clone());
        let clocks = &self.summary().clocks;
        let mut index = clocks.partition_point(|clock| *clock < tried);
        // Half the distance between two moments of the coarse grid, and the rows that see nothing.
        let near = clocks.len().div_ceil(2 * joint_step::MOMENTS) + BLIND_ROWS;
        let mut known: BTreeMap<usize, Tried> = BTreeMap::new();
        // A moment at the edge of those that were tried may have better ones beyond.
        for _ in 0..clocks.len() {
            let (first, last) = (index.saturating_sub(near), (index + near + 1).min(clocks.len()));
            let moments = clocks.iter().enumerate().take(last).skip(first);
            let unknown: Vec<(usize, f64)> =
                moments.filter(|(row, _)| !known.contains_key(row)).map(|(row, at)| (row, *at)).collect();
            let tried = for_each(&unknown, |(row, at)| {
                let there = EffectId { inner: Some(*at), ..id.clone() };
                Ok::<_, LaboratoryError>((*row, self.tried(stage, &there, start.clone(), progress)?))
            });
            for found in tried {
                let (row, there) = found?;
                known.insert(row, there);
            }
            let least = known.values().map(|there| there.squares).fold(f64::INFINITY, f64::min);
            let numbers = known.values().next().map_or(0.0, |there| there.numbers);
            let variance = least / (stage.fitted.fit.normal.equations as f64 - numbers).max(1.0);
            // Within one variance of the least: moments whose likelihoods differ by less than one standard deviation of one number.
            let alike = known.iter().rfind(|(_, there)| there.squares <= least + variance);
            let Some(latest) = alike.map(|(row, _)| *row) else { return Ok(()) };
            let inside = (latest > first || first == 0) && (latest + 1 < last || last == clocks.len());
            index = latest;
            if inside {
                break;
            }
        }
        let best = known.remove(&index).zip(clocks.get(index).copied());
        let equations = stage.fitted.fit.normal.equations as f64;
        let least = stage.fitted.problem.least_variance();
        if let (Some((best, at)), Some(first)) = (best, stage.fitted_candidates.first_mut()) {
            first.bic = bic_above(least, best.squares, equations, best.numbers, first.search_cost);
            first.values = best.values.iter().copied().collect();
            first.covariance = best.covariance;
            first.id.inner = Some(at);
        }
        Ok(())
    }

    /// A number on which the effect depends smoothly: its logarithm goes to the bottom of the parabola.
    fn settle(&self, stage: &mut Stage<'_>, progress: &Progress) -> Result<(), LaboratoryError> {
        let Some(first) = stage.fitted_candidates.first() else { return Ok(()) };
        let Some(mut middle) = first.id.inner.filter(|inner| *inner > 0.0) else { return Ok(()) };
        let (id, start) = (first.id.clone(), first.values.clone());
        let mut best = self.tried(stage, &with_inner(&id, middle), start.clone(), progress)?;
        for step in STEPS {
            let (low, high) = self.either_side(stage, &with_inner(&id, middle), (&start, step), progress)?;
            let moved = middle * to_the_bottom([low.squares, best.squares, high.squares], step).exp();
            let there = self.tried(stage, &with_inner(&id, moved), start.clone(), progress)?;
            // A parabola that fits badly may promise a place that is no better.
            if there.squares < best.squares {
                (middle, best) = (moved, there);
            }
        }
        let step: f64 = 0.1;
        let (low, high) = self.either_side(stage, &with_inner(&id, middle), (&start, step), progress)?;
        // What was searched for is one number more than the linear model counts.
        let freedom = (stage.fitted.fit.normal.equations as f64 - best.numbers - 1.0).max(1.0);
        let variance = variance_of_logarithm([low.squares, best.squares, high.squares], step, freedom);
        let slope = (high.values - low.values) / (2.0 * step);
        let equations = stage.fitted.fit.normal.equations as f64;
        let least = stage.fitted.problem.least_variance();
        if let Some(first) = stage.fitted_candidates.first_mut() {
            first.bic = bic_above(least, best.squares, equations, best.numbers, first.search_cost);
            first.values = best.values.iter().copied().collect();
            // GUM (JCGM 100:2008, section 5.1): how the values move with what was searched for, times how well that is known.
            first.covariance = best.covariance + &slope * slope.transpose() * variance;
            first.id.inner = Some(middle);
        }
        Ok(())
    }

    /// Refits with the logarithm of what is searched for a step lower, and a step higher.
    fn either_side(
        &self,
        stage: &Stage<'_>,
        id: &EffectId,
        (start, step): (&[f64], f64),
        progress: &Progress,
    ) -> Result<(Tried, Tried), LaboratoryError> {
        let middle = id.inner.unwrap_or(1.0);
        let low = self.tried(stage, &with_inner(id, middle * (-step).exp()), start.to_vec(), progress)?;
        let high = self.tried(stage, &with_inner(id, middle * step.exp()), start.to_vec(), progress)?;
        Ok((low, high))
    }

    fn tried(
        &self,
        stage: &Stage<'_>,
        id: &EffectId,
        values: Vec<f64>,
        progress: &Progress,
    ) -> Result<Tried, LaboratoryError> {
        progress.check()?;
        let mut more = stage.taken.clone();
        more.push(AddedEffect { id: id.clone(), values });
        let options = FitOptions { robust: false, ..self.options().fit };
        let refit = self.fit_to_compare(&more, &stage.fitted, &[], options, progress)?;
        let values = refit.fit.state.effects.last().cloned().unwrap_or_default();
        // All that are tried are of the likeliest candidate.
        let freedom = stage.fitted_candidates.first().map_or(values.len(), |first| first.score.freedom);
        let free_parameters = refit.problem.free_parameters().len();
        let own: Vec<usize> = (free_parameters.saturating_sub(values.len())..free_parameters).collect();
        Ok(Tried {
            squares: refit.fit.normal.squares,
            numbers: stage.fitted.parameters_in(&refit, id, freedom),
            covariance: refit.fit.covariance.select_rows(&own).select_columns(&own),
            values: DVector::from_vec(values),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Squares of a parabola that bends by 100 and has its bottom of 20 at a place, from a step below nought to a step above.
    fn parabola(bottom: f64, step: f64) -> [f64; 3] {
        [-step, 0.0, step].map(|at| 20.0 + 50.0 * (at - bottom).powi(2))
    }

    #[test]
    fn one_step_leads_to_the_bottom_of_a_parabola_and_never_farther_than_a_factor_of_two() {
        assert!((to_the_bottom(parabola(0.3, 0.2), 0.2) - 0.3).abs() < 1e-12);
        assert!((to_the_bottom(parabola(-0.05, 0.35), 0.35) + 0.05).abs() < 1e-12);
        assert_eq!(to_the_bottom(parabola(2.0, 0.2), 0.2), FARTHEST);
        // Opening downward, and straight: downhill.
        assert_eq!(to_the_bottom([3.0, 4.0, 2.0], 0.2), FARTHEST);
        assert_eq!(to_the_bottom([1.0, 2.0, 3.0], 0.2), -FARTHEST);
    }

    #[test]
    fn a_logarithm_is_known_the_better_the_more_the_squares_bend() {
        // Noise of 20 / 10, second derivative 100: 2 * 2 / 100.
        assert!((variance_of_logarithm(parabola(0.0, 0.1), 0.1, 10.0) - 0.04).abs() < 1e-12);
        assert_eq!(variance_of_logarithm([5.0; 3], 0.1, 10.0), 1.0, "nothing is known beyond a factor of e");
    }

    /// Rows a hundred seconds apart, the elbow off by so much (deg) at a time (s).
    fn dated(rows: usize, off: impl Fn(f64) -> f64) -> Laboratory {
        let model = plumb_calibration::arm_model::Model::parse(
            "m.yaml",
            &format!("{}free: [joint_zero(*)]\n", crate::testing::TWO_LINKS),
        )
        .unwrap();
        let mut random = plumb_estimation::Random::seeded(5);
        let mut text = "time_s,q1_deg,q2_deg,p1_x_mm,p1_y_mm,p1_z_mm\n".to_owned();
        for row in 0..rows {
            let time = 100.0 * row as f64;
            let q = [300.0 * random.uniform() - 150.0, 200.0 * random.uniform() - 100.0];
            let first = q[0].to_radians();
            let second = first + (q[1] + off(time)).to_radians();
            let x = 200.0 * first.cos() + 150.0 * second.cos() + 0.02 * random.normal();
            let y = 200.0 * first.sin() + 150.0 * second.sin() + 0.02 * random.normal();
            text.push_str(&format!(
                "{time},{:.9},{:.9},{x:.9},{y:.9},{:.9}\n",
                q[0],
                q[1],
                0.02 * random.normal()
            ));
        }
        let table = plumb_calibration::table::Table::parse("t.csv", &text).unwrap();
        let options = crate::laboratory::Options {
            holdout: crate::split::Holdout::None,
            ..crate::laboratory::Options::default()
        };
        Laboratory::new(model, table, options).unwrap()
    }

    /// What explains the rows best, with what is searched for in it settled.
    fn likeliest(lab: &Laboratory) -> crate::forward_selection::FittedCandidate {
        let candidates =
            crate::candidates::Candidates { listed: crate::candidates::probes(lab), unlisted: Vec::new() };
        let mut stage = lab.stage(Vec::new(), None, &candidates, &Progress::unwatched()).unwrap();
        stage.fitted_candidates.swap_remove(0)
    }

    #[test]
    fn what_is_searched_for_is_compared_with_the_numbers_held_that_the_stage_holds() {
        let lab = dated(60, |_| 0.0);
        let none = crate::candidates::Candidates { listed: Vec::new(), unlisted: Vec::new() };
        let mut stage = lab.stage(Vec::new(), None, &none, &Progress::unwatched()).unwrap();
        // The shoulder's zero is a tenth of a degree off.
        stage.fitted.fit.state.effects[0][0] += 0.1_f64.to_radians();
        let id = with_inner(
            &plumb_calibration::effect::parse("joint_harmonic(elbow, 3)", lab.model()).unwrap(),
            1.0,
        );
        let mut squares = |held: &[usize]| {
            stage.fitted.fit.held = held.to_vec();
            lab.tried(&stage, &id, vec![0.0; 2], &Progress::unwatched()).unwrap().squares
        };
        let (free, held) = (squares(&[]), squares(&[0]));
        assert!(held > 10.0 * free, "{held} {free}");
    }

    #[test]
    fn a_jump_between_the_moments_that_were_tried_is_dated_to_its_row() {
        // Of 180 rows every third is tried.
        for row in [60, 61, 62] {
            let lab = dated(180, |time| if time < 100.0 * f64::from(row) { 0.0 } else { 0.4 });
            let first = likeliest(&lab);
            assert_eq!(first.id.name, "joint_step", "{:?}", first.id);
            assert_eq!(first.id.inner, Some(100.0 * f64::from(row)));
        }
    }

    #[test]
    fn a_time_constant_between_those_of_the_grid_is_settled_with_its_error() {
        // The elbow creeps: an error of 0.4 deg that it comes to with a time constant of 2,000 s.
        let lab = dated(80, |time| 0.4 * (1.0 - (-time / 2000.0).exp()));
        let first = likeliest(&lab);
        assert_eq!(first.id.name, "warm_up", "{:?}", first.id);
        let constant = first.id.inner.unwrap();
        assert!((constant / 2000.0 - 1.0).abs() < 0.05, "{constant}");
        // What is not known of the constant widens the error of the size.
        let error = first.covariance[(0, 0)].sqrt();
        assert!((first.values[0] - 0.4_f64.to_radians()).abs() < 4.0 * error, "{:?} {error}", first.values);
        assert!(error > first.score.covariance[(0, 0)].sqrt(), "{error}");
    }

    #[test]
    fn either_side_is_a_step_of_the_logarithm_away() {
        let lab = dated(30, |time| 0.4 * (1.0 - (-time / 800.0).exp()));
        let none = crate::candidates::Candidates { listed: Vec::new(), unlisted: Vec::new() };
        let watch = Progress::unwatched();
        let stage = lab.stage(Vec::new(), None, &none, &watch).unwrap();
        let id = effect::parse("warm_up(elbow, zero)", lab.model()).unwrap();
        let id = with_inner(&id, 800.0);
        let (low, high) = lab.either_side(&stage, &id, (&[0.005], 0.5), &watch).unwrap();
        let there = |inner: f64| lab.tried(&stage, &with_inner(&id, inner), vec![0.005], &watch).unwrap();
        let (below, above) = (there(800.0 * (-0.5_f64).exp()), there(800.0 * 0.5_f64.exp()));
        assert!((low.squares / below.squares - 1.0).abs() < 1e-9);
        assert!((high.squares / above.squares - 1.0).abs() < 1e-9);
        let middle = there(800.0);
        assert!(middle.squares < 0.9 * low.squares && middle.squares < 0.9 * high.squares);
        assert!((middle.values[0] - 0.4_f64.to_radians()).abs() < 4.0 * middle.covariance[(0, 0)].sqrt());
        // Two zeros, and the size.
        assert_eq!((middle.numbers, middle.values.len(), middle.covariance.shape()), (3.0, 1, (1, 1)));
    }

    #[test]
    fn what_is_searched_for_goes_to_where_least_is_left_with_all_that_follows_from_it() {
        let lab = dated(60, |time| 0.4 * (1.0 - (-time / 2000.0).exp()));
        let none = crate::candidates::Candidates { listed: Vec::new(), unlisted: Vec::new() };
        let watch = Progress::unwatched();
        let mut stage = lab.stage(Vec::new(), None, &none, &watch).unwrap();
        let id = effect::parse("warm_up(elbow, zero)", lab.model()).unwrap();
        let searched = |inner: f64| crate::forward_selection::FittedCandidate {
            id: with_inner(&id, inner),
            values: vec![0.005],
            search_cost: 3.0,
            ..crate::testing::fitted_candidate("warm_up", 1, 77.0)
        };
        // What cannot be a time constant is left as it is.
        for inner in [0.0, -5.0] {
            stage.fitted_candidates = vec![searched(inner)];
            lab.settle(&mut stage, &watch).unwrap();
            assert_eq!(
                (stage.fitted_candidates[0].id.inner, stage.fitted_candidates[0].bic),
                (Some(inner), 77.0)
            );
        }
        stage.fitted_candidates = vec![searched(1500.0)];
        lab.settle(&mut stage, &watch).unwrap();
        let found = stage.fitted_candidates.remove(0);
        let inner = found.id.inner.unwrap();
        let there =
            |step: f64| lab.tried(&stage, &with_inner(&id, inner * step.exp()), vec![0.005], &watch).unwrap();
        let [low, middle, high] = [-0.1, 0.0, 0.1].map(there);
        let least = to_the_bottom([low.squares, middle.squares, high.squares], 0.1);
        assert!(least.abs() < 0.01 && (inner / 2000.0).ln().abs() < 0.1, "{inner} {least}");
        assert!((found.values[0] - middle.values[0]).abs() < 1e-9);
        // Schwarz's criterion of three numbers, with what the search costs.
        let readings = stage.fitted.fit.normal.equations as f64;
        let expected = bic_above(stage.fitted.problem.least_variance(), middle.squares, readings, 3.0, 3.0);
        assert!((found.bic - expected).abs() < 1e-6, "{} {expected}", found.bic);
        // By how much the size moves with the logarithm, times how well that is known on what four numbers leave.
        let moves = (high.values[0] - low.values[0]) / 0.2;
        let bend = (low.squares + high.squares - 2.0 * middle.squares) / 0.01;
        let variance =
            middle.covariance[(0, 0)] + moves * moves * 2.0 * middle.squares / (readings - 4.0) / bend;
        assert!((found.covariance[(0, 0)] / variance - 1.0).abs() < 1e-6, "{} {variance}", found.covariance);
        assert!(variance > 1.05 * middle.covariance[(0, 0)]);
    }
}
