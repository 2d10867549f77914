//! Which of the effects that were taken in is missed most: it is the one in question.
//!
//! Several events of one moment are explanations of one jump. A fit takes them all where none of them is quite right, and one of them beside the others would be
//! named for a remainder. They are left out together, so that each is weighed alone against the others.

use super::close_fitted_candidates;
use crate::candidates::Candidates;
use crate::forward_selection::{FittedCandidate, Jumps, Stage};
use crate::laboratory::{Laboratory, LaboratoryError};
use plumb_calibration::arm_model::AddedEffect;
use plumb_calibration::fit::FitOptions;
use plumb_estimation::{Progress, bic_above, for_each};

impl Laboratory {
    /// Of the effects a stage has taken in, the one it would miss most and that still passes with the others in: the stage
    /// without it.
    pub(super) fn most_needed<'a>(
        &'a self,
        full: &Stage<'_>,
        candidates: &Candidates,
        progress: &Progress,
    ) -> Result<Option<Stage<'a>>, LaboratoryError> {
        for group in self.by_need(full, candidates, progress)? {
            let rest = without(full, &group);
            let near = Some(&full.fitted);
            let without = self.stage_asking(candidates, Jumps::AtOtherMoments, rest, near, progress)?;
            let passes = close_fitted_candidates(&without.fitted_candidates, without.equations())
                .first()
                .and_then(|first| without.fitted_candidates.get(*first))
                .is_some_and(FittedCandidate::passes);
            if passes {
                return Ok(Some(without));
            }
        }
        Ok(None)
    }

    /// The effects a stage has taken in, by their indices in it, the one it would miss most first, with those that explain the same jump: by how much the criterion
    /// worsens without them, everything else fitted anew to the same rows.
    fn by_need(
        &self,
        full: &Stage<'_>,
        candidates: &Candidates,
        progress: &Progress,
    ) -> Result<Vec<Vec<usize>>, LaboratoryError> {
        let (fit, least) = (&full.fitted.fit, full.fitted.problem.least_variance());
        let options = FitOptions { robust: false, ..self.options().fit };
        let groups = self.by_jump(&full.taken);
        let criteria = for_each(&groups, |group| {
            let rows = (fit.rows.as_slice(), fit.weights.as_slice());
            let rest = self.fit_near(&without(full, group), &full.fitted, rows, options, progress)?;
            let leave = || group.iter().filter_map(|index| full.taken.get(*index));
            let numbers: usize = leave().map(|one| one.values.len()).sum();
            let saved: f64 = leave().map(|one| candidates.search_cost(&one.id, full.equations())).sum();
            let squares = rest.fit.normal.squares;
            let left = fit.rank().saturating_sub(numbers) as f64;
            Ok::<_, LaboratoryError>(bic_above(least, squares, full.equations(), left, -saved))
        });
        let criteria = criteria.into_iter().collect::<Result<Vec<f64>, _>>()?;
        let mut by_need: Vec<(Vec<usize>, f64)> = groups.into_iter().zip(criteria).collect();
        by_need.sort_by(|left, right| right.1.total_cmp(&left.1));
        Ok(by_need.into_iter().map(|(group, _)| group).collect())
    }

    /// Effects by their indices, each alone but for those that explain the same jump.
    fn by_jump(&self, taken: &[AddedEffect]) -> Vec<Vec<usize>> {
        let mut groups: Vec<Vec<usize>> = Vec::new();
        for (index, one) in taken.iter().enumerate() {
            let same_jump = groups.iter_mut().find(|group| {
                let mut members = group.iter().filter_map(|member| taken.get(*member));
                members.any(|member| self.explain_one_jump(&one.id, &member.id))
            });
            match same_jump {
                Some(group) => group.push(index),
                None => groups.push(vec![index]),
            }
        }
        groups
    }
}

/// The effects that a stage has taken in, but for some.
fn without(full: &Stage<'_>, group: &[usize]) -> Vec<AddedEffect> {
    let others = full.taken.iter().enumerate().filter(|(other, _)| !group.contains(other));
    others.map(|(_, one)| one.clone()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use plumb_calibration::effect::{self, EffectId};

    /// The small arm, whose elbow has a gain of a hundredth and whose shoulder a wave of a milliradian: the gain moves the point farther.
    fn arm() -> (Laboratory, Candidates) {
        let both = |q: [f64; 2]| [0.001 * (7.0 * q[0]).sin(), 0.01 * q[1]];
        let lab = crate::testing::two_links(60, "joint_zero(*)", 0.02, 45, both);
        let candidates = Candidates { listed: crate::candidates::probes(&lab), unlisted: Vec::new() };
        (lab, candidates)
    }

    const WAVE: &str = "joint_harmonic(shoulder, 7)";
    const GAIN: &str = "joint_gain(elbow)";

    /// The stage with these effects in.
    fn with<'a>(lab: &'a Laboratory, candidates: &Candidates, names: &[&str]) -> Stage<'a> {
        let taken = names.iter().map(|name| {
            let id = effect::parse(name, lab.model()).unwrap();
            let values = vec![0.0; effect::build(&id, lab.model()).unwrap().parameters().len()];
            AddedEffect { id, values }
        });
        lab.stage(taken.collect(), None, candidates, &Progress::unwatched()).unwrap()
    }

    #[test]
    fn of_effects_that_were_taken_in_the_one_that_is_missed_most_is_in_question() {
        let (lab, candidates) = arm();
        let needed = |names: &[&str]| {
            let full = with(&lab, &candidates, names);
            let without = lab.most_needed(&full, &candidates, &Progress::unwatched()).unwrap()?;
            Some(without.taken.iter().map(|one| lab.model().label(&one.id)).collect::<Vec<_>>())
        };
        assert_eq!(needed(&[GAIN, WAVE]), Some(vec![WAVE.to_owned()]));
        assert_eq!(needed(&[WAVE, GAIN]), Some(vec![WAVE.to_owned()]));
        assert_eq!(needed(&[WAVE]), Some(Vec::new()));
        assert_eq!(needed(&[]), None);
    }

    #[test]
    fn what_was_searched_for_in_an_effect_counts_against_how_much_it_is_missed() {
        let (lab, mut candidates) = arm();
        let full = with(&lab, &candidates, &[WAVE, GAIN]);
        let watch = Progress::unwatched();
        assert_eq!(lab.by_need(&full, &candidates, &watch).unwrap(), [[1], [0]]);
        // A criterion's fall of some thousands is outweighed by a search that costs a million.
        let gain = effect::parse(GAIN, lab.model()).unwrap();
        candidates.listed.iter_mut().find(|probe| probe.id == gain).unwrap().search_cost = 1e6;
        assert_eq!(lab.by_need(&full, &candidates, &watch).unwrap(), [[0], [1]]);
    }

    /// The small arm, whose elbow is off by this many radians in each row; a new epoch begins at row 31.
    fn jumping(off: impl Fn(usize) -> f64) -> (Laboratory, Candidates) {
        let row = std::cell::Cell::new(0);
        let lines = "free: [joint_zero(*)]\nepochs: {rows: [31]}";
        let lab = crate::testing::two_links_with(lines, 60, 0.02, 46, |_| {
            let now = row.get();
            row.set(now + 1);
            [0.0, off(now)]
        });
        let candidates = Candidates { listed: crate::candidates::probes(&lab), unlisted: Vec::new() };
        (lab, candidates)
    }

    fn added(lab: &Laboratory, name: &str, inner: Option<f64>) -> AddedEffect {
        let id = EffectId { inner, ..effect::parse(name, lab.model()).unwrap() };
        let values = vec![0.0; effect::build(&id, lab.model()).unwrap().parameters().len()];
        AddedEffect { id, values }
    }

    #[test]
    fn explanations_of_one_jump_are_left_out_together_and_weighed_against_each_other() {
        let (lab, candidates) = jumping(|row| if row >= 30 { 0.004 } else { 0.0 });
        let watch = Progress::unwatched();
        let taken = ["base_reset", "target_reset(p1)", "joint_gain(shoulder)"];
        let mut taken: Vec<AddedEffect> = taken.iter().map(|name| added(&lab, name, None)).collect();
        taken.push(added(&lab, "joint_step(elbow)", Some(30.0)));
        assert_eq!(lab.by_jump(&taken), [vec![0, 1, 3], vec![2]]);
        let full = lab.stage(taken, None, &candidates, &watch).unwrap();
        let without = lab.most_needed(&full, &candidates, &watch).unwrap().unwrap();
        assert_eq!(without.taken.len(), 1, "the gain alone stays");
        let best = &without.fitted_candidates[0].id;
        assert_eq!((lab.model().label(best), best.inner), ("joint_step(elbow)".to_owned(), Some(30.0)));
    }

    #[test]
    fn where_a_jump_is_in_question_a_joint_that_jumped_is_asked_at_other_moments() {
        // Down at row 15, and up twice as far at row 30.
        let (lab, candidates) = jumping(|row| match row {
            0..15 => 0.0,
            15..30 => -0.004,
            _ => 0.004,
        });
        let watch = Progress::unwatched();
        let second = added(&lab, "joint_step(elbow)", Some(30.0));
        let moment = |jumps| {
            let stage = lab.stage_asking(&candidates, jumps, vec![second.clone()], None, &watch).unwrap();
            let mut all = stage.fitted_candidates.iter();
            all.find(|one| one.id.same_as(&second.id)).map(|one| one.id.inner)
        };
        assert_eq!(moment(Jumps::Once), None);
        assert_eq!(moment(Jumps::AtOtherMoments), Some(Some(15.0)));
    }
}
