//! Forward selection: which effects, jointly, the data ask for. Each stage fits the model with what was taken in, scores every
//! other candidate, refits the best for real, and takes in the first that passes.

use nalgebra::DMatrix;

use crate::block_errors;
use crate::candidates::{Candidates, best_variants};
use crate::cross_validation::Derivatives;
use crate::fitted::Fitted;
use crate::laboratory::{Laboratory, LaboratoryError};
use crate::lack_of_fit::LackOfFit;
use crate::noise_floor::Floor;
use crate::predictive_gain::{Gain, Judge, Promise};
use crate::score_test::{Noise, Probe, Score, score};
use crate::thresholds::{
    MOST_EFFECTS, MOST_EXCHANGES, NAMING_LEVEL, OUTLIER_JUDGE_LEVEL, OUTLIER_JUDGES, REFIT_BELOW,
    REFITTED_CANDIDATES,
};
use plumb_calibration::arm_model::AddedEffect;
use plumb_calibration::effect::{EffectId, kind};
use plumb_calibration::fit::FitOptions;
use plumb_estimation::{Progress, bic_above, f_tail, for_each, holm};

/// A candidate with everything known of it at one stage.
pub(crate) struct FittedCandidate {
    pub(crate) id: EffectId,
    pub(crate) score: Score,
    pub(crate) holm_p: f64,
    /// Information criterion: of the refit if there is one, else as the score promises.
    pub(crate) bic: f64,
    pub(crate) search_cost: f64,
    /// Values after the refit, or as the score expects them.
    pub(crate) values: Vec<f64>,
    /// Covariance of the values.
    pub(crate) covariance: DMatrix<f64>,
    /// Standard errors of the values as blocks of rows have them (`block_errors.rs`); empty until it is refitted.
    pub(crate) block_errors: Vec<f64>,
    /// Cross-validated gains; empty if it was not refitted.
    pub(crate) gains: Vec<Gain>,
    /// What adding it alone promises; nothing if it was not refitted.
    pub(crate) promise: Option<Promise>,
    pub(crate) refitted: bool,
    /// Stands only on the rows that were chosen, not with all of them in.
    pub(crate) outvoted: bool,
    /// Sum of squares it leaves, declared sigmas squared, and their degrees of freedom.
    pub(crate) left: (f64, f64),
    /// Of an event that was refitted: residuals of the fitted rows, in sigmas, rows by their equations.
    pub(crate) row_residuals: Vec<Vec<f64>>,
}

impl FittedCandidate {
    /// Whether chance would hardly do as much, and a real machine could have such values.
    pub(crate) fn is_plausible(&self) -> bool {
        self.score.plausible && self.holm_p < NAMING_LEVEL
    }

    /// Whether it passes everything a name needs but being alone.
    pub(crate) fn passes(&self) -> bool {
        self.is_plausible()
            && self.refitted
            && !self.outvoted
            && !self.gains.is_empty()
            && self.gains.iter().all(Gain::counts)
    }
}

impl Stage<'_> {
    /// Equations that were fitted.
    pub(crate) fn equations(&self) -> f64 {
        self.fitted.fit.normal.equations as f64
    }
}

/// One stage: a model with some effects taken in, and what every other candidate would add.
pub(crate) struct Stage<'a> {
    pub(crate) taken: Vec<AddedEffect>,
    pub(crate) fitted: Fitted<'a>,
    /// Information criterion of the stage itself.
    pub(crate) bic: f64,
    /// The likeliest first.
    pub(crate) fitted_candidates: Vec<FittedCandidate>,
}

/// How often a joint may have jumped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Jumps {
    /// Once. Beside other structure that nothing explains two jumps do what an outlying stretch of rows asks for.
    Once,
    /// Perhaps at another moment than the known one as well: asked where a jump is the question.
    AtOtherMoments,
}

impl Laboratory {
    /// Fits the model with `taken` in and weighs every other candidate against the rest; the likeliest are refitted.
    pub(crate) fn stage<'a>(
        &'a self,
        taken: Vec<AddedEffect>,
        near: Option<&Fitted<'_>>,
        candidates: &Candidates,
        progress: &Progress,
    ) -> Result<Stage<'a>, LaboratoryError> {
        self.stage_asking(candidates, Jumps::Once, taken, near, progress)
    }

    /// The same; of a joint that jumped also other moments are asked where `jumps` says so.
    pub(crate) fn stage_asking<'a>(
        &'a self,
        candidates: &Candidates,
        jumps: Jumps,
        taken: Vec<AddedEffect>,
        near: Option<&Fitted<'_>>,
        progress: &Progress,
    ) -> Result<Stage<'a>, LaboratoryError> {
        let (mut stage, robust) = self.scored_stage(candidates, jumps, taken, near, progress)?;
        self.refit_handful(&mut stage, progress)?;
        self.ask_all_rows(&mut stage, &robust, progress)?;
        self.refine(&mut stage, progress)?;
        Ok(stage)
    }

    /// The same as the scores have it, and the robust fit to all rows.
    fn scored_stage<'a>(
        &'a self,
        candidates: &Candidates,
        jumps: Jumps,
        taken: Vec<AddedEffect>,
        near: Option<&Fitted<'_>>,
        progress: &Progress,
    ) -> Result<(Stage<'a>, Fitted<'a>), LaboratoryError> {
        let probes = &candidates.listed;
        let robust = self.fit_with(&taken, near, progress)?;
        // Plain least squares on rows that are kept: weights that change with the effects would make sums of squares incomparable.
        let kept = self.inlying_rows(&robust, &taken, (candidates, jumps), progress)?;
        let ones = vec![1.0; self.table().len()];
        let plain = FitOptions { robust: false, ..self.options().fit };
        let fitted = self.fit_near(&taken, &robust, (&kept, &ones), plain, progress)?;
        let open = self.open_variants(&fitted, &taken, probes, jumps);
        let p_values: Vec<f64> = open.iter().map(|(_, score)| score.p).collect();
        let weights: Vec<f64> = open.iter().map(|(index, _)| probes[*index].weight).collect();
        let adjusted = holm(&p_values, &weights);
        let equations = fitted.fit.normal.equations as f64;
        let rank = fitted.fit.rank() as f64;
        let squares = fitted.fit.normal.squares;
        let least = fitted.problem.least_variance();
        let own = bic_above(least, squares, equations, rank, 0.0);
        let mut fitted_candidates: Vec<FittedCandidate> = open
            .into_iter()
            .zip(adjusted)
            .filter(|((_, score), _)| score.freedom > 0)
            .map(|((index, score), holm_p)| {
                let probe = &probes[index];
                // Before a refit the score's promise represents it: exact in a linear model.
                let promised = (squares - score.gain).max(squares * 1e-9);
                let search_cost = probe.search_cost + probe.search.cost(equations);
                FittedCandidate {
                    id: probe.id.clone(),
                    holm_p,
                    bic: bic_above(least, promised, equations, rank + score.freedom as f64, search_cost),
                    search_cost,
                    values: score.values.clone(),
                    covariance: score.covariance.clone(),
                    block_errors: Vec::new(),
                    gains: Vec::new(),
                    promise: None,
                    refitted: false,
                    outvoted: false,
                    left: score.left,
                    row_residuals: Vec::new(),
                    score,
                }
            })
            .collect();
        fitted_candidates.sort_by(|left, right| left.bic.total_cmp(&right.bic));
        Ok((Stage { taken, fitted, bic: own, fitted_candidates }, robust))
    }

    /// The best variant of every family that is not in already, by its score beside what is fitted.
    fn open_variants(
        &self,
        fitted: &Fitted<'_>,
        taken: &[AddedEffect],
        probes: &[Probe],
        jumps: Jumps,
    ) -> Vec<(usize, Score)> {
        let mut scores = score(&fitted.problem, &fitted.fit, probes);
        let is_in = self.which_are_in(taken, jumps, probes.iter().map(|probe| &probe.id));
        for (score, _) in scores.iter_mut().zip(&is_in).filter(|(_, is_in)| **is_in) {
            // No better than any other variant of its family.
            score.gain = f64::NEG_INFINITY;
        }
        let mut open = best_variants(probes, scores);
        open.retain(|(index, _)| is_in.get(*index) == Some(&false));
        open
    }

    /// Rows that are not outliers even when the effect that explains most is in, whether it has a name or not: outliers are
    /// judged jointly with what may explain them, never before.
    fn inlying_rows(
        &self,
        robust: &Fitted<'_>,
        taken: &[AddedEffect],
        (candidates, jumps): (&Candidates, Jumps),
        progress: &Progress,
    ) -> Result<Vec<usize>, LaboratoryError> {
        let mut asked: Vec<(&Probe, Score)> = Vec::new();
        for probes in [&candidates.listed, &candidates.unlisted] {
            let scores = self.open_variants(robust, taken, probes, jumps);
            let scores = scores.into_iter().filter_map(|(index, score)| Some((probes.get(index)?, score)));
            let mut best: Vec<(&Probe, Score)> = scores.collect();
            best.retain(|(_, score)| score.p < OUTLIER_JUDGE_LEVEL);
            best.sort_by(|left, right| left.1.p.total_cmp(&right.1.p));
            asked.extend(best.into_iter().take(OUTLIER_JUDGES));
        }
        let fits: Vec<Fitted<'_>> =
            for_each(&asked, |(probe, score)| self.fit_probe(taken, (probe, score), robust, progress))
                .into_iter()
                .collect::<Result<_, _>>()?;
        let scale = fits.iter().map(|fit| fit.fit.scale).fold(robust.fit.scale, f64::min).max(1e-300);
        let equations = robust.fit.normal.equations as f64;
        let least = robust.problem.least_variance();
        // With the least scatter for all: each by its own would make a fit look good that calls everything an outlier.
        let freedoms = std::iter::once(0).chain(asked.iter().map(|(_, score)| score.freedom));
        let all = std::iter::once(robust).chain(&fits).zip(freedoms).map(|(fit, freedom)| {
            let numbers = robust.parameters_with(freedom);
            (bic_above(least, fit.loss(scale), equations, numbers, 0.0), fit)
        });
        // Of equals the first, without anything added.
        let best = all.min_by(|left, right| left.0.total_cmp(&right.0));
        Ok(best.map_or_else(|| robust.inliers(), |(_, fit)| fit.inliers()))
    }

    /// Sends fitted candidates away whose evidence lies in the choice of outliers: with every row in and none judged, each pulling
    /// no harder than one at the edge of the scatter, they must stand as well.
    fn ask_all_rows(
        &self,
        stage: &mut Stage<'_>,
        robust: &Fitted<'_>,
        progress: &Progress,
    ) -> Result<(), LaboratoryError> {
        if stage.fitted.fit.rows.len() == robust.fit.rows.len() {
            return Ok(());
        }
        let asked: Vec<usize> = (0..stage.fitted_candidates.len())
            .filter(|index| stage.fitted_candidates.get(*index).is_some_and(FittedCandidate::passes))
            .take(OUTLIER_JUDGES)
            .collect();
        let fits = for_each(&asked, |index| {
            let fitted_candidate = stage.fitted_candidates.get(*index);
            let added =
                fitted_candidate.map(|one| AddedEffect { id: one.id.clone(), values: one.values.clone() });
            let more: Vec<AddedEffect> = stage.taken.iter().cloned().chain(added).collect();
            self.fit_to_compare(&more, robust, &[], self.options().fit, progress)
        });
        for (index, with) in asked.into_iter().zip(fits) {
            let (with, Some(fitted_candidate)) = (with?, stage.fitted_candidates.get_mut(index)) else {
                continue;
            };
            let noise = Noise::of(&with.problem, &with.fit);
            // Both by the scale of the fit with it in: the smaller of the two, which is the harder one to pass.
            let gain = (robust.loss(with.fit.scale) - with.loss(with.fit.scale)).max(0.0);
            fitted_candidate.outvoted = is_outvoted(fitted_candidate, gain, noise);
        }
        Ok(())
    }

    /// Refits the best fitted candidates for real, on the stage's rows.
    fn refit_handful(&self, stage: &mut Stage<'_>, progress: &Progress) -> Result<(), LaboratoryError> {
        let best = stage.fitted_candidates.iter().take(REFITTED_CANDIDATES);
        let count = best.filter(|fitted_candidate| fitted_candidate.holm_p < REFIT_BELOW).count();
        let equations = stage.fitted.fit.normal.equations as f64;
        let options = FitOptions { robust: false, ..self.options().fit };
        let Some(asked) = stage.fitted_candidates.get(..count).filter(|asked| !asked.is_empty()) else {
            return Ok(());
        };
        // What is asked of the fit without an effect is the same for all: worked out once.
        let judge = Judge::of(
            &stage.fitted,
            self.options().holdout,
            asked.iter().map(|fitted_candidate| &fitted_candidate.id),
        );
        let refits = for_each(asked, |fitted_candidate| {
            let mut more = stage.taken.clone();
            more.push(AddedEffect {
                id: fitted_candidate.id.clone(),
                values: fitted_candidate.values.clone(),
            });
            let refit =
                self.fit_to_compare(&more, &stage.fitted, &fitted_candidate.score.beside, options, progress)?;
            let derivatives = Derivatives::of(&refit.problem, &refit.fit);
            let gains = judge.gains(&refit.fit, &derivatives, &fitted_candidate.id);
            let errors = block_errors::errors_from(&derivatives, refit.problem.table, &refit.fit);
            Ok::<_, LaboratoryError>((refit, gains, errors))
        });
        for (fitted_candidate, refit) in stage.fitted_candidates.iter_mut().zip(refits) {
            let (refit, gains, errors) = refit?;
            let (squares, rank) = (
                refit.fit.normal.squares,
                stage.fitted.parameters_in(&refit, &fitted_candidate.id, fitted_candidate.score.freedom),
            );
            fitted_candidate.bic = bic_above(
                refit.problem.least_variance(),
                squares,
                equations,
                rank,
                fitted_candidate.search_cost,
            );
            (fitted_candidate.gains, fitted_candidate.promise) = gains;
            fitted_candidate.refitted = true;
            // Events are compared row by row (Vuong 1989, see `epochs/rivals.rs`).
            if kind(&fitted_candidate.id.name).is_some_and(|kind| kind.is_event) {
                fitted_candidate.row_residuals = refit.row_residuals();
            }
            fitted_candidate.left = (squares, f64::max(equations - rank, 1.0));
            if let Some(values) = refit.fit.state.effects.last() {
                fitted_candidate.values.clone_from(values);
                let free_parameters = refit.problem.free_parameters().len();
                let own = free_parameters - values.len()..free_parameters;
                let indices: Vec<usize> = own.clone().collect();
                fitted_candidate.covariance =
                    refit.fit.covariance.select_rows(&indices).select_columns(&indices);
                fitted_candidate.block_errors = errors.get(own).unwrap_or_default().to_vec();
            }
        }
        stage.fitted_candidates.sort_by(|left, right| left.bic.total_cmp(&right.bic));
        Ok(())
    }

    /// A card promises what `add` does, and that adds one effect alone: of a stage with others taken in, each fitted candidate is fitted beside the `base`.
    pub(crate) fn promise_alone(
        &self,
        stage: &mut Stage<'_>,
        base: &Stage<'_>,
        progress: &Progress,
    ) -> Result<(), LaboratoryError> {
        let asked: Vec<usize> = (0..stage.fitted_candidates.len())
            .filter(|index| stage.fitted_candidates.get(*index).is_some_and(|one| one.refitted))
            .collect();
        let judge = Judge::of(&base.fitted, self.options().holdout, std::iter::empty());
        let rows = (base.fitted.fit.rows.as_slice(), base.fitted.fit.weights.as_slice());
        let options = FitOptions { robust: false, ..self.options().fit };
        let promises = for_each(&asked, |index| {
            let Some(own) = stage.fitted_candidates.get(*index) else { return Ok(None) };
            let alone = [AddedEffect { id: own.id.clone(), values: own.values.clone() }];
            let after = self.fit_near(&alone, &base.fitted, rows, options, progress)?;
            Ok::<_, LaboratoryError>(judge.promise(&after))
        });
        for (index, promise) in asked.into_iter().zip(promises) {
            if let Some(fitted_candidate) = stage.fitted_candidates.get_mut(index) {
                fitted_candidate.promise = promise?;
            }
        }
        Ok(())
    }

    /// Takes in one effect after another, as long as one passes; the stages, the first with none taken in. With as many in as may be, no fitted candidate is refitted any more.
    pub(crate) fn forward(
        &self,
        candidates: &Candidates,
        floor: &Floor,
        progress: &Progress,
    ) -> Result<Vec<Stage<'_>>, LaboratoryError> {
        let mut stages = vec![self.stage(Vec::new(), None, candidates, progress)?];
        for _ in 0..=MOST_EXCHANGES {
            self.take_in_passing(&mut stages, candidates, floor, progress)?;
            let Some(last) = stages.last().filter(|last| may_be_exchanged(last, floor)) else { break };
            let Some(set) = self.exchange(last, candidates, progress)? else { break };
            let next = self.next_stage(set, last, candidates, progress)?;
            stages.push(next);
        }
        Ok(stages)
    }

    /// Takes in one effect after another beside what the last stage has.
    fn take_in_passing<'a>(
        &'a self,
        stages: &mut Vec<Stage<'a>>,
        candidates: &Candidates,
        floor: &Floor,
        progress: &Progress,
    ) -> Result<(), LaboratoryError> {
        while let Some(last) = stages.last().filter(|last| last.taken.len() < MOST_EFFECTS) {
            progress.report(0.3 + 0.1 * last.taken.len() as f64, "searching")?;
            let left = LackOfFit::of(&last.fitted, floor);
            if is_shared_error(last.fitted.problem.neighbours_err_alike(), left) {
                break;
            }
            let Some(best) = last.fitted_candidates.iter().find(|fitted_candidate| fitted_candidate.passes())
            else {
                break;
            };
            let mut taken = last.taken.clone();
            taken.push(AddedEffect { id: best.id.clone(), values: best.values.clone() });
            let next = self.next_stage(taken, last, candidates, progress)?;
            stages.push(next);
        }
        Ok(())
    }

    /// The stage with these effects in, near another.
    fn next_stage<'a>(
        &'a self,
        taken: Vec<AddedEffect>,
        near: &Stage<'_>,
        candidates: &Candidates,
        progress: &Progress,
    ) -> Result<Stage<'a>, LaboratoryError> {
        match taken.len() < MOST_EFFECTS {
            true => self.stage(taken, Some(&near.fitted), candidates, progress),
            // Only what it leaves is asked of it.
            false => Ok(self.scored_stage(candidates, Jumps::Once, taken, Some(&near.fitted), progress)?.0),
        }
    }
}

/// Whether what is left may be what readings next to each other share: less than the noise, and not random, so that tests against chance find effects in it that are
/// not there. Nothing more is asked of it.
pub(crate) fn is_shared_error(neighbours_err_alike: bool, left: Option<LackOfFit>) -> bool {
    neighbours_err_alike && left.is_some_and(|left| !left.is_significant())
}

/// Whether a stage's effects may be exchanged: where more than noise is left with as many in as may be, or nobody knows the noise, no set explains the rows, and what is
/// there is asked beside a flexible part.
fn may_be_exchanged(stage: &Stage<'_>, floor: &Floor) -> bool {
    let explains = || LackOfFit::of(&stage.fitted, floor).is_some_and(|left| !left.is_significant());
    stage.taken.len() > 1 && (stage.taken.len() < MOST_EFFECTS || explains())
}

/// Whether chance would do as much as a fitted candidate's gain with every row in, squared sigmas, beside this noise.
fn is_outvoted(fitted_candidate: &FittedCandidate, gain: f64, noise: Noise) -> bool {
    let freedom = fitted_candidate.score.freedom.max(1) as f64;
    let p = f_tail(gain / freedom / noise.variance.max(1e-300), freedom, noise.freedom);
    // What the search and the number of candidates cost is the same as on the chosen rows.
    let charge =
        if fitted_candidate.score.p > 0.0 { fitted_candidate.holm_p / fitted_candidate.score.p } else { 1.0 };
    p * charge.max(1.0) >= NAMING_LEVEL
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::noise_floor::FloorSource;
    use crate::testing::fitted_candidate;
    use crate::thresholds::LACK_OF_FIT_LEVEL;

    #[test]
    fn of_readings_that_err_alike_nothing_is_asked_once_no_more_than_noise_is_left() {
        let left = |p: f64| Some(LackOfFit { ratio: 1.0, p });
        assert!(is_shared_error(true, left(1.01 * LACK_OF_FIT_LEVEL)));
        assert!(!is_shared_error(true, left(0.99 * LACK_OF_FIT_LEVEL)));
        assert!(!is_shared_error(true, None), "where nobody knows the noise it may be an effect");
        assert!(!is_shared_error(false, left(0.5)), "readings that scatter each for itself are asked on");
    }

    #[test]
    fn a_gain_with_every_row_in_is_an_f_test_charged_as_on_the_chosen_rows() {
        // P(F with 2 and 10 degrees > f) = (1 + f / 5)^-5.
        let at = |p: f64| 5.0 * (p.powf(-0.2) - 1.0);
        let noise = Noise { variance: 4.0, freedom: 10.0 };
        let outvoted = |p: f64, charge: f64| {
            let mut one = fitted_candidate("joint_harmonic", 1, 0.0);
            (one.score.freedom, one.score.p, one.holm_p) = (2, 1e-6, charge * 1e-6);
            is_outvoted(&one, 2.0 * 4.0 * at(p), noise)
        };
        assert!(!outvoted(0.99 * NAMING_LEVEL, 1.0) && outvoted(1.01 * NAMING_LEVEL, 1.0));
        // Chosen among fifty it must be fifty times as improbable.
        assert!(!outvoted(0.99 * NAMING_LEVEL / 50.0, 50.0) && outvoted(1.01 * NAMING_LEVEL / 50.0, 50.0));
        assert!(!outvoted(0.99 * NAMING_LEVEL, 0.1), "no charge makes it likelier");
    }

    #[test]
    fn candidates_that_chance_makes_less_than_every_other_time_are_refitted() {
        let lab = crate::testing::two_links(20, "joint_zero(*)", 0.05, 31, |q| [0.0, 0.01 * q[1]]);
        let none = Candidates { listed: Vec::new(), unlisted: Vec::new() };
        let watch = Progress::unwatched();
        let mut stage = lab.stage(Vec::new(), None, &none, &watch).unwrap();
        let with = |joint: usize, holm_p: f64| FittedCandidate {
            holm_p,
            refitted: false,
            values: vec![0.0],
            ..fitted_candidate("joint_gain", joint, 0.0)
        };
        stage.fitted_candidates = vec![with(1, 0.49), with(0, 0.51)];
        lab.refit_handful(&mut stage, &watch).unwrap();
        let of =
            |joint: usize| stage.fitted_candidates.iter().find(|one| one.id.joint() == Some(joint)).unwrap();
        assert!(of(1).refitted && !of(0).refitted);
        // Its gain is a hundredth; sixty readings less three numbers.
        assert!((of(1).values[0] - 0.01).abs() < 4.0 * of(1).covariance[(0, 0)].sqrt());
        assert_eq!((of(1).left.1, of(0).left.1), (57.0, 190.0));
        assert!(of(1).row_residuals.is_empty(), "only events are compared row by row");
    }

    #[test]
    fn numbers_that_are_let_go_beside_a_candidate_are_no_gain_of_it_with_every_row_in() {
        let lab = crate::testing::two_links(20, "joint_zero(*)", 0.05, 31, |_| [0.0; 2]);
        let none = Candidates { listed: Vec::new(), unlisted: Vec::new() };
        let watch = Progress::unwatched();
        let (mut stage, mut robust) = lab.scored_stage(&none, Jumps::Once, Vec::new(), None, &watch).unwrap();
        stage.fitted.fit.rows.pop();
        stage.fitted_candidates =
            vec![FittedCandidate { values: vec![0.0], ..fitted_candidate("joint_gain", 1, 0.0) }];
        // The shoulder's zero is off, and the robust fit held it: what it would explain is not the gain's.
        let (rows, ones) = (robust.fit.rows.clone(), vec![1.0; 20]);
        robust.fit.state.effects[0] = vec![0.01];
        let options = lab.options().fit;
        robust.fit =
            robust.problem.refit_holding(&robust.fit.state, (&rows, &ones), &[0], options, &watch).unwrap();
        let outvoted = |robust: &Fitted<'_>, stage: &mut Stage<'_>| {
            stage.fitted_candidates[0].outvoted = false;
            lab.ask_all_rows(stage, robust, &watch).unwrap();
            stage.fitted_candidates[0].outvoted
        };
        assert!(outvoted(&robust, &mut stage));
        robust.fit.held.clear();
        assert!(!outvoted(&robust, &mut stage), "the zero goes back beside it");
    }

    #[test]
    fn candidates_are_charged_for_the_numbers_of_the_stage_and_their_own() {
        let lab =
            crate::testing::two_links(40, "joint_zero(*),geometry(*)", 0.05, 31, |q| [0.0, 0.01 * q[1]]);
        let candidates = Candidates { listed: crate::candidates::probes(&lab), unlisted: Vec::new() };
        let stage = lab.stage(Vec::new(), None, &candidates, &Progress::unwatched()).unwrap();
        let mut refitted = 0;
        for one in stage.fitted_candidates.iter().filter(|one| one.refitted && one.id.inner.is_none()) {
            let numbers = (stage.fitted.fit.rank() + one.score.freedom) as f64;
            let expected = bic_above(0.0, one.left.0, stage.equations(), numbers, one.search_cost);
            assert!((one.bic - expected).abs() < 1e-9, "{:?}: {} {expected}", one.id, one.bic);
            assert_eq!(one.left.1, stage.equations() - numbers);
            refitted += 1;
        }
        assert!(refitted > 1, "{refitted}");
    }

    #[test]
    fn effects_are_exchanged_where_two_are_in_and_they_may_explain_the_rows() {
        let lab = crate::testing::two_links(40, "joint_zero(*)", 0.05, 31, |_| [0.0; 2]);
        let none = Candidates { listed: Vec::new(), unlisted: Vec::new() };
        let mut stage = lab.stage(Vec::new(), None, &none, &Progress::unwatched()).unwrap();
        let gain = AddedEffect { id: fitted_candidate("joint_gain", 1, 0.0).id, values: vec![0.0] };
        // Readings scatter by 0.05 mm, in a table that declares no noise: in millimetres.
        let floor = |scale: Option<f64>| {
            let source = FloorSource::Declared;
            Floor { sigma_mm: scale, source, dof: 0, scale, allowed_for: Vec::new() }
        };
        let mut with = |effects: usize, scale: Option<f64>| {
            stage.taken = vec![gain.clone(); effects];
            may_be_exchanged(&stage, &floor(scale))
        };
        let (noise, half) = (Some(0.05), Some(0.025));
        assert!(!with(1, noise) && with(2, noise) && with(MOST_EFFECTS, noise));
        // More than noise is left, or nobody knows.
        assert!(with(MOST_EFFECTS - 1, half) && !with(MOST_EFFECTS, half));
        assert!(with(MOST_EFFECTS - 1, None) && !with(MOST_EFFECTS, None));
    }
}
