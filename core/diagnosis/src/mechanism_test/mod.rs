//! Whether an effect is a mechanism although other structure is left that nothing explains. The structure is given its own part of the model, the flexible regression
//! of `explainable/`; an effect is identified where the rows are much likelier with it than with anything else beside that part: no effect at all, every other effect
//! of the library, mechanisms without a name. Models are compared by their marginal likelihood (Rasmussen & Williams 2006, chapter 5), effects charged as by
//! Schwarz's criterion, which is a Bayes factor for a prior worth one reading (Kass & Wasserman 1995; Kass & Raftery 1995).

mod bench;
mod left_out_geometry;
mod predictions;
mod suspects;

use crate::explainable::{Features, Mixed, MixedFit, chosen_rows};
use crate::forward_selection::{Contender, Stage};
use crate::score_test::Probe;
use crate::thresholds::{EVIDENCE_ROWS, NAMING_LEVEL, SITE_LEFT, SIZE_ERRORS, TIE_BIC};
pub(crate) use left_out_geometry::{GEOMETRY, explains_as_well};

use bench::{Bench, Weighed};
use nalgebra::DMatrix;
use plumb_calibration::effect::{Effect, EffectId, Family, Spot, kind};
use plumb_estimation::chi_squared_tail;
use predictions::Predictions;
use suspects::{Who, suspects};

/// Why the likeliest effect is not identified.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Doubt {
    /// Some smooth function of what is known of a row does as well.
    Smooth,
    /// A mechanism without a name does, or is at work at the same joint.
    Unlisted(Spot),
    /// At its joint more is left than so large an effect would leave.
    MoreAtItsJoint,
    /// Rows that were left out are predicted as well without it.
    NotPredicted,
    /// Its size, or sign, is beyond belief, or another beside the flexible part.
    Size,
    /// With every row in, or rows left out, it does not pass without the flexible part.
    NotPassed,
}

/// What the rows say of the contenders of a stage beside a flexible part.
pub(crate) struct Mechanism {
    /// Contenders that cannot be told apart, by their places in the stage's list, the likeliest first.
    pub(crate) close: Vec<usize>,
    /// Nothing where the likeliest is identified, or tied with the others of `close` alone.
    pub(crate) doubt: Option<Doubt>,
    /// Posterior probability of each contender that was asked, among them, mechanisms without a name, and none at all.
    pub(crate) probabilities: Vec<(usize, f64)>,
    /// The likeliest, as it is beside the flexible part.
    best: MixedFit,
}

impl Bench<'_> {
    /// What is left at the joint of an effect with it in, as a share of what it explains: what the flexible part does there, and by how much more is left along
    /// the joint's motion than across it.
    fn share_left_at(&self, joint: usize, best: &MixedFit) -> f64 {
        let own = self.features.joints.iter().zip(&best.by_component);
        let smooth: f64 = own.filter(|(at, _)| **at == Some(joint)).map(|(_, squares)| squares).sum();
        let (along, across) = self.along_and_across(joint, best);
        (smooth + (along - across).max(0.0)) / best.explained.max(f64::MIN_POSITIVE)
    }

    /// Sums of squares of what everything leaves along a joint's motion, and across it in each other direction.
    fn along_and_across(&self, joint: usize, best: &MixedFit) -> (f64, f64) {
        let left = self.mixed.residuals(best);
        let Some(Some(carrier)) = self.features.carriers.get(joint) else { return (0.0, 0.0) };
        let mut sums = (0.0, 0.0);
        for range in &self.features.equations {
            let way = carrier.rows(range.start, range.len());
            let own = left.rows(range.start, range.len());
            let length = way.norm();
            if range.len() < 2 || length < 1e-9 {
                continue;
            }
            let along = (way.dot(&own) / length).powi(2);
            sums.0 += along;
            sums.1 += (own.norm_squared() - along) / (range.len() as f64 - 1.0);
        }
        sums
    }

    /// A mechanism without a name that explains the same, or that is at work at the same joint.
    fn stranger(&self, best: &Weighed<'_>, all: &[Weighed<'_>]) -> Option<Spot> {
        let at_same = |spot: Spot| spot == best.suspect.id.spot && is_of_a_joint(&best.suspect.id);
        let strangers = all.iter().filter_map(|one| match one.suspect.who {
            Who::Unlisted(spot) => Some((one, spot)),
            Who::Listed(_) => None,
        });
        for (stranger, spot) in strangers {
            let rivals = stranger.criterion < best.criterion + TIE_BIC;
            if !rivals && !at_same(spot) {
                continue;
            }
            let both = [best.suspect.parameters.as_slice(), &stranger.suspect.parameters].concat();
            let Some(pair) = self.mixed.fit(&both, Some(&self.nothing.ratios)) else { continue };
            let criterion = self.criterion(&pair, best.suspect.cost + stranger.suspect.cost);
            let explains_same = rivals && stranger.criterion - criterion < TIE_BIC;
            let beside = best.criterion - criterion > TIE_BIC
                && pair.explained - best.fit.explained > SITE_LEFT * best.fit.explained;
            if explains_same || (at_same(spot) && beside) {
                return Some(spot);
            }
        }
        None
    }

    /// Whether the size beside the flexible part is that of a real machine, and the same as without that part within what blocks of rows differ by.
    fn has_steady_size(&self, effect: &dyn Effect, best: &MixedFit, told: &Predictions) -> bool {
        let size = |values: &[f64], covariance: &DMatrix<f64>| effect.size(values, covariance).value;
        let (flexible, plain) = (
            size(best.values.as_slice(), &best.covariance),
            size(told.plain.values.as_slice(), &told.plain.covariance),
        );
        let one = effect.size(best.values.as_slice(), &best.covariance).error;
        let scatter = |values: &[Vec<f64>]| {
            predictions::jackknife(values.iter().map(|one| size(one, &best.covariance)))
        };
        let error =
            (one.powi(2) + scatter(&told.values).powi(2) + scatter(&told.plain_values).powi(2)).sqrt();
        let possible =
            effect.parameters().iter().zip(best.values.iter()).enumerate().all(|(index, (one, value))| {
                let reach = 2.0 * best.covariance[(index, index)].max(0.0).sqrt();
                (one.range.0 - reach..=one.range.1 + reach).contains(value)
            });
        possible && (flexible - plain).abs() <= SIZE_ERRORS * error
    }

    fn doubt(&self, best: &Weighed<'_>, all: &[Weighed<'_>], families: f64) -> Option<Doubt> {
        let passes = self.contender(best).is_some_and(Contender::passes);
        let fit = &best.fit;
        let chance =
            chi_squared_tail(wald(fit), fit.rank as f64) * families * (0.5 * best.suspect.cost).exp();
        if !passes || chance >= NAMING_LEVEL {
            return Some(Doubt::NotPassed);
        }
        if self.nothing.deviance - best.criterion < TIE_BIC {
            return Some(Doubt::Smooth);
        }
        if let Some(spot) = self.stranger(best, all) {
            return Some(Doubt::Unlisted(spot));
        }
        let joint = best.suspect.id.joint().filter(|_| is_of_a_joint(&best.suspect.id));
        let at_same = |id: &EffectId| id.spot == best.suspect.id.spot && is_of_a_joint(id);
        if joint.is_some() && self.stage.taken.iter().any(|taken| at_same(&taken.id)) {
            return Some(Doubt::MoreAtItsJoint);
        }
        if joint.is_some_and(|joint| self.share_left_at(joint, fit) > SITE_LEFT) {
            return Some(Doubt::MoreAtItsJoint);
        }
        let Some(told) = Predictions::of(self, best) else { return Some(Doubt::NotPredicted) };
        if !told.predicts {
            return Some(Doubt::NotPredicted);
        }
        let model = self.stage.fitted.machine.model;
        let steady = plumb_calibration::effect::build(&best.suspect.id, model)
            .is_ok_and(|effect| self.has_steady_size(effect.as_ref(), fit, &told));
        (!steady).then_some(Doubt::Size)
    }
}

/// Directions tell of rotations about joints.
fn is_of_a_joint(id: &EffectId) -> bool {
    kind(&id.name).is_some_and(|kind| kind.family == Family::Joint)
}

/// Wald's statistic of a fit's parameters: their squares in units of their covariance.
fn wald(fit: &MixedFit) -> f64 {
    let eigen = fit.covariance.clone().symmetric_eigen();
    let largest = eigen.eigenvalues.iter().copied().fold(0.0, f64::max);
    let pairs = eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter());
    pairs
        .filter(|(value, _)| **value > 1e-12 * largest)
        .map(|(value, vector)| vector.dot(&fit.values).powi(2) / value)
        .sum()
}

/// Probabilities in proportion to marginal likelihoods, from criteria (twice their negative logarithms).
pub(crate) fn posterior(criteria: &[f64]) -> Vec<f64> {
    let least = criteria.iter().copied().fold(f64::INFINITY, f64::min);
    let weights: Vec<f64> = criteria.iter().map(|one| (-0.5 * (one - least)).exp()).collect();
    let total: f64 = weights.iter().sum();
    weights.into_iter().map(|one| one / total).collect()
}

impl Mechanism {
    /// Asks the contenders of a stage; nothing where too few rows are left over to ask, or none of them is plausible.
    pub(crate) fn of(stage: &Stage<'_>, unlisted: &[Probe]) -> Option<Self> {
        let (machine, fit) = (&stage.fitted.machine, &stage.fitted.fit);
        let rows = chosen_rows(machine, fit, EVIDENCE_ROWS);
        let features = Features::of(machine, fit, &rows);
        let (suspects, columns) = suspects(stage, unlisted, &rows);
        // A flexible part that could follow every reading would hide what a mechanism leaves at its joint.
        if features.design.ncols() >= columns.nrows() {
            return None;
        }
        let mixed = Mixed::new(&features, &columns)?;
        let nothing = mixed.fit(&[], None)?;
        let bench = Bench { stage, rows, features, mixed, nothing, equations: columns.nrows() as f64 };
        let weighed = bench.weigh(&suspects);
        let plausible = |one: &&Weighed<'_>| bench.contender(one).is_some_and(Contender::is_plausible);
        let best = weighed.iter().find(plausible)?;
        let near = |one: &&Weighed<'_>| plausible(one) && one.criterion - best.criterion < TIE_BIC;
        let index = |one: &Weighed<'_>| match one.suspect.who {
            Who::Listed(index) => Some(index),
            Who::Unlisted(_) => None,
        };
        let close = weighed.iter().filter(near).filter_map(index).collect();
        let doubt = bench.doubt(best, &weighed, stage.contenders.len() as f64);
        let rivals: Vec<&Weighed<'_>> =
            weighed.iter().filter(|one| index(one).is_none() || plausible(one)).collect();
        let mut criteria: Vec<f64> = rivals.iter().map(|one| one.criterion).collect();
        criteria.push(bench.nothing.deviance);
        let likely = posterior(&criteria);
        let probabilities =
            rivals.iter().zip(likely).filter_map(|(one, likely)| Some((index(one)?, likely))).collect();
        Some(Self { close, doubt, probabilities, best: best.fit.clone() })
    }

    /// Gives the likeliest contender the values it has beside the flexible part.
    pub(crate) fn take_values(&self, contenders: &mut [Contender]) {
        if let Some(contender) = self.close.first().and_then(|index| contenders.get_mut(*index)) {
            contender.values = self.best.values.as_slice().to_vec();
            contender.covariance = self.best.covariance.clone();
        }
    }
}

#[cfg(test)]
mod tests;
