//! Exchanges: whether one or two of the effects that forward selection took in are better replaced. A set that was grown one by one can be one in which no single
//! effect could be added, left out or replaced with profit, although another set explains the rows better: where two joints yield to gravity, the bending of the link
//! between them explains most of both, and two effects that imitate anything explain the rest. So one or two are replaced by up to two others (Miller 2002, Subset
//! Selection in Regression, chapter 3: sequential replacement, replacing two variables at a time), first in the linear model about the fit, then in earnest.

mod linear_model;

use std::collections::BTreeSet;

use crate::candidates::Candidates;
use crate::forward_selection::Stage;
use crate::laboratory::{Laboratory, LaboratoryError};
use crate::score_test::is_plausible;
use crate::thresholds::{EXCHANGES_FITTED, TIE_BIC};
use linear_model::{Column, LinearModel, Member, Proposal};
use plumb_calibration::arm_model::AddedEffect;
use plumb_calibration::effect::{self, Effect, EffectId, Family};
use plumb_calibration::fit::{FitOptions, FreeParameter, ResidualModel};
use plumb_estimation::{Progress, bic_above, for_each};

/// By which the criterion of the linear model may be wrong for a pair that is fitted (BIC units). Why: bends of a degree move it by some units.
const LINEAR_ERROR: f64 = 20.0;

/// A set of effects that was fitted in place of a stage's, and how much better Schwarz's criterion calls it.
struct Exchanged {
    set: Vec<AddedEffect>,
    gain: f64,
}

impl Laboratory {
    /// The set that explains the rows of a stage better than what it has taken in; nothing if there is none.
    pub(crate) fn exchange(
        &self,
        stage: &Stage<'_>,
        candidates: &Candidates,
        progress: &Progress,
    ) -> Result<Option<Vec<AddedEffect>>, LaboratoryError> {
        let linear = linearized(stage, candidates, |_| true)?;
        let before = stage.bic + linear.search_costs();
        let proposals: Vec<Proposal> = linear.proposals(before).into_iter().take(EXCHANGES_FITTED).collect();
        let tried = for_each(&proposals, |proposal| self.exchanged(stage, &linear, proposal, progress));
        let mut best: Option<Exchanged> = None;
        for exchanged in tried {
            let Some(exchanged) = exchanged? else { continue };
            if exchanged.gain > best.as_ref().map_or(0.0, |best| best.gain) {
                best = Some(exchanged);
            }
        }
        Ok(best.map(|best| best.set))
    }

    /// Which candidates of a stage explain the rows as well as the likeliest one if two of one kind act together, by their indices in its list: a pair that Schwarz's criterion
    /// hardly distinguishes from it, though neither of the two does alone what it does.
    pub(crate) fn pairs_as_likely(
        &self,
        stage: &Stage<'_>,
        best: usize,
        candidates: &Candidates,
        progress: &Progress,
    ) -> Result<Vec<usize>, LaboratoryError> {
        let linear = linearized(stage, candidates, comes_in_pairs)?;
        let Some(own) = stage.fitted_candidates.get(best) else { return Ok(Vec::new()) };
        let limit = own.bic + linear.search_costs() + TIE_BIC;
        let mut pairs = linear.pairs_of_one_kind();
        let without_best = |pair: &Proposal| linear.ids(pair).all(|id| *id != own.id);
        pairs.retain(|pair| without_best(pair) && pair.criterion < limit + LINEAR_ERROR);
        pairs.truncate(EXCHANGES_FITTED);
        let tried = for_each(&pairs, |pair| self.exchanged(stage, &linear, pair, progress));
        let before = stage.bic + linear.search_costs();
        let mut found = BTreeSet::new();
        for (pair, fitted) in pairs.iter().zip(tried) {
            // What a pair was chosen from is the same as for the likeliest one, which is one of a kind as well.
            if fitted?.is_some_and(|fitted| before - fitted.gain - pair.choice < limit) {
                let ids = linear.ids(pair);
                found.extend(
                    ids.filter_map(|id| stage.fitted_candidates.iter().position(|one| one.id == *id)),
                );
            }
        }
        Ok(found.into_iter().collect())
    }

    /// A proposal fitted to the rows of the stage; nothing if a machine cannot have such values.
    fn exchanged(
        &self,
        stage: &Stage<'_>,
        linear: &LinearModel,
        proposal: &Proposal,
        progress: &Progress,
    ) -> Result<Option<Exchanged>, LaboratoryError> {
        let set = proposal.set(&stage.taken, linear);
        let options = FitOptions { robust: false, ..self.options().fit };
        let rows = (stage.fitted.fit.rows.as_slice(), stage.fitted.fit.weights.as_slice());
        let refit = self.fit_near(&set, &stage.fitted, rows, options, progress)?;
        let fit = &refit.fit;
        let set = set.into_iter().map(|one| {
            let part = refit.problem.parts.iter().position(|part| part.id == one.id)?;
            let values = fit.state.effects.get(part)?.clone();
            let free_parameters = free_parameters_of(&refit.problem, part);
            let covariance = fit.covariance.select_rows(&free_parameters).select_columns(&free_parameters);
            let effect = refit.problem.parts.get(part)?.effect.as_ref();
            is_plausible(effect, &values, &covariance).then_some(AddedEffect { id: one.id, values })
        });
        let Some(set) = set.collect::<Option<Vec<AddedEffect>>>() else { return Ok(None) };
        let after = bic_above(
            refit.problem.least_variance(),
            fit.normal.squares,
            fit.normal.equations as f64,
            proposal.parameters,
            proposal.search_costs,
        );
        let gain = stage.bic + linear.search_costs() - after - proposal.choice;
        Ok(Some(Exchanged { set, gain }))
    }
}

/// Which free numbers are those of one part of a problem.
fn free_parameters_of(problem: &ResidualModel<'_>, part: usize) -> Vec<usize> {
    let free_parameters = problem.free_parameters().iter().enumerate();
    let own = free_parameters.filter(
        |(_, free_parameter)| matches!(free_parameter, FreeParameter::Effect(index, _) if *index == part),
    );
    own.map(|(index, _)| index).collect()
}

/// Whether two effects of this kind at two places may be one explanation: what joints do and links under load, as all joints of an arm are alike. Kinds that imitate
/// anything imitate pairs as well; geometry that is not free is asked as a whole; what was re-set was re-set once.
fn comes_in_pairs(id: &EffectId) -> bool {
    effect::kind(&id.name).is_some_and(|kind| {
        matches!(kind.family, Family::Joint | Family::LinkAndTime)
            && !kind.imitates_anything
            && !kind.is_event
    })
}

/// The linear model about the fit of a stage, with those of its candidates that are asked.
fn linearized(
    stage: &Stage<'_>,
    candidates: &Candidates,
    is_asked: impl Fn(&EffectId) -> bool,
) -> Result<LinearModel, LaboratoryError> {
    let (problem, fit) = (&stage.fitted.problem, &stage.fitted.fit);
    let mut members = Vec::new();
    for taken in &stage.taken {
        let part = problem.parts.iter().position(|part| part.id == taken.id);
        let values = part.and_then(|part| fit.state.effects.get(part)).cloned().unwrap_or_default();
        let columns = part.map_or_else(Vec::new, |part| free_parameters_of(problem, part));
        let search_cost = candidates.search_cost(&taken.id, stage.equations());
        members.push(Member { id: taken.id.clone(), columns, values, search_cost });
    }
    let mut first = problem.free_parameters().len();
    let mut columns = Vec::new();
    for candidate in stage.fitted_candidates.iter().filter(|candidate| is_asked(&candidate.id)) {
        let effect = effect::build(&candidate.id, problem.model)?;
        let range = first..first + effect.parameters().len();
        first = range.end;
        columns.push(Column { id: candidate.id.clone(), effect, range, search_cost: candidate.search_cost });
    }
    let effects: Vec<&dyn Effect> = columns.iter().map(|column| column.effect.as_ref()).collect();
    let normal = problem.normal(&fit.state, &fit.rows, &fit.weights, &effects);
    let (parameters, least) = (fit.rank() as f64, problem.least_variance());
    Ok(LinearModel::new(normal, members, columns, (parameters, least)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::candidates::probes;
    use crate::testing::two_links;
    use plumb_calibration::effect::{Site, parse};

    /// What is exchanged for these effects in an arm whose joints have gains that are wrong by a hundredth and by half of that.
    fn exchanged_for(taken: &[&str]) -> Option<Vec<String>> {
        let lab = two_links(60, "joint_zero(*)", 0.05, 31, |q| [0.01 * q[0], -0.005 * q[1]]);
        let watch = Progress::unwatched();
        let candidates = Candidates { listed: probes(&lab), unlisted: Vec::new() };
        let taken = taken.iter().map(|label| {
            let id = parse(label, lab.model()).unwrap();
            let values = vec![0.0; effect::build(&id, lab.model()).unwrap().parameters().len()];
            AddedEffect { id, values }
        });
        let stage = lab.stage(taken.collect(), None, &candidates, &watch).unwrap();
        let set = lab.exchange(&stage, &candidates, &watch).unwrap()?;
        assert!(set.iter().all(|one| matches!(one.id.site, Site::Joint(_))));
        let mut labels: Vec<String> = set.iter().map(|one| lab.model().label(&one.id)).collect();
        labels.sort();
        Some(labels)
    }

    const BOTH: [&str; 2] = ["joint_gain(elbow)", "joint_gain(shoulder)"];

    #[test]
    fn what_imitates_is_exchanged_for_what_is_there_one_or_both_at_once() {
        let one = exchanged_for(&["joint_gain(shoulder)", "joint_harmonic(elbow, 1)"]);
        assert_eq!(one.unwrap(), BOTH);
        let both = exchanged_for(&["joint_harmonic(shoulder, 1)", "joint_harmonic(elbow, 1)"]);
        assert_eq!(both.unwrap(), BOTH);
    }

    #[test]
    fn what_is_not_needed_beside_the_others_leaves() {
        let beside =
            exchanged_for(&["joint_gain(shoulder)", "joint_gain(elbow)", "joint_harmonic(elbow, 3)"]);
        assert_eq!(beside.unwrap(), BOTH);
    }

    /// Weights that hang on the two links, which lie in a vertical plane.
    const WEIGHTS: &str = "
free: [joint_zero(*)]
links: [{after: shoulder, mass_kg: 4, centre_mm: [-80, 0, 0]}, {after: elbow, mass_kg: 3, centre_mm: [-40, 0, 0]}]
gravity: [0, -1, 0]
";

    #[test]
    fn two_joints_that_yield_are_as_likely_as_what_imitates_both_and_one_alone_is_not() {
        // Torques of the weights about the two axes, N m.
        let torques = |q: [f64; 2]| {
            let (first, both) = (q[0].cos(), (q[0] + q[1]).cos());
            let beyond = 3.0 * 9.80665 * 0.110 * both;
            let all = beyond + 9.80665 * (4.0 * 0.120 + 3.0 * 0.200) * first;
            [all, beyond]
        };
        let labels = |compliance: [f64; 2]| {
            let off = |q: [f64; 2]| {
                let [all, beyond] = torques(q);
                [-compliance[0] * all, -compliance[1] * beyond]
            };
            let lab = crate::testing::two_links_with(WEIGHTS, 60, 0.02, 31, off);
            let watch = Progress::unwatched();
            let candidates = Candidates { listed: probes(&lab), unlisted: Vec::new() };
            let stage = lab.stage(Vec::new(), None, &candidates, &watch).unwrap();
            // In place of the likeliest: an effect that does not come near, with the criterion that the likeliest pair has, and with more.
            let other = stage.fitted_candidates.iter().position(|one| one.id.name == "joint_gain").unwrap();
            let mut stage = stage;
            let linear = linearized(&stage, &candidates, comes_in_pairs).unwrap();
            let pair = linear.pairs_of_one_kind().swap_remove(0);
            let fitted = lab.exchanged(&stage, &linear, &pair, &watch).unwrap().unwrap();
            let criterion = stage.bic - fitted.gain - pair.choice;
            [0.9 * TIE_BIC, 1.1 * TIE_BIC].map(|behind| {
                stage.fitted_candidates[other].bic = criterion - behind;
                let pairs = lab.pairs_as_likely(&stage, other, &candidates, &watch).unwrap();
                let ids = pairs.iter().map(|index| lab.model().label(&stage.fitted_candidates[*index].id));
                ids.collect::<std::collections::BTreeSet<String>>()
            })
        };
        let [near, far] = labels([2e-4, 3e-4]);
        let both = ["joint_compliance(elbow)", "joint_compliance(shoulder)"].map(str::to_owned);
        assert!(both.iter().all(|label| near.contains(label)), "{near:?}");
        assert!(both.iter().any(|label| !far.contains(label)), "{far:?}");
    }

    #[test]
    fn the_effects_that_are_there_stay() {
        assert_eq!(exchanged_for(&BOTH), None);
    }
}
