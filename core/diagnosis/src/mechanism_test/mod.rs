//! Whether an effect is a mechanism although other structure is left that nothing explains. The structure is given its own part of the model, the flexible regression
//! of `explainable/`; what may act besides, effects of the library and mechanisms without a name, is weighed in sets (`sets.rs`). An effect is identified where the
//! rows are much likelier with it than with anything in its place: nothing, any other effect of the library, a mechanism without a name. Models are compared by their
//! marginal likelihood (Rasmussen & Williams 2006, chapter 5), effects charged as by Schwarz's criterion, which is a Bayes factor for a prior worth one reading (Kass &
//! Wasserman 1995; Kass & Raftery 1995).

mod asked;
mod bench;
mod left_out_geometry;
mod linearization;
mod own_fits;
mod posterior;
mod predictions;
mod rules;
mod sets;

use crate::block_errors::jackknife;
use crate::explainable::{Features, Mixed, chosen_rows};
use crate::fitted::Fitted;
use crate::forward_selection::{FittedCandidate, Stage};
use crate::score_test::Probe;
use crate::thresholds::{EVIDENCE_ROWS, NAMING_LEVEL, SITE_LEFT, TIE_BIC};
pub(crate) use left_out_geometry::{GEOMETRY, explains_as_well};
pub(crate) use posterior::posterior;

use asked::{Asked, Who, candidates};
use bench::{Bench, Foremost, Set};
use linearization::Linearization;
use nalgebra::{DMatrix, DVector, DVectorView};
use plumb_calibration::effect::{Effect, EffectId, Family, Site, build, kind};
use plumb_estimation::chi_squared_tail;
use predictions::{Predictions, errors_by_blocks};
use sets::Sets;

/// Why the foremost effect is not identified.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Doubt {
    /// Some smooth function of what is known of a row does as well.
    Smooth,
    /// A mechanism without a name does, or is at work at the same joint.
    Unlisted(Site),
    /// At its joint more is left than so large an effect would leave.
    MoreAtItsJoint,
    /// Rows that were left out are predicted as well without it.
    NotPredicted,
    /// Its size, or sign, is beyond belief, or quite another without the flexible part.
    Size,
    /// With every row in it does not pass, or chance does as much.
    NotPassed,
}

/// What the rows say of the fitted candidates of a stage beside a flexible part.
pub(crate) struct Mechanism {
    /// Fitted candidates that cannot be distinguished, by their indices in the stage's list, the foremost first.
    pub(crate) close: Vec<usize>,
    /// Nothing where the foremost is identified, or tied with the others of `close` alone.
    pub(crate) doubt: Option<Doubt>,
    /// Posterior probability of each fitted candidate that was asked.
    pub(crate) probabilities: Vec<(usize, f64)>,
    /// Criterion of the set in which the foremost was asked: twice the negative logarithm of its marginal likelihood.
    criterion: f64,
    /// Values of the foremost and their covariance, as they are beside the flexible part.
    values: (DVector<f64>, DMatrix<f64>),
    /// Their standard errors as blocks of rows have them; empty where nothing is reported, or too little is left without a block.
    block_errors: Vec<f64>,
}

#[cfg(test)]
impl Mechanism {
    /// One made by hand: these are close, and this speaks against the foremost.
    pub(crate) fn made(close: Vec<usize>, doubt: Option<Doubt>) -> Self {
        let values = (DVector::zeros(1), DMatrix::zeros(1, 1));
        Self { close, doubt, probabilities: Vec::new(), criterion: 0.0, values, block_errors: Vec::new() }
    }
}

/// What would do in place of the foremost candidate of the likeliest set.
#[derive(Default)]
struct Rivals {
    /// Effects of the library.
    listed: Vec<usize>,
    /// Where a mechanism without a name would sit.
    unlisted: Option<Site>,
    /// The flexible part does.
    smooth: bool,
    /// Also without its functions of the foremost's own kind.
    smooth_apart: bool,
}

/// A row whose readings move by less than this (sigmas a radian or mm) says nothing of a joint: one on whose axis the point is.
const LEAST_MOTION: f64 = 1e-9;

/// Squares of what the readings of a row leave along the way in which they move, and across it for each direction, so that a point in space, with two directions across,
/// is comparable. Nothing of a single reading, which has no direction across, and where nothing moves.
fn along_and_across(way: DVectorView<'_, f64>, own: DVectorView<'_, f64>) -> Option<(f64, f64)> {
    let length = way.norm();
    if way.len() < 2 || length < LEAST_MOTION {
        return None;
    }
    let along = (way.dot(&own) / length).powi(2);
    Some((along, (own.norm_squared() - along) / (way.len() as f64 - 1.0)))
}

impl Bench<'_> {
    /// What else is at the joint of a candidate, as a fraction of what that explains: whatever smooth functions of the joint do there if they are the whole flexible part, so that
    /// none of them makes up for another part, and by how much more everything leaves along the joint's motion than across it.
    fn fraction_left_at(&self, joint: usize, set: &Set, candidate: usize) -> Option<f64> {
        let own = self.components_at(joint);
        // With the other components given up the ones at this joint must take all that is there.
        let alone = self.mixed.fit(&self.parameters(&set.members), Some(&self.mixed.ratios_of(&own)))?;
        let smooth = self.mixed.squares_of_components(&alone, &own);
        let (along, across) = self.along_and_across(joint, set);
        let explained = self.explained(&alone, candidate).max(f64::MIN_POSITIVE);
        Some((smooth + (along - across).max(0.0)) / explained)
    }

    /// What the flexible part does beside a candidate, as a fraction of what that explains.
    fn fraction_left(&self, set: &Set, candidate: usize) -> f64 {
        let all: Vec<usize> = (0..self.features.joints.len()).collect();
        let explained = self.explained(&set.fit, candidate).max(f64::MIN_POSITIVE);
        self.mixed.squares_of_components(&set.fit, &all) / explained
    }

    /// Sums of squares of what everything leaves along a joint's motion, and across it in each other direction.
    fn along_and_across(&self, joint: usize, set: &Set) -> (f64, f64) {
        let left = self.mixed.residuals(&set.fit);
        let Some(Some(carrier)) = self.features.carriers.get(joint) else { return (0.0, 0.0) };
        let mut sums = (0.0, 0.0);
        for range in &self.features.equations {
            let way = carrier.rows(range.start, range.len());
            let own = left.rows(range.start, range.len());
            if let Some((along, across)) = along_and_across(way, own) {
                sums.0 += along;
                sums.1 += across;
            }
        }
        sums
    }

    /// What takes the place of `foremost` in sets that are about as likely as its own: whatever is new there and takes nearly as much from what is left, else the
    /// flexible part.
    fn rivals(&self, asked: &Foremost<'_>, sets: &Sets) -> Rivals {
        let (foremost, own) = (asked.member, asked.set);
        let mut rivals = Rivals::default();
        let others = sets.all.iter().take_while(|set| set.criterion < own.criterion + TIE_BIC);
        for set in others.filter(|set| !set.members.contains(&foremost)) {
            let new = set.members.iter().copied().filter(|one| !own.members.contains(one));
            let instead =
                self.foremost(new).filter(|one| rules::is_close_to(self.gain(*one), self.gain(foremost)));
            match instead.and_then(|one| Some((one, self.candidates.get(one)?))) {
                Some((one, candidate)) => match candidate.who {
                    Who::Unlisted(site) => rivals.unlisted = Some(site),
                    Who::Listed(_) if self.is_plausible(one) && !rivals.listed.contains(&one) => {
                        rivals.listed.push(one);
                    }
                    Who::Listed(_) => {}
                },
                None => {
                    rivals.smooth = true;
                    rivals.smooth_apart = rivals.smooth_apart || self.is_as_likely_smooth(asked, set);
                }
            }
        }
        rivals
    }

    /// Whether the rows are about as likely with a set in which the flexible part stands for `foremost`, also without the functions of that effect's own kind at its joint.
    fn is_as_likely_smooth(&self, asked: &Foremost<'_>, set: &Set) -> bool {
        if asked.own_functions.is_empty() {
            return true;
        }
        let ratios = set.fit.ratios_without(&asked.own_functions);
        self.is_below(asked.set.criterion + TIE_BIC, set, &ratios)
    }

    /// Whether something else is at work at the joint of a set's foremost, and explains more than [`SITE_LEFT`] of what that does: another of the set, or overtones of a wave.
    /// Asked of what bends, and of what functions of its own kind hold for a mechanism without a name alone: a gap where teeth are worn is no play that is the same everywhere.
    fn company(&self, asked: &Foremost<'_>, bends: bool) -> Option<Doubt> {
        let (foremost, set) = (asked.member, asked.set);
        let candidate = self.candidates.get(foremost)?;
        if !bends && asked.own_functions.is_empty() {
            return None;
        }
        let most = SITE_LEFT * self.explained(&set.fit, foremost);
        let others = set.members.iter().filter(|one| **one != foremost);
        let mut others = others.filter_map(|one| Some((*one, self.candidates.get(*one)?)));
        let at_same = others.find(|(one, other)| {
            let asked = match other.who {
                Who::Unlisted(_) => true,
                Who::Listed(_) => bends && is_of_a_joint(&other.id),
            };
            asked && other.id.site == candidate.id.site && self.explained(&set.fit, *one) > most
        });
        if let Some((_, other)) = at_same {
            return Some(match other.who {
                Who::Unlisted(site) => Doubt::Unlisted(site),
                Who::Listed(_) => Doubt::MoreAtItsJoint,
            });
        }
        let overtones = self.overtones.iter().find(|(wave, _)| wave.same_as(&candidate.id))?;
        let parameters = [self.parameters(&set.members), overtones.1.clone()].concat();
        let with = self.mixed.fit(&parameters, Some(&set.fit.ratios))?;
        // The overtones are asked together: a worn tooth has all of them.
        let reduction = set.fit.deviance - with.deviance;
        let asked =
            reduction - (with.rank - set.fit.rank.min(with.rank)) as f64 * self.equations.ln() > TIE_BIC;
        (asked && self.mixed.squares_of(&with, &overtones.1) > most)
            .then_some(Doubt::Unlisted(candidate.id.site))
    }

    /// Whether a size beside the flexible part is that of a real machine, and much the same without that part: within what blocks of rows differ by, or within a fraction of itself.
    fn has_steady_size(
        &self,
        effect: &dyn Effect,
        values: &(DVector<f64>, DMatrix<f64>),
        predictions: &Predictions,
    ) -> bool {
        let (values, covariance) = values;
        let flexible = effect.size(values.as_slice(), covariance);
        let plain = effect.size(&predictions.plain, covariance).value;
        // What is left is no independent noise: blocks of rows say how far a size moves, where the fit's own error is too small.
        let [beside, alone] = [&predictions.values, &predictions.plain_values]
            .map(|values| jackknife(values.iter().map(|values| effect.size(values, covariance).value)));
        let error = flexible.error.hypot(beside).hypot(alone);
        let possible =
            effect.parameters().iter().zip(values.iter()).enumerate().all(|(index, (one, value))| {
                let reach = 2.0 * covariance[(index, index)].max(0.0).sqrt();
                (one.range.0 - reach..=one.range.1 + reach).contains(value)
            });
        possible && rules::is_steady(flexible.value, plain, error)
    }

    /// What is to be said against the foremost of a set.
    fn doubt(&self, asked: &Foremost<'_>, sets: &Sets, rivals: &Rivals) -> Option<Doubt> {
        let (foremost, set) = (asked.member, asked.set);
        let (Some(fitted_candidate), Some(candidate)) =
            (self.fitted_candidate(foremost), self.candidates.get(foremost))
        else {
            return Some(Doubt::NotPassed);
        };
        let values = self.values(set, foremost);
        let (wald, rank) = wald(&values);
        let chance = rules::chance_among(chi_squared_tail(wald, rank), self.families(), candidate.cost);
        if fitted_candidate.outvoted || chance >= NAMING_LEVEL {
            return Some(Doubt::NotPassed);
        }
        if let Some(site) = rivals.unlisted {
            return Some(Doubt::Unlisted(site));
        }
        let predictions =
            sets.without(foremost, set).and_then(|without| Predictions::of(self, asked, without));
        let gain = predictions.as_ref().map_or(0.0, |predictions| predictions.gain);
        let beside = predictions.as_ref().map_or(0.0, |predictions| predictions.gain_beside);
        // What a smooth function explains as well in rows that were seen is none if it predicts unseen ones much worse: there it knows nothing, and the effect does.
        let beats_smooth = rules::beats_smooth(gain);
        if rivals.smooth_apart && !beats_smooth {
            return Some(Doubt::Smooth);
        }
        // One that can imitate anything at its joint, or that does no better than functions of its own kind, may be no more than the greater part of something else there.
        let no_better =
            !asked.own_functions.is_empty() && (rivals.smooth && !beats_smooth || !rules::predicts(beside));
        let bends = imitates(&candidate.id) || no_better;
        if let Some(company) = self.company(asked, bends) {
            return Some(company);
        }
        let joint = candidate.id.joint().filter(|_| is_of_a_joint(&candidate.id));
        // What has no joint to be judged at is judged by everything else. Several numbers, as those of gravity without masses, bend to much.
        let (fraction, bends) = match joint {
            Some(joint) => (self.fraction_left_at(joint, set, foremost), bends || rank > 1.0),
            None => (Some(self.fraction_left(set, foremost)), false),
        };
        if fraction.is_none_or(|fraction| rules::is_crowded(fraction, bends)) {
            return Some(Doubt::MoreAtItsJoint);
        }
        // Where the flexible part holds the same function, as that of the side of approach, it would predict as well with a variance of its own.
        let Some(predictions) = predictions.filter(|predictions| rules::predicts(predictions.gain_apart))
        else {
            return Some(Doubt::NotPredicted);
        };
        let model = self.stage.fitted.problem.model;
        let steady = build(&candidate.id, model)
            .is_ok_and(|one| self.has_steady_size(one.as_ref(), &values, &predictions));
        (!steady).then_some(Doubt::Size)
    }

    /// Which set is asked, and which of its members: of the likeliest the one that takes most from what is left; where another takes far more, and the flexible part
    /// represents it in the likeliest set, that other.
    fn asked<'s>(&self, sets: &'s Sets) -> Option<(usize, &'s Set)> {
        let best = sets.all.first()?;
        let plausible = (0..self.candidates.len()).filter(|one| self.is_plausible(*one));
        // The likeliest set may do without the greatest error where the flexible part stands in for it; what a user wants explained is that error.
        let greatest = self.foremost(plausible)?;
        let own = self.foremost(best.members.iter().copied());
        match own.filter(|own| rules::is_close_to(self.gain(*own), self.gain(greatest))) {
            Some(own) if self.is_plausible(own) => Some((own, best)),
            _ => Some((greatest, sets.all.iter().find(|set| set.members.contains(&greatest))?)),
        }
    }

    /// What is found among the sets; nothing where no effect of the library is plausible.
    fn judged(&self, sets: &Sets) -> Option<Mechanism> {
        let (foremost, set) = self.asked(sets)?;
        let asked = self.in_set(foremost, set);
        let rivals = self.rivals(&asked, sets);
        let doubt = self.doubt(&asked, sets, &rivals);
        let close = std::iter::once(&foremost).chain(&rivals.listed);
        let close = close.filter_map(|one| self.index_in_stage(*one)).collect();
        let inclusion = sets.inclusion(self.candidates.len());
        let probabilities = inclusion.iter().enumerate().filter(|(one, _)| self.is_plausible(*one));
        let probabilities =
            probabilities.filter_map(|(one, likely)| Some((self.index_in_stage(one)?, *likely)));
        let probabilities = probabilities.collect();
        let (criterion, values) = (set.criterion, self.values(set, foremost));
        let mut mechanism =
            Mechanism { close, doubt, probabilities, criterion, values, block_errors: Vec::new() };
        if mechanism.is_reported() {
            mechanism.block_errors = errors_by_blocks(self, &asked).unwrap_or_default();
        }
        Some(mechanism)
    }
}

/// Whether an effect can imitate anything at its joint.
fn imitates(id: &EffectId) -> bool {
    kind(&id.name).is_some_and(|kind| kind.imitates_anything)
}

/// Directions speak of rotations about joints.
fn is_of_a_joint(id: &EffectId) -> bool {
    kind(&id.name).is_some_and(|kind| kind.family == Family::Joint)
}

/// Wald's statistic of some values, their squares in units of their covariance, and its degrees of freedom.
fn wald((values, covariance): &(DVector<f64>, DMatrix<f64>)) -> (f64, f64) {
    let eigen = covariance.clone().symmetric_eigen();
    let largest = eigen.eigenvalues.iter().copied().fold(0.0, f64::max);
    let pairs = eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter());
    // Directions in which two parameters do the same have no variance of their own, and say nothing.
    let known = pairs.filter(|(value, _)| **value > 1e-12 * largest);
    known.fold((0.0, 0.0), |(sum, rank), (value, vector)| {
        (sum + vector.dot(values).powi(2) / value, rank + 1.0)
    })
}

impl Mechanism {
    /// Whether its site is known although it is not identified: what is said against it is not that something else does as well.
    pub(crate) fn knows_its_site(&self) -> bool {
        matches!(self.doubt, Some(Doubt::MoreAtItsJoint | Doubt::NotPredicted | Doubt::Size))
    }

    /// Whether there is something to report: a name, or at least a site.
    pub(crate) fn is_reported(&self) -> bool {
        self.doubt.is_none() || self.knows_its_site()
    }

    /// Asks the fitted candidates of a stage; nothing where too few rows are left over to ask, or none of them is plausible.
    pub(crate) fn of(stage: &Stage<'_>, about: &Linearization<'_>, unlisted: &[Probe]) -> Option<Self> {
        let Fitted { problem, fit } = about.fitted(stage);
        let rows = chosen_rows(problem, fit, EVIDENCE_ROWS);
        let mut features = Features::of(problem, fit, &rows);
        let Asked { candidates, overtones, columns } = candidates(stage, about, unlisted, &rows);
        for candidate in &candidates {
            if let Some(values) = about.values_in(&candidate.id) {
                features.add_to_residuals(&(columns.select_columns(&candidate.parameters) * values));
            }
        }
        // A flexible part that could follow every reading would hide what a mechanism leaves at its joint.
        if features.design.ncols() >= columns.nrows() {
            return None;
        }
        let mixed = Mixed::new(&features, &columns)?;
        let nothing = mixed.fit(&[], None)?;
        let equations = columns.nrows() as f64;
        let bench = Bench { stage, candidates, overtones, rows, features, mixed, nothing, equations };
        let sets = Sets::search(&bench);
        bench.judged(&sets)
    }

    /// Gives the foremost fitted candidate the values it has beside the flexible part.
    pub(crate) fn take_values(&self, fitted_candidates: &mut [FittedCandidate]) {
        if let Some(fitted_candidate) = self.close.first().and_then(|index| fitted_candidates.get_mut(*index))
        {
            fitted_candidate.values = self.values.0.as_slice().to_vec();
            fitted_candidate.covariance = self.values.1.clone();
            fitted_candidate.block_errors.clone_from(&self.block_errors);
        }
    }
}

#[cfg(test)]
mod tests;
