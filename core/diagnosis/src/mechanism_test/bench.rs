//! What is asked of one stage: the candidates beside a flexible part, alone and together, each set of them weighed by its marginal likelihood.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::asked::{AskedCandidate, Who};
use super::left_out_geometry::cost_of_choice;
use crate::explainable::{Features, Mixed, MixedFit};
use crate::forward_selection::{FittedCandidate, Stage};
use plumb_calibration::effect::EffectId;

/// Some candidates that act at once, fitted, and their criterion: twice the negative logarithm of their marginal likelihood.
#[derive(Clone)]
pub(super) struct Set {
    /// By their indices in the list of candidates, ascending.
    pub(super) members: Vec<usize>,
    pub(super) fit: MixedFit,
    pub(super) criterion: f64,
}

/// The candidate that is asked, and the set it is asked in.
pub(super) struct Foremost<'s> {
    /// Its index in the list of candidates.
    pub(super) member: usize,
    pub(super) set: &'s Set,
    /// Components of the flexible part that hold what it does because they are of its own kind: smooth functions of the same errors, of the same joint. They are the candidate in
    /// a more flexible form, and not something else that does as well; how much more than the candidate they do is asked apart (`fraction_left_at`).
    pub(super) own_functions: Vec<usize>,
}

/// Everything that is asked of one stage.
pub(super) struct Bench<'b> {
    pub(super) stage: &'b Stage<'b>,
    pub(super) candidates: Vec<AskedCandidate>,
    /// Of the likeliest waves: the parameters of their overtones.
    pub(super) overtones: Vec<(EffectId, Vec<usize>)>,
    pub(super) rows: Vec<usize>,
    pub(super) features: Features,
    pub(super) mixed: Mixed,
    /// Without any candidate.
    pub(super) nothing: MixedFit,
    pub(super) equations: f64,
}

impl Bench<'_> {
    /// Effects that the likeliest were chosen from.
    pub(super) fn families(&self) -> f64 {
        self.stage.fitted_candidates.len() as f64
    }

    /// Twice the negative logarithm of the marginal likelihood of a set: each independent parameter is charged as by Schwarz, searches and the choice of several besides.
    pub(super) fn criterion(&self, members: &[usize], deviance: f64, rank: usize) -> f64 {
        let searches: f64 =
            members.iter().filter_map(|one| self.candidates.get(*one)).map(|one| one.cost).sum();
        let choice = cost_of_choice(self.families(), members.len());
        deviance + rank as f64 * self.equations.ln() + searches + choice
    }

    /// The parameters of a set, member by member.
    pub(super) fn parameters(&self, members: &[usize]) -> Vec<usize> {
        let own = members.iter().filter_map(|one| self.candidates.get(*one));
        own.flat_map(|one| one.parameters.iter().copied()).collect()
    }

    /// A set fitted in so many rounds at most, from these ratios on; nothing where the numbers break down, or a member adds nothing.
    pub(super) fn fitted(&self, members: &[usize], start: &[f64], rounds: usize) -> Option<Set> {
        self.set_of(members, self.mixed.fit_within(rounds, &self.parameters(members), Some(start))?)
    }

    /// A set as it is fitted; nothing where a member adds nothing.
    fn set_of(&self, members: &[usize], fit: MixedFit) -> Option<Set> {
        // Two that do the same in these rows count as one, and the smaller set is in the list already.
        if fit.rank < members.len() {
            return None;
        }
        let criterion = self.criterion(members, fit.deviance, fit.rank);
        Some(Set { members: members.to_vec(), fit, criterion })
    }

    /// Whether the criterion of a set falls below `bound` from these ratios on.
    pub(super) fn is_below(&self, bound: f64, set: &Set, start: &[f64]) -> bool {
        let charged = self.criterion(&set.members, 0.0, set.fit.rank);
        let fit = self.mixed.fit_below(bound - charged, &self.parameters(&set.members), start);
        let fitted = fit.and_then(|fit| self.set_of(&set.members, fit));
        fitted.is_some_and(|fitted| fitted.criterion < bound)
    }

    /// Where a member's parameters are among those of its set.
    fn columns_of(&self, set: &Set, member: usize) -> Range<usize> {
        let before: Vec<usize> = set.members.iter().copied().take_while(|one| *one != member).collect();
        let first = self.parameters(&before).len();
        first..first + self.parameters(&[member]).len()
    }

    /// A candidate in a set, with the components that hold it.
    pub(super) fn in_set<'s>(&self, member: usize, set: &'s Set) -> Foremost<'s> {
        let held =
            self.candidates.get(member).and_then(|one| Some((one, self.components_at(one.id.joint()?))));
        let own_functions = held.map(|(one, at_joint)| self.mixed.holding(&one.parameters, &at_joint));
        Foremost { member, set, own_functions: own_functions.unwrap_or_default() }
    }

    /// Components of errors at one joint.
    pub(super) fn components_at(&self, joint: usize) -> Vec<usize> {
        let at_joint = self.features.joints.iter().enumerate().filter(|(_, at)| **at == Some(joint));
        at_joint.map(|(component, _)| component).collect()
    }

    /// A candidate's index in the stage's list of fitted candidates; nothing of one without a name.
    pub(super) fn index_in_stage(&self, member: usize) -> Option<usize> {
        match self.candidates.get(member)?.who {
            Who::Listed(index) => Some(index),
            Who::Unlisted(_) => None,
        }
    }

    /// The values of a member's parameters and their covariance.
    pub(super) fn values(&self, set: &Set, member: usize) -> (DVector<f64>, DMatrix<f64>) {
        let own = self.columns_of(set, member);
        let values = set.fit.values.rows(own.start, own.len()).into_owned();
        let covariance = &set.fit.covariance;
        (values, covariance.view((own.start, own.start), (own.len(), own.len())).into_owned())
    }

    /// A member's values among those of all parameters of its set.
    pub(super) fn part<'v>(&self, set: &Set, member: usize, values: &'v [f64]) -> &'v [f64] {
        values.get(self.columns_of(set, member)).unwrap_or_default()
    }

    /// Sum of squares that a member explains in a fit of its set.
    pub(super) fn explained(&self, fit: &MixedFit, member: usize) -> f64 {
        self.candidates.get(member).map_or(0.0, |one| self.mixed.squares_of(fit, &one.parameters))
    }

    pub(super) fn fitted_candidate(&self, member: usize) -> Option<&FittedCandidate> {
        self.stage.fitted_candidates.get(self.index_in_stage(member)?)
    }

    /// Whether a candidate is an effect of the library that chance would hardly make, and of a possible size.
    pub(super) fn is_plausible(&self, member: usize) -> bool {
        self.fitted_candidate(member).is_some_and(FittedCandidate::is_plausible)
    }

    /// What a candidate takes from what is left if it comes in alone.
    pub(super) fn gain(&self, member: usize) -> f64 {
        self.candidates.get(member).map_or(0.0, |one| one.gain)
    }

    /// Of some candidates the one that would take most from what is left if it came in alone: what the error is, in the main.
    pub(super) fn foremost(&self, members: impl Iterator<Item = usize>) -> Option<usize> {
        members.max_by(|left, right| self.gain(*left).total_cmp(&self.gain(*right)))
    }
}
