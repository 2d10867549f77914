//! What may be claimed of a batch's picks that have a name of their own: the mechanism, a correction in place of one of several, or nothing.

use super::left_out::LeftOutPredictions;
use super::pool::{Pick, Pool};
use crate::cross_validation::pose_groups;
use crate::fitted::Fitted;
use crate::found::NOT_LISTED;
use crate::laboratory::{Laboratory, LaboratoryError};
use crate::lack_of_fit::LackOfFit;
use crate::noise_floor::Floor;
use crate::predictive_gain::Gain;
use crate::thresholds::{BATCH_JUDGED_ROWS, GAIN_ERRORS, HIGH_ORDER, OVERWHELMING_GAIN, RIVALS};
use plumb_calibration::arm_model::Correction;
use plumb_calibration::effect::{Effect, EffectId};
use plumb_estimation::Progress;

/// A pick that predicts rows it has not seen, but is one of several mechanisms that may be at work.
#[derive(Debug, Clone)]
pub(super) struct InPlaceOf {
    pub(super) probe: usize,
    /// As the model keeps it, with what it may be.
    pub(super) correction: Correction,
}

/// Picks that may not be claimed as mechanisms.
#[derive(Debug, Default)]
pub(super) struct Judged {
    /// Rows left out are not predicted better with them in, or the others swallow them.
    pub(super) doubtful: Vec<usize>,
    /// Rows left out are, but another candidate would do as well beside the other picks, or more than noise is left and the gain does not overwhelm that.
    pub(super) in_place: Vec<InPlaceOf>,
}

fn is_of_low_order(id: &EffectId) -> bool {
    id.order.is_some_and(|order| order <= HIGH_ORDER)
}

impl Laboratory {
    /// The waves of low order that are no mechanisms. Together with the geometry they imitate whatever changes slowly over the joint's range: several at one joint are a Fourier
    /// series of it, and one alone has to meet what a name has to. They stay, whatever they stand for: what their joint's waves have in common keeps them from harm.
    pub(super) fn imitating(
        &self,
        pool: &Pool,
        picks: &[Pick],
        (fitted, floor): (&Fitted<'_>, &Floor),
        progress: &Progress,
    ) -> Result<Vec<InPlaceOf>, LaboratoryError> {
        let probes = picks.iter().map(|pick| pick.probe);
        let low: Vec<usize> = probes.filter(|probe| is_of_low_order(&pool.probes[*probe].id)).collect();
        let (alone, series): (Vec<usize>, Vec<usize>) = low.iter().partition(|probe| {
            let joint = pool.probes[**probe].id.joint();
            low.iter().filter(|other| pool.probes[**other].id.joint() == joint).count() == 1
        });
        let asked = |probe: usize| alone.contains(&probe);
        let Judged { doubtful, mut in_place } = self.judged(pool, picks, asked, (fitted, floor), progress)?;
        in_place.extend(doubtful.into_iter().chain(series).map(|probe| self.in_place(pool, probe, &[])));
        Ok(in_place)
    }

    /// What may be claimed of some of the picks. Waves of high order are judged as a family, and elsewhere.
    pub(super) fn judged(
        &self,
        pool: &Pool,
        picks: &[Pick],
        is_asked: impl Fn(usize) -> bool,
        (fitted, floor): (&Fitted<'_>, &Floor),
        progress: &Progress,
    ) -> Result<Judged, LaboratoryError> {
        let named: Vec<(usize, &Pick)> =
            picks.iter().enumerate().filter(|(_, pick)| is_asked(pick.probe)).collect();
        let mut judged = Judged::default();
        if named.is_empty() {
            return Ok(judged);
        }
        // A doubt needs no more rows than this, and the derivatives by every number that is fitted are kept for each.
        let thin = self.thinned(BATCH_JUDGED_ROWS);
        let precisions = pool.precisions(picks);
        let laboratory = thin.as_ref().unwrap_or(self).knowing(pool.priors(picks, &precisions));
        let rows = laboratory.measured_rows();
        let (more, moved) = pool.effects(picks, &precisions);
        let (problem, state) = laboratory.expected(&more, fitted, &moved)?;
        let joints = named.iter().filter_map(|(_, pick)| pool.probes[pick.probe].id.joint()).collect();
        let predictions =
            LeftOutPredictions::of(&problem, &state, (&rows, &fitted.fit.weights), &joints, progress)?;
        // Where more than noise is left whatever is taken in, a name takes overwhelming evidence.
        let unfinished = LackOfFit::beside(predictions.noise(), floor)
            .is_none_or(|lack_of_fit| lack_of_fit.is_significant());
        let asked = if unfinished { OVERWHELMING_GAIN } else { GAIN_ERRORS };
        for (index, pick) in named {
            progress.check()?;
            // The picks are the last of the problem's parts, in their order.
            let gains = predictions.gains(problem.parts.len() - picks.len() + index);
            // A gain must show in every way of leaving out: by region, by range of its joint, by session.
            let exceeds = |errors: f64| gains.iter().all(|gain| gain.total > errors * gain.error);
            match pool.rivals(picks, index).filter(|_| exceeds(GAIN_ERRORS)) {
                None => judged.doubtful.push(pick.probe),
                Some(rivals) if rivals.is_empty() && exceeds(asked) => {}
                Some(rivals) => judged.in_place.push(self.in_place(pool, pick.probe, &rivals)),
            }
        }
        Ok(judged)
    }

    /// A pick as a correction: itself, the rivals that do most, and what is not listed.
    fn in_place(&self, pool: &Pool, probe: usize, rivals: &[usize]) -> InPlaceOf {
        let id = pool.probes[probe].id.clone();
        let others = rivals.iter().take(RIVALS).map(|rival| &pool.probes[*rival].id);
        let mut may_be: Vec<String> =
            std::iter::once(&id).chain(others).map(|id| self.model().label(id)).collect();
        may_be.push(NOT_LISTED.to_owned());
        InPlaceOf { probe, correction: Correction { id, may_be } }
    }

    /// Whether the held-out rows are predicted better with some of the picks than without them, by more than one standard error over poses; never where none are
    /// held out.
    pub(super) fn bear_out(
        &self,
        pool: &Pool,
        picks: &[Pick],
        corrections: &[InPlaceOf],
        fitted: &Fitted<'_>,
    ) -> bool {
        let (problem, fit) = (&fitted.problem, &fitted.fit);
        let held = self.split().check_rows();
        let probes: Vec<&dyn Effect> =
            picks.iter().map(|pick| pool.probes[pick.probe].effect.as_ref()).collect();
        let with = pool.columns(picks);
        let mut without = picks.to_vec();
        without.retain(|pick| corrections.iter().all(|one| one.probe != pick.probe));
        let without = pool.columns(&without);
        // A block has the picks' columns one after another, as `with` has them.
        let indices: Vec<usize> =
            without.iter().filter_map(|column| with.iter().position(|other| other == column)).collect();
        let precisions = pool.precisions(picks);
        let kept: Vec<f64> = indices.iter().map(|index| precisions[*index]).collect();
        let with_values = pool.values(&with, &precisions);
        let without_values = pool.values(&without, &kept);
        let reductions = pose_groups(problem.table, &held).into_iter().map(|rows| {
            let block = problem.block(&fit.state, &rows, &vec![1.0; problem.table.len()], &probes);
            let residuals = nalgebra::DVector::from_vec(block.residuals);
            let before = &residuals - block.jacobian.select_rows(&indices).tr_mul(&without_values);
            let after = &residuals - block.jacobian.tr_mul(&with_values);
            before.norm_squared() - after.norm_squared()
        });
        Gain::over(&reductions.collect::<Vec<f64>>()).is_some_and(|gain| gain.counts())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::laboratory::Options;
    use crate::split::Holdout;
    use crate::testing::two_links;
    use plumb_calibration::effect::Site;

    /// An arm whose elbow has a gain that is wrong, three rows in ten of which are locked away, and the pick of each joint's gain.
    fn with_picks(look: impl FnOnce(&Laboratory, &Pool, &Fitted<'_>, [Pick; 2])) {
        let lab = two_links(90, "joint_zero(*)", 0.05, 45, |q| [0.0, 0.01 * q[1]]);
        let holdout = Holdout::Random { fraction: 0.3, seed: 4 };
        let options = Options { holdout, ..lab.options().clone() };
        let lab = Laboratory::new(lab.model().clone(), lab.table().clone(), options).unwrap();
        let fitted = lab.fit_with(&[], None, &Progress::unwatched()).unwrap();
        let pool = Pool::gather(&lab, &fitted, &Progress::unwatched()).unwrap();
        let picks = [0, 1].map(|joint| {
            let gain = EffectId::at("joint_gain", Site::Joint(joint));
            Pick { probe: pool.probes.iter().position(|probe| probe.id == gain).unwrap() }
        });
        look(&lab, &pool, &fitted, picks);
    }

    #[test]
    fn held_out_rows_bear_out_a_correction_that_predicts_them_and_no_other() {
        with_picks(|lab, pool, fitted, [shoulder, elbow]| {
            let (picks, [of_shoulder, of_elbow]) =
                ([shoulder, elbow], [shoulder, elbow].map(|pick| lab.in_place(pool, pick.probe, &[])));
            assert!(lab.bear_out(pool, &picks, std::slice::from_ref(&of_elbow), fitted));
            assert!(!lab.bear_out(pool, &picks, std::slice::from_ref(&of_shoulder), fitted), "it is nothing");
            assert!(!lab.bear_out(pool, &picks, &[], fitted), "without a correction nothing changes");
            let open = Options { holdout: Holdout::None, ..lab.options().clone() };
            let open = Laboratory::new(lab.model().clone(), lab.table().clone(), open).unwrap();
            assert!(!open.bear_out(pool, &picks, &[of_elbow], fitted), "nothing is held out");
        });
    }

    #[test]
    fn a_correction_says_what_it_may_be_the_likeliest_rivals_first_and_what_is_not_listed() {
        with_picks(|lab, pool, _, [shoulder, elbow]| {
            let many: Vec<usize> = (0..pool.probes.len()).filter(|probe| *probe != elbow.probe).collect();
            let found = lab.in_place(pool, elbow.probe, &[shoulder.probe]);
            assert_eq!(found.probe, elbow.probe);
            assert_eq!(found.correction.id, pool.probes[elbow.probe].id);
            assert_eq!(found.correction.may_be, ["joint_gain(elbow)", "joint_gain(shoulder)", NOT_LISTED]);
            assert_eq!(lab.in_place(pool, elbow.probe, &many).correction.may_be.len(), RIVALS + 2);
        });
    }

    /// Of one gain that is there, beside a floor of so many mm: how many are doubtful, and how many corrections. Beside it are the first so many waves of its joint.
    fn of_gain(floor_mm: f64, waves: usize) -> (usize, usize) {
        let mut judged = (0, 0);
        with_picks(|lab, pool, fitted, [_, elbow]| {
            let floor = Floor {
                sigma_mm: Some(floor_mm),
                dof: 90,
                scale: Some(floor_mm),
                ..Floor::among(&fitted.problem, None)
            };
            let beside = (0..pool.probes.len()).filter(|probe| {
                let id = &pool.probes[*probe].id;
                id.order.is_some() && id.joint() == Some(1)
            });
            let picks: Vec<Pick> =
                std::iter::once(elbow.probe).chain(beside.take(waves)).map(|probe| Pick { probe }).collect();
            let found = lab
                .judged(
                    pool,
                    &picks,
                    |probe| pool.has_own_name(probe),
                    (fitted, &floor),
                    &Progress::unwatched(),
                )
                .unwrap();
            judged = (found.doubtful.len(), found.in_place.len());
        });
        judged
    }

    #[test]
    fn a_gain_is_a_mechanism_at_the_floor_and_a_correction_while_more_than_noise_is_left() {
        assert_eq!(of_gain(0.05, 0), (0, 0));
        // It predicts rows left out by some ten of its standard errors, not by twenty.
        assert_eq!(of_gain(0.001, 0), (0, 1));
        assert_eq!(of_gain(0.001, 8), (1, 0), "waves beside it swallow what it does");
    }
}
