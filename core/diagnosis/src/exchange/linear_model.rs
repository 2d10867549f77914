//! The linear model about a fit, in which a set of effects costs a product of small matrices in place of a fit.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use crate::score_test::{information_inverse, units};
use crate::thresholds::{EXCHANGE_PARTNERS, MOST_EFFECTS};
use plumb_calibration::arm_model::AddedEffect;
use plumb_calibration::effect::{Effect, EffectId};
use plumb_estimation::{NormalEquations, RankRevealingCholesky, bic_above};

/// Part of a sum of squares that is left at least, whatever the linear model takes away.
const LEAST_LEFT: f64 = 1e-6;

/// An effect that takes part in the fit.
pub(super) struct Member {
    pub(super) id: EffectId,
    /// Its numbers among those that are fitted.
    pub(super) columns: Vec<usize>,
    /// Its values at the fit.
    pub(super) values: Vec<f64>,
    pub(super) search_cost: f64,
}

/// An effect that does not.
pub(super) struct Column {
    pub(super) id: EffectId,
    pub(super) effect: Box<dyn Effect>,
    /// Its numbers in the normal equations.
    pub(super) range: Range<usize>,
    pub(super) search_cost: f64,
}

/// Normal equations of everything that was fitted and of every candidate, at a fit with some members in.
pub(super) struct LinearModel {
    /// The fitted numbers first, then those of the candidates.
    normal: NormalEquations,
    /// How many numbers were fitted.
    free_parameters: usize,
    pub(super) members: Vec<Member>,
    pub(super) columns: Vec<Column>,
    /// Numbers that the rows determine, those of the members among them.
    pub(super) parameters: f64,
    /// Variance of one equation at least.
    least: f64,
    /// How many of members and candidates are of each kind.
    kinds: BTreeMap<String, usize>,
    /// What the choice of the members costs.
    choice_of_members: f64,
    /// How many of the fitted numbers are independent in the normal equations.
    rank: f64,
}

/// A set in place of the members.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Proposal {
    /// Which members leave.
    pub(super) removed: Vec<usize>,
    /// Which candidates come, with the values they would have.
    pub(super) added: Vec<(usize, Vec<f64>)>,
    /// Schwarz's criterion of the set, as the linear model has it.
    pub(super) criterion: f64,
    /// Numbers that the rows determine with the set in.
    pub(super) parameters: f64,
    /// What was searched for in the set's effects costs so much of the criterion.
    pub(super) search_costs: f64,
    /// What the choice of its effects costs besides, less what that of the members does; where it has fewer effects this is below zero.
    pub(super) choice: f64,
}

impl Proposal {
    /// The criterion with what the choice costs.
    fn price(&self) -> f64 {
        self.criterion + self.choice
    }

    /// Which candidates come.
    fn candidates(&self) -> BTreeSet<usize> {
        self.added.iter().map(|(index, _)| *index).collect()
    }

    /// The effects of the set: members that stay, then those that come.
    pub(super) fn set(&self, taken: &[AddedEffect], linear: &LinearModel) -> Vec<AddedEffect> {
        let stay = taken.iter().enumerate().filter(|(index, _)| !self.removed.contains(index));
        let come = self.added.iter().filter_map(|(index, values)| {
            let id = linear.columns.get(*index)?.id.clone();
            Some(AddedEffect { id, values: values.clone() })
        });
        stay.map(|(_, one)| one.clone()).chain(come).collect()
    }
}

/// What is left for candidates once some members are out and all else is fitted anew.
struct Rest {
    /// Products of the candidates' derivatives beyond what is fitted.
    left: DMatrix<f64>,
    /// The same with the residuals.
    gradient: DVector<f64>,
    squares: f64,
    /// Numbers of the members that are out.
    gone: f64,
}

/// A candidate, or a pair, beyond a rest.
struct Gain {
    squares: f64,
    freedom: f64,
    values: DVector<f64>,
    inverse: DMatrix<f64>,
}

impl LinearModel {
    /// Of normal equations of the fitted numbers and the candidates `columns`, in this order; the rows determine so many `parameters` at the fit.
    pub(super) fn new(
        normal: NormalEquations,
        members: Vec<Member>,
        columns: Vec<Column>,
        (parameters, least): (f64, f64),
    ) -> Self {
        let free_parameters = columns.first().map_or(normal.matrix.nrows(), |first| first.range.start);
        let own = normal.matrix.view((0, 0), (free_parameters, free_parameters)).into_owned();
        let rank = RankRevealingCholesky::new(&own).rank() as f64;
        let mut kinds = BTreeMap::new();
        for id in members.iter().map(|member| &member.id).chain(columns.iter().map(|column| &column.id)) {
            *kinds.entry(id.name.clone()).or_insert(0) += 1;
        }
        let mut model = Self {
            normal,
            free_parameters,
            members,
            columns,
            parameters,
            least,
            kinds,
            choice_of_members: 0.0,
            rank,
        };
        model.choice_of_members = model.choice(model.members.iter().map(|member| member.id.name.as_str()));
        model
    }

    /// What was searched for in the members costs so much of the criterion.
    pub(super) fn search_costs(&self) -> f64 {
        self.members.iter().map(|member| member.search_cost).sum()
    }

    /// Sets with one or two members replaced by up to two candidates that the linear model prefers to a criterion of `before`, the best first.
    pub(super) fn proposals(&self, before: f64) -> Vec<Proposal> {
        let count = self.members.len();
        let alone = (0..count).map(|one| vec![one]);
        let pairs = (0..count).flat_map(|one| (one + 1..count).map(move |other| vec![one, other]));
        let mut proposals: Vec<Proposal> =
            alone.chain(pairs).flat_map(|removed| self.without(&removed)).collect();
        proposals.retain(|proposal| {
            let size = count - proposal.removed.len() + proposal.added.len();
            size <= MOST_EFFECTS && proposal.price() < before
        });
        proposals.sort_by(|left, right| left.price().total_cmp(&right.price()));
        // A pair is found from either of its candidates.
        let mut known = BTreeSet::new();
        proposals.retain(|proposal| known.insert((proposal.removed.clone(), proposal.candidates())));
        proposals
    }

    /// The best sets in which these members are replaced by nothing, by one candidate and by two.
    fn without(&self, removed: &[usize]) -> Vec<Proposal> {
        let rest = self.rest(removed);
        let nothing = self.proposal(removed, Vec::new(), &rest, (0.0, 0.0));
        let mut singles: Vec<(usize, Gain)> = (0..self.columns.len())
            .filter_map(|index| {
                let block = rest.block((index, index), self);
                Some((index, self.gain(index, &block, &rest.part(index, self))?))
            })
            .collect();
        singles.sort_by(|left, right| right.1.squares.total_cmp(&left.1.squares));
        let mut proposals: Vec<Proposal> = singles
            .iter()
            .filter(|(index, gain)| self.is_plausible(*index, &gain.values))
            .map(|(index, gain)| {
                let added = vec![(*index, gain.values.as_slice().to_vec())];
                self.proposal(removed, added, &rest, (gain.squares, gain.freedom))
            })
            .collect();
        for (index, gain) in singles.iter().take(EXCHANGE_PARTNERS) {
            proposals.extend(self.best_beside((*index, gain), removed, &rest));
        }
        proposals.push(nothing);
        proposals
    }

    /// The best pair of one candidate with any other.
    fn best_beside(&self, one: (usize, &Gain), removed: &[usize], rest: &Rest) -> Option<Proposal> {
        let others = (0..self.columns.len()).filter(|other| *other != one.0);
        let pairs = others.filter_map(|other| self.pair(one, other, removed, rest));
        pairs.min_by(|left, right| left.price().total_cmp(&right.price()))
    }

    /// One candidate with another; nothing where a machine cannot have such values, or the other cannot be distinguished from what is fitted.
    fn pair(
        &self,
        (one, alone): (usize, &Gain),
        other: usize,
        removed: &[usize],
        rest: &Rest,
    ) -> Option<Proposal> {
        let shared = rest.block((other, one), self);
        // What is left of the other beyond the first.
        let carried = &shared * &alone.inverse;
        let block = rest.block((other, other), self) - &carried * shared.transpose();
        let gradient = rest.part(other, self) - &carried * rest.part(one, self);
        let beside = self.gain(other, &block, &gradient)?;
        let first = &alone.values - carried.tr_mul(&beside.values);
        let plausible = self.is_plausible(one, &first) && self.is_plausible(other, &beside.values);
        let added = vec![(one, first.as_slice().to_vec()), (other, beside.values.as_slice().to_vec())];
        let gained = (alone.squares + beside.squares, alone.freedom + beside.freedom);
        plausible.then(|| self.proposal(removed, added, rest, gained))
    }

    fn proposal(
        &self,
        removed: &[usize],
        added: Vec<(usize, Vec<f64>)>,
        rest: &Rest,
        (squares, freedom): (f64, f64),
    ) -> Proposal {
        let stay = self.members.iter().enumerate().filter(|(index, _)| !removed.contains(index));
        let come = added.iter().filter_map(|(index, _)| self.columns.get(*index));
        let set: Vec<(&EffectId, f64)> = stay
            .map(|(_, member)| (&member.id, member.search_cost))
            .chain(come.map(|column| (&column.id, column.search_cost)))
            .collect();
        let search_costs = set.iter().map(|(_, cost)| cost).sum();
        let choice = self.choice(set.iter().map(|(id, _)| id.name.as_str()));
        let left = (rest.squares - squares).max(rest.squares * LEAST_LEFT);
        let equations = self.normal.equations as f64;
        let parameters = self.parameters - rest.gone + freedom;
        Proposal {
            criterion: bic_above(self.least, left, equations, parameters, search_costs),
            parameters,
            choice: choice - self.choice_of_members,
            removed: removed.to_vec(),
            added,
            search_costs,
        }
    }

    /// What a choice of effects of these kinds costs: `2 ln` of the candidates it was made from (extended BIC, Chen and Chen 2008). The first of a kind is chosen from all
    /// candidates; a further one from those of its kind, for the joints of an arm are alike: where one yields, others do.
    fn choice<'n>(&self, names: impl Iterator<Item = &'n str>) -> f64 {
        // A handful of effects: looking through them costs less than any set.
        let mut known: Vec<&str> = Vec::new();
        let of_one = |name: &'n str| {
            let count = match known.contains(&name) {
                true => self.kinds.get(name).copied().unwrap_or(1),
                false => self.members.len() + self.columns.len(),
            };
            known.push(name);
            count
        };
        names.map(of_one).map(|count| 2.0 * (count.max(1) as f64).ln()).sum()
    }

    /// The effects that come with a proposal.
    pub(super) fn ids<'p>(&'p self, proposal: &'p Proposal) -> impl Iterator<Item = &'p EffectId> {
        proposal.added.iter().filter_map(|(index, _)| Some(&self.columns.get(*index)?.id))
    }

    /// The likeliest pairs of candidates of one kind beside the members, the best first: where one joint yields, others do.
    pub(super) fn pairs_of_one_kind(&self) -> Vec<Proposal> {
        let rest = self.rest(&[]);
        let mut pairs = Vec::new();
        for (one, column) in self.columns.iter().enumerate() {
            let Some(alone) = self.gain(one, &rest.block((one, one), self), &rest.part(one, self)) else {
                continue;
            };
            let others = (one + 1..self.columns.len()).filter(|other| {
                self.columns.get(*other).is_some_and(|other| other.id.name == column.id.name)
            });
            pairs.extend(others.filter_map(|other| self.pair((one, &alone), other, &[], &rest)));
        }
        pairs.sort_by(|left, right| left.criterion.total_cmp(&right.criterion));
        pairs
    }

    fn is_plausible(&self, index: usize, values: &DVector<f64>) -> bool {
        self.columns.get(index).is_some_and(|column| column.effect.plausible(values.as_slice()))
    }

    /// What a candidate would take from a rest, by its derivatives beyond it; nothing where it cannot be distinguished from what is fitted.
    fn gain(&self, index: usize, block: &DMatrix<f64>, gradient: &DVector<f64>) -> Option<Gain> {
        let range = self.columns.get(index)?.range.clone();
        let own = self.normal.matrix.view((range.start, range.start), (range.len(), range.len()));
        let (inverse, freedom) = information_inverse(block, &units(&own.into_owned()));
        let values = &inverse * gradient;
        (freedom > 0).then(|| Gain {
            squares: gradient.dot(&values).max(0.0),
            freedom: freedom as f64,
            values,
            inverse,
        })
    }

    /// What is left for candidates without these members.
    fn rest(&self, removed: &[usize]) -> Rest {
        let gone: Vec<&Member> = removed.iter().filter_map(|index| self.members.get(*index)).collect();
        let columns: Vec<usize> = gone.iter().flat_map(|member| member.columns.iter().copied()).collect();
        let values: Vec<f64> = gone.iter().flat_map(|member| member.values.iter().copied()).collect();
        let values = DVector::from_vec(values);
        // Without them the residuals are larger by what they explained.
        let moved = self.normal.matrix.select_columns(&columns) * &values;
        let gradient = &self.normal.gradient + &moved;
        let squares = self.normal.squares
            + self.normal.gradient.select_rows(&columns).dot(&values)
            + gradient.select_rows(&columns).dot(&values);
        let kept: Vec<usize> =
            (0..self.free_parameters).filter(|free_parameter| !columns.contains(free_parameter)).collect();
        let count = self.normal.matrix.nrows() - self.free_parameters;
        let taken = self.normal.matrix.select_columns(&kept);
        let factor = RankRevealingCholesky::new(&taken.select_rows(&kept));
        let shadow = factor.whiten(&taken.rows(self.free_parameters, count).transpose());
        let own = gradient.select_rows(&kept);
        let known = factor.whiten(&DMatrix::from_column_slice(kept.len(), 1, own.as_slice()));
        Rest {
            left: self.normal.matrix.view((self.free_parameters, self.free_parameters), (count, count))
                - shadow.tr_mul(&shadow),
            gradient: gradient.rows(self.free_parameters, count) - shadow.tr_mul(&known).column(0),
            squares: squares - known.norm_squared(),
            gone: self.rank - factor.rank() as f64,
        }
    }
}

impl Rest {
    /// Products of two candidates beyond what is fitted.
    fn block(&self, (one, other): (usize, usize), linear: &LinearModel) -> DMatrix<f64> {
        let [rows, columns] = [one, other].map(|index| linear.columns[index].range.clone());
        let first = (rows.start - linear.free_parameters, columns.start - linear.free_parameters);
        self.left.view(first, (rows.len(), columns.len())).into_owned()
    }

    /// Of a candidate with the residuals.
    fn part(&self, index: usize, linear: &LinearModel) -> DVector<f64> {
        let range = linear.columns[index].range.clone();
        self.gradient.rows(range.start - linear.free_parameters, range.len()).into_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::two_links;
    use plumb_calibration::effect::{Site, build};
    use plumb_estimation::{Random, bic};

    const EQUATIONS: usize = 40;

    /// Random derivatives of one fitted number, of a member and of three candidates, and random readings.
    struct Drawn {
        jacobian: DMatrix<f64>,
        readings: DVector<f64>,
    }

    impl Drawn {
        fn new() -> Self {
            let mut random = Random::seeded(3);
            let jacobian = DMatrix::from_fn(5, EQUATIONS, |_, _| 100.0 * random.normal());
            // Made of two candidates, a little of the others, and noise.
            let mix = DVector::from_row_slice(&[0.01, 0.004, 0.02, -0.015, 0.0]);
            let noise = DVector::from_fn(EQUATIONS, |_, _| 0.2 * random.normal());
            Self { readings: jacobian.tr_mul(&mix) + noise, jacobian }
        }

        /// Least squares with these lines of the derivatives: what is left, and the values.
        fn solved(&self, lines: &[usize]) -> (f64, DVector<f64>) {
            let used = self.jacobian.select_rows(lines);
            let values = (&used * used.transpose()).cholesky().unwrap().solve(&(&used * &self.readings));
            ((&self.readings - used.tr_mul(&values)).norm_squared(), values)
        }

        /// The linear model at the fit of the first number and the member.
        fn model(&self) -> LinearModel {
            let (_, values) = self.solved(&[0, 1]);
            let residuals = &self.readings - self.jacobian.rows(0, 2).tr_mul(&values);
            let mut normal = NormalEquations::zeros(5);
            normal.take(residuals.as_slice(), &self.jacobian);
            let lab = two_links(20, "joint_zero(*)", 0.02, 45, |_| [0.0; 2]);
            let ids = ["joint_gain", "joint_gain", "joint_backlash"].into_iter().zip([0, 1, 1]);
            let columns = ids.enumerate().map(|(number, (name, joint))| {
                let id = EffectId::at(name, Site::Joint(joint));
                let effect = build(&id, lab.model()).unwrap();
                Column { id, effect, range: 2 + number..3 + number, search_cost: 0.0 }
            });
            let columns = columns.collect();
            let id = EffectId::at("joint_settling", Site::Joint(0));
            let members = vec![Member { id, columns: vec![1], values: vec![values[1]], search_cost: 3.0 }];
            LinearModel::new(normal, members, columns, (2.0, 0.0))
        }
    }

    #[test]
    fn values_that_no_machine_has_are_implausible_and_so_is_a_candidate_that_is_not_there() {
        let model = Drawn::new().model();
        let plausible =
            |index: usize, value: f64| model.is_plausible(index, &DVector::from_element(1, value));
        assert!(plausible(0, 0.001) && !plausible(0, 0.9), "a gain of nine tenths");
        assert!(plausible(2, 1e-4) && !plausible(3, 1e-4));
    }

    #[test]
    fn every_set_has_the_squares_and_values_of_a_regression_on_it() {
        let drawn = Drawn::new();
        let model = drawn.model();
        let proposals = model.proposals(f64::INFINITY);
        let mut sizes = [0; 3];
        for proposal in &proposals {
            let lines: Vec<usize> =
                std::iter::once(0).chain(proposal.added.iter().map(|(index, _)| 2 + index)).collect();
            let (squares, values) = drawn.solved(&lines);
            let expected = bic(squares, EQUATIONS as f64, lines.len() as f64, 0.0);
            assert!((proposal.criterion - expected).abs() < 1e-6, "{proposal:?} {expected}");
            for ((_, own), expected) in proposal.added.iter().zip(values.iter().skip(1)) {
                assert!((own[0] - expected).abs() < 1e-9, "{proposal:?} {values}");
            }
            sizes[proposal.added.len()] += 1;
        }
        // A candidate alone, and each with its best partner, are there only where their values are those of a machine.
        assert_eq!(sizes[0], 1, "{proposals:?}");
        assert!(sizes[1] > 0 && sizes[2] > 0, "{proposals:?}");
        let best = &proposals[0];
        assert_eq!(best.candidates(), [0, 1].into());
    }

    #[test]
    fn effects_are_charged_for_their_choice_and_the_members_search_is_saved() {
        let drawn = Drawn::new();
        let mut model = drawn.model();
        assert_eq!(model.search_costs(), 3.0);
        // Each of the first of its kind among four candidates; the second of two gains among these.
        let [first, second] = [4.0_f64, 2.0].map(|count| 2.0 * count.ln());
        for proposal in model.proposals(f64::INFINITY) {
            let more = proposal.added.len() as f64 - 1.0;
            let of_one_kind = proposal.candidates() == [0, 1].into();
            let expected = if of_one_kind { second } else { more * first };
            assert!((proposal.choice - expected).abs() < 1e-12, "{proposal:?}");
            assert_eq!((proposal.search_costs, proposal.parameters), (0.0, 2.0 + more));
        }
        // Only what betters the criterion by more than its price is proposed.
        let best = model.proposals(f64::INFINITY).swap_remove(0);
        let price = best.price();
        assert_eq!(model.proposals(price + 1e-9).len(), 1);
        assert!(model.proposals(price - 1e-9).is_empty());
        // A search of its own is charged.
        model.columns.iter_mut().for_each(|column| column.search_cost = 5.0);
        let dearer = model.proposals(f64::INFINITY).swap_remove(0);
        assert!((dearer.criterion - best.criterion - 10.0).abs() < 1e-9 && dearer.search_costs == 10.0);
    }
}
