//! Which candidates act at once. On a real machine several effects do: one of them alone, weighed against another alone, is weighed by what both lack. So sets of
//! candidates are compared, grown one by one from the likeliest few and improved by exchanges; those about as likely as the best make up Occam's window (Madigan &
//! Raftery 1994, Journal of the American Statistical Association 89, 1535; Hoeting et al. 1999 on averaging over it).

use std::collections::{BTreeMap, BTreeSet};

use super::bench::{Bench, Set};
use super::posterior::posterior;
use crate::thresholds::{EVIDENCE_SET, TIE_BIC};
use plumb_estimation::for_each;

/// Sets of one size that are grown further.
const GROWN: usize = 3;

/// Candidates that are tried beside a set, or in place of one of its members: those that promise most while the flexible part keeps its variances.
const TRIED: usize = 4;

/// Times that exchanges are tried.
const EXCHANGES: usize = 2;

/// Rounds of estimating the flexible part's variances for a set that is tried; those near the best get as many as they need.
const FIRST_ROUNDS: usize = 4;
const LAST_ROUNDS: usize = 16;

/// How near, in [`TIE_BIC`].
const NEAR: f64 = 3.0;

/// Sets that were weighed, the likeliest first.
pub(super) struct Sets {
    pub(super) all: Vec<Set>,
}

/// Sets by their members, as far as they were weighed.
struct Search<'b> {
    bench: &'b Bench<'b>,
    known: BTreeMap<Vec<usize>, Option<Set>>,
}

impl Search<'_> {
    /// Weighs sets that were not weighed yet, each from the variances of another.
    fn weigh(&mut self, tried: BTreeMap<Vec<usize>, Vec<f64>>) {
        let new: Vec<(Vec<usize>, Vec<f64>)> =
            tried.into_iter().filter(|(members, _)| !self.known.contains_key(members)).collect();
        let bench = self.bench;
        // Few rounds do to rank a set; the variances of a set that differs by one member are a good start.
        let sets = for_each(&new, |(members, start)| bench.fitted(members, start, FIRST_ROUNDS));
        self.known.extend(new.into_iter().map(|(members, _)| members).zip(sets));
    }

    fn ranked(&self, size: impl Fn(usize) -> bool) -> Vec<&Set> {
        let mut sets: Vec<&Set> =
            self.known.values().flatten().filter(|set| size(set.members.len())).collect();
        sets.sort_by(|left, right| left.criterion.total_cmp(&right.criterion));
        sets
    }

    /// The sets with one more member that promise most.
    fn wider(&self, set: &Set) -> Vec<Vec<usize>> {
        let Some(evidence) = self.bench.mixed.evidence_at(&set.fit.ratios) else { return Vec::new() };
        let others = (0..self.bench.candidates.len()).filter(|one| !set.members.contains(one));
        let mut promised: Vec<(f64, Vec<usize>)> = others
            .map(|other| {
                // Ascending, so that one set has one name however it was reached.
                let members: BTreeSet<usize> = set.members.iter().copied().chain([other]).collect();
                let members: Vec<usize> = members.into_iter().collect();
                let (deviance, rank) = evidence.deviance(&self.bench.parameters(&members));
                (self.bench.criterion(&members, deviance, rank), members)
            })
            .collect();
        promised.sort_by(|left, right| left.0.total_cmp(&right.0));
        promised.into_iter().take(TRIED).map(|(_, members)| members).collect()
    }

    /// Grows the likeliest sets by one member at a time, as long as that makes the rows likelier.
    fn grow(&mut self) {
        for size in 1..EVIDENCE_SET {
            let mut tried = BTreeMap::new();
            for set in self.ranked(|count| count == size).into_iter().take(GROWN) {
                tried.extend(self.wider(set).into_iter().map(|members| (members, set.fit.ratios.clone())));
            }
            self.weigh(tried);
            let [narrow, wide] = [size, size + 1].map(|count| {
                self.ranked(|one| one == count).first().map_or(f64::INFINITY, |set| set.criterion)
            });
            if wide > narrow {
                break;
            }
        }
    }

    /// Leaves out each member of the likeliest set in turn, and tries others in its place.
    fn exchange(&mut self) -> bool {
        let Some(best) = self.ranked(|_| true).first().map(|set| (*set).clone()) else { return false };
        let smaller = best.members.iter().map(|member| {
            let others = best.members.iter().copied().filter(|other| other != member);
            others.collect::<Vec<usize>>()
        });
        let smaller: Vec<Vec<usize>> = smaller.collect();
        self.weigh(smaller.iter().map(|members| (members.clone(), best.fit.ratios.clone())).collect());
        let mut tried = BTreeMap::new();
        for members in &smaller {
            if let Some(Some(set)) = self.known.get(members) {
                tried.extend(self.wider(set).into_iter().map(|members| (members, set.fit.ratios.clone())));
            }
        }
        self.weigh(tried);
        self.ranked(|_| true).first().is_some_and(|now| now.members != best.members)
    }

    /// The sets near the best, with variances as good as those of any other.
    fn settled(self) -> Sets {
        let best = self.ranked(|_| true).first().map_or(f64::INFINITY, |set| set.criterion);
        let bench = self.bench;
        let all: Vec<Set> = self.known.into_values().flatten().collect();
        let mut all = for_each(&all, |set| match set.criterion < best + NEAR * TIE_BIC {
            true => bench.fitted(&set.members, &set.fit.ratios, LAST_ROUNDS).unwrap_or_else(|| set.clone()),
            false => set.clone(),
        });
        all.sort_by(|left, right| left.criterion.total_cmp(&right.criterion));
        Sets { all }
    }
}

impl Sets {
    /// Searches among the candidates of a stage.
    pub(super) fn search(bench: &Bench<'_>) -> Self {
        let nothing =
            Set { members: Vec::new(), fit: bench.nothing.clone(), criterion: bench.nothing.deviance };
        let mut search = Search { bench, known: BTreeMap::from([(Vec::new(), Some(nothing))]) };
        let alone = (0..bench.candidates.len()).map(|one| (vec![one], bench.nothing.ratios.clone()));
        search.weigh(alone.collect());
        search.grow();
        for _ in 0..EXCHANGES {
            if !search.exchange() {
                break;
            }
        }
        search.settled()
    }

    /// The likeliest set without a candidate, among those that have all other members of `beside`.
    pub(super) fn without(&self, candidate: usize, beside: &Set) -> Option<&Set> {
        let rest = beside.members.iter().copied().filter(|one| *one != candidate);
        let rest: Vec<usize> = rest.collect();
        self.all.iter().find(|set| set.members == rest)
    }

    /// Posterior probability that each candidate is at work: that of all sets it is in, every set as likely before but for what its choice is charged.
    pub(super) fn inclusion(&self, candidates: usize) -> Vec<f64> {
        let criteria: Vec<f64> = self.all.iter().map(|set| set.criterion).collect();
        let mut found = vec![0.0; candidates];
        for (set, likely) in self.all.iter().zip(posterior(&criteria)) {
            for member in &set.members {
                found[*member] += likely;
            }
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mechanism_test::tests::{wave, with_wave_in};

    #[test]
    fn an_exchange_finds_what_growing_from_the_wrong_effect_does_not_reach() {
        // A wave and a gain are at work; known is the set of two that are not, as if they had been taken first.
        let off = |q: [f64; 2]| [0.004 * q[0], wave(q[1])];
        let beside = ["joint_gain(shoulder)", "joint_harmonic(elbow, 5)", "joint_harmonic(shoulder, 7)"];
        with_wave_in(&beside, off, |bench, _| {
            let mut search = Search { bench, known: BTreeMap::new() };
            let index = |text: &str| {
                let label = |one: usize| bench.stage.fitted.problem.model.label(&bench.candidates[one].id);
                (0..bench.candidates.len()).find(|one| label(*one) == text).unwrap()
            };
            let mut wrong = vec![index("joint_harmonic(elbow, 5)"), index("joint_harmonic(shoulder, 7)")];
            wrong.sort_unstable();
            search.weigh(BTreeMap::from([(wrong.clone(), bench.nothing.ratios.clone())]));
            assert!(search.exchange(), "one of the two is better exchanged");
            assert!(search.exchange(), "and the other");
            let best = search.ranked(|_| true)[0].members.clone();
            let right = [index("joint_harmonic(elbow, 12)"), index("joint_gain(shoulder)")];
            assert!(right.iter().all(|one| best.contains(one)), "{best:?} for {right:?}");
            assert!(!search.exchange(), "nothing is better than what is at work");
        });
    }
}
