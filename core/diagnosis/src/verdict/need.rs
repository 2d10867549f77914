//! Which of the effects that were taken in is missed most: it is the one in question.

use super::close_fitted_candidates;
use crate::candidates::Candidates;
use crate::forward_selection::{FittedCandidate, Stage};
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
        for index in self.by_need(full, candidates, progress)? {
            let without = self.stage(without(full, index), Some(&full.fitted), candidates, progress)?;
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

    /// The effects a stage has taken in, by their places in it, the one it would miss most first: by how much the criterion worsens without it, everything else fitted
    /// anew to the same rows.
    fn by_need(
        &self,
        full: &Stage<'_>,
        candidates: &Candidates,
        progress: &Progress,
    ) -> Result<Vec<usize>, LaboratoryError> {
        let (fit, least) = (&full.fitted.fit, full.fitted.machine.least_variance());
        let options = FitOptions { robust: false, ..self.options().fit };
        let taken: Vec<(usize, &AddedEffect)> = full.taken.iter().enumerate().collect();
        let criteria = for_each(&taken, |(index, leaves)| {
            let rows = (fit.rows.as_slice(), fit.weights.as_slice());
            let rest = self.fit_near(&without(full, *index), &full.fitted, rows, options, progress)?;
            let numbers = fit.rank().saturating_sub(leaves.values.len()) as f64;
            let saved = candidates.search_cost(&leaves.id, full.equations());
            let squares = rest.fit.normal.squares;
            Ok::<_, LaboratoryError>(bic_above(least, squares, full.equations(), numbers, -saved))
        });
        let criteria = criteria.into_iter().collect::<Result<Vec<f64>, _>>()?;
        let mut by_need: Vec<(usize, f64)> = criteria.into_iter().enumerate().collect();
        by_need.sort_by(|left, right| right.1.total_cmp(&left.1));
        Ok(by_need.into_iter().map(|(index, _)| index).collect())
    }
}

/// The effects that a stage has taken in, but for one.
fn without(full: &Stage<'_>, index: usize) -> Vec<AddedEffect> {
    let others = full.taken.iter().enumerate().filter(|(other, _)| *other != index);
    others.map(|(_, one)| one.clone()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use plumb_calibration::effect;

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
        assert_eq!(lab.by_need(&full, &candidates, &watch).unwrap(), [1, 0]);
        // A criterion's fall of some thousands is outweighed by a search that costs a million.
        let gain = effect::parse(GAIN, lab.model()).unwrap();
        candidates.listed.iter_mut().find(|probe| probe.id == gain).unwrap().search_cost = 1e6;
        assert_eq!(lab.by_need(&full, &candidates, &watch).unwrap(), [0, 1]);
    }
}
