//! From stages to one verdict.

mod among_structure;
mod evidence;
mod need;

use crate::block_errors::{at_least, factor_of_the_best_known};
use crate::candidates::Candidates;
use crate::epochs::with_rivals;
use crate::forward_selection::{FittedCandidate, Stage};
use crate::found::{CorrectionCandidate, NOT_LISTED};
use crate::laboratory::{Laboratory, LaboratoryError, points_in};
use crate::lack_of_fit::{LackOfFit, probability_of_noise};
use crate::mechanism_test::Mechanism;
use crate::noise_floor::Floor;
use crate::note::Note;
use crate::outcome::{Alike, Candidate, EffectSite, Located, Named, Verdict};
use crate::thresholds::{
    ALIKE_CORRELATION, COMPARED_CANDIDATES, DETECTABLE_ERRORS, LACK_OF_FIT_LEVEL, NAMING_LEVEL,
    OVERWHELMING_GAIN, PRESENT_LEVEL, SAME_CORRELATION, SIGN_ERRORS, TIE_BIC,
};
use evidence::{Against, Evidence, unlisted_against};
use plumb_calibration::arm_model::AddedEffect;
use plumb_calibration::effect::{self, EffectId, Family, LooksAt, Site, Size};
use plumb_calibration::fit::ResidualModel;
use plumb_estimation::Progress;

/// What the search came to.
pub(crate) struct Finding<'a> {
    /// The stage without the effect in question (others that belong may be in it).
    pub(crate) stage: Stage<'a>,
    /// What is left when everything that passed is in; nothing if the floor is unknown.
    pub(crate) left_over: Option<LackOfFit>,
    /// What is left of the model as it is; nothing if the floor is unknown.
    pub(crate) left_now: Option<LackOfFit>,
    /// The verdict.
    pub(crate) verdict: Verdict,
    /// The place that is known, if that is the verdict.
    pub(crate) site: Option<Site>,
    /// Fitted candidates no worse than the best by more than the information criterion can distinguish.
    pub(crate) close: Vec<usize>,
    /// Effects that belong besides the one in question.
    pub(crate) besides: Vec<EffectId>,
    /// Places where, by its direction, all may sit that the model lacks; the likeliest first.
    pub(crate) sites: Vec<Site>,
    /// What is left with the effect in question in, less the noise, mm; where it was named, located or tied although more than noise is left.
    pub(crate) left_unexplained_mm: Option<f64>,
    /// The group of the geometry that is to be freed before anything is named; where errors of it explain as much as what would be named.
    pub(crate) free_first: Option<&'static str>,
    /// What was found beside a flexible part for what nothing explains; nothing where that was not asked.
    mechanism: Option<Mechanism>,
    /// What speaks against a name where the likeliest effect sits, besides other candidates.
    against: Option<Against>,
    /// Whether more than noise may be left with the effect in question in.
    dirty: bool,
    /// Rows that are no outliers with everything in that was found.
    rows: Vec<usize>,
    /// What was found to act at once, though none of it may be named; the one in question last.
    pub(crate) together: Vec<CorrectionCandidate>,
}

impl Laboratory {
    /// Searches, then looks at the one effect that matters most with all others in.
    pub(crate) fn find<'a>(
        &'a self,
        floor: &Floor,
        candidates: &Candidates,
        progress: &Progress,
    ) -> Result<Finding<'a>, LaboratoryError> {
        let mut stages = self.forward(candidates, floor, progress)?;
        let last = stages.len() - 1;
        let left_now = stages.first().and_then(|stage| LackOfFit::of(&stage.fitted, floor));
        let mut evidence = self.evidence_of(&stages, candidates, floor);
        let rows = stages.get(last).map_or_else(Vec::new, |full| full.fitted.fit.rows.clone());
        let mut stage = match stages.get(last).map_or(0, |full| full.taken.len()) {
            0 | 1 => stages.swap_remove(0),
            _ => {
                progress.report(0.7, "weighing what was found")?;
                let full = stages.swap_remove(last);
                let needed = self.most_needed(&full, candidates, progress)?;
                // The first stage's own finding holds if what was found later does not.
                needed.unwrap_or_else(|| stages.swap_remove(0))
            }
        };
        evidence.rivals = unlisted_against(&stage, &candidates.unlisted);
        evidence.lack_of_fit = LackOfFit::of(&stage.fitted, floor);
        let besides = stage.taken.iter().map(|taken| taken.id.clone()).collect();
        let close = close_fitted_candidates(&stage.fitted_candidates, stage.equations());
        // Schwarz's criterion decides between events where nothing but noise is left beside the best.
        let first = close.first().and_then(|index| stage.fitted_candidates.get(*index));
        let close = if first.is_some_and(|best| leaves_noise_alone(best, floor)) {
            close
        } else {
            with_rivals(&stage, close)
        };
        let close = self.with_pairs(&stage, close, candidates, progress)?;
        let asked: Vec<&FittedCandidate> =
            close.iter().filter_map(|index| stage.fitted_candidates.get(*index)).collect();
        let (verdict, site) = judge(&asked, &evidence, floor);
        let against = asked.first().and_then(|best| evidence.against_a_name_at(best.id.site));
        let dirty = is_dirty(asked.first().copied(), &evidence, floor);
        let together = found_together(&stage, &close);
        let base = self.base_of(&mut stage, stages, progress)?;
        let finding = Finding {
            stage,
            left_over: evidence.left_over,
            left_now,
            verdict,
            site,
            close,
            besides,
            sites: evidence.alone,
            left_unexplained_mm: None,
            free_first: None,
            mechanism: None,
            against,
            dirty,
            rows,
            together,
        };
        finding.weighed(self, base, candidates, floor, progress)
    }

    /// The candidates that come close to the likeliest, and those of which two of one kind do so together.
    fn with_pairs(
        &self,
        stage: &Stage<'_>,
        mut close: Vec<usize>,
        candidates: &Candidates,
        progress: &Progress,
    ) -> Result<Vec<usize>, LaboratoryError> {
        let Some(best) = close.first().copied() else { return Ok(close) };
        if stage.fitted_candidates.get(best).is_some_and(FittedCandidate::passes) {
            let pairs = self.pairs_as_likely(stage, best, candidates, progress)?;
            close.extend(pairs.into_iter().filter(|index| !close.contains(index)).collect::<Vec<_>>());
        }
        Ok(close)
    }

    /// The stage without anything taken in, where that in question has something; what its candidates promise is then that of adding each alone.
    fn base_of<'a>(
        &'a self,
        stage: &mut Stage<'a>,
        stages: Vec<Stage<'a>>,
        progress: &Progress,
    ) -> Result<Option<Stage<'a>>, LaboratoryError> {
        let base = stages.into_iter().next().filter(|base| base.taken.is_empty() && !stage.taken.is_empty());
        if let Some(base) = &base {
            self.promise_alone(stage, base, progress)?;
        }
        Ok(base)
    }
}

/// What was taken in and what is in question beside it, if that passes: effects that act at once. Nothing where there is only one, or where one of them was re-set
/// between rows, which is added by itself.
fn found_together(stage: &Stage<'_>, close: &[usize]) -> Vec<CorrectionCandidate> {
    let problem = &stage.fitted.problem;
    let close = close.iter().filter_map(|index| stage.fitted_candidates.get(*index));
    let close: Vec<&FittedCandidate> = close.collect();
    let Some(best) = close.first().filter(|best| best.passes()) else { return Vec::new() };
    let in_question = AddedEffect { id: best.id.clone(), values: best.values.clone() };
    let all: Vec<AddedEffect> = stage.taken.iter().cloned().chain([in_question]).collect();
    let has_event = all.iter().any(|one| effect::kind(&one.id.name).is_some_and(|kind| kind.is_event));
    if all.len() < 2 || has_event {
        return Vec::new();
    }
    let alike: Vec<&EffectId> = close.iter().skip(1).map(|other| &other.id).collect();
    let candidate = |effect: AddedEffect| {
        // What explains as much was compared with the one in question alone.
        let others = if effect.id == best.id { alike.as_slice() } else { &[] };
        correction_candidate(problem, effect, others)
    };
    all.into_iter().map(candidate).collect()
}

/// An effect as a correction: it may represent itself, others that explain as much, or what has no name in the library.
fn correction_candidate(
    problem: &ResidualModel<'_>,
    effect: AddedEffect,
    others: &[&EffectId],
) -> CorrectionCandidate {
    let own = std::iter::once(&effect.id);
    let mut may_be: Vec<String> =
        own.chain(others.iter().copied()).map(|id| problem.model.label(id)).collect();
    may_be.push(NOT_LISTED.to_owned());
    CorrectionCandidate { site: effect_site(problem, &effect.id), effect, may_be }
}

/// The best plausible fitted candidate and all that come close to it, by their indices in the list (the likeliest first).
fn close_fitted_candidates(fitted_candidates: &[FittedCandidate], equations: f64) -> Vec<usize> {
    let mut plausible = fitted_candidates.iter().filter(|fitted_candidate| fitted_candidate.is_plausible());
    let Some(best) = plausible.next() else { return Vec::new() };
    let close = fitted_candidates.iter().enumerate().filter(|(_, one)| {
        // Of many parameters one more is charged for: a drift along three axes that does what one joint's warming does is no worse
        // an explanation, if a dearer one.
        let not_charged = one.score.freedom.saturating_sub(best.score.freedom + 1) as f64;
        one.is_plausible() && one.bic - not_charged * equations.ln() - best.bic < TIE_BIC
    });
    close.map(|(index, _)| index).collect()
}

impl Evidence {
    /// Something is there that nothing may be named for: it sits where its direction says, else where `otherwise` does.
    fn unnamed(&self, otherwise: Option<Site>) -> (Verdict, Option<Site>) {
        let otherwise = otherwise.filter(|site| self.alone.is_empty() || self.alone.contains(site));
        match otherwise.or(self.alone.first().copied()) {
            Some(site) => (Verdict::Located, Some(site)),
            None => (Verdict::Unknown, None),
        }
    }

    /// Whether more than noise is left without the effect in question; what is there beyond doubt counts although the sum of
    /// all residuals does not show it.
    fn is_noisy(&self, best: Option<&FittedCandidate>) -> bool {
        let sure = !self.errs_alike && best.is_some_and(|best| best.holm_p < PRESENT_LEVEL);
        self.lack_of_fit.is_some_and(|lack_of_fit| lack_of_fit.is_significant() || sure)
    }
}

/// The verdict on the close fitted candidates (the likeliest first), and the site if only that is known.
fn judge(
    fitted_candidates: &[&FittedCandidate],
    evidence: &Evidence,
    floor: &Floor,
) -> (Verdict, Option<Site>) {
    let best = fitted_candidates.first().copied();
    let noisy = evidence.is_noisy(best);
    let quiet = match (evidence.lack_of_fit, floor.scale) {
        (Some(_), Some(_)) => (Verdict::AtFloor, None),
        _ => (Verdict::FloorUnknown, None),
    };
    let Some(best) = best else {
        let unlisted_site = evidence.rivals.or(evidence.unlisted_sites.first().copied());
        return if noisy { evidence.unnamed(unlisted_site) } else { quiet };
    };
    // To name the nearest of the listed would be to name the wrong one.
    if evidence.rivals.is_some() {
        return evidence.unnamed(evidence.rivals);
    }
    let one_site = fitted_candidates.iter().all(|fitted_candidate| fitted_candidate.id.site == best.id.site);
    let explains = explains_all(best, floor);
    // The directions speak of joints and the base alone: what explains all and sits elsewhere keeps its place.
    let at_best = match explains && !is_of_a_joint(&best.id) {
        true => (Verdict::Located, Some(best.id.site)),
        false => evidence.unnamed(Some(best.id.site)),
    };
    if !best.passes() {
        // What does not predict rows it has not seen is no finding, unless something must be there.
        return match (noisy, one_site) {
            (false, _) => quiet,
            (true, true) => at_best,
            (true, false) => match evidence.alone.as_slice() {
                // What does not reach the floor is no explanation to be tied with others.
                [site] if !explains => (Verdict::Located, Some(*site)),
                _ => (Verdict::Tied, None),
            },
        };
    }
    let doubtful = evidence.against_a_name_at(best.id.site).is_some();
    match (fitted_candidates.len(), one_site) {
        _ if doubtful && !is_overwhelming(best) => at_best,
        (1, _) => (Verdict::Named, None),
        (_, true) => (Verdict::Located, Some(best.id.site)),
        _ => (Verdict::Tied, None),
    }
}

/// Whether more than noise may be left with the likeliest effect in; yes where the noise is not known.
fn is_dirty(best: Option<&FittedCandidate>, evidence: &Evidence, floor: &Floor) -> bool {
    evidence.is_unfinished() || floor.scale.is_none() || best.is_some_and(|best| !explains_all(best, floor))
}

/// Whether nothing but noise is left with an effect in; yes where the noise is not known.
fn explains_all(best: &FittedCandidate, floor: &Floor) -> bool {
    let (squares, freedom) = best.left;
    probability_of_noise(squares, freedom, floor).is_none_or(|p| p >= LACK_OF_FIT_LEVEL)
}

/// Whether it is known that nothing but noise is left with an effect in.
fn leaves_noise_alone(best: &FittedCandidate, floor: &Floor) -> bool {
    let (squares, freedom) = best.left;
    probability_of_noise(squares, freedom, floor).is_some_and(|p| p >= LACK_OF_FIT_LEVEL)
}

/// Directions speak of rotations about joints. What bends or shifts a link, and reaches the floor so, sits at that link.
fn is_of_a_joint(id: &EffectId) -> bool {
    effect::kind(&id.name).is_some_and(|kind| kind.family == Family::Joint)
}

/// Whether an effect predicts rows it has not seen so well that it is real whatever else is left.
fn is_overwhelming(best: &FittedCandidate) -> bool {
    best.gains.iter().all(|gain| gain.total > OVERWHELMING_GAIN * gain.error)
}

/// Whether a size is below zero beyond doubt.
fn is_below_zero(size: &Size) -> bool {
    size.value < -SIGN_ERRORS * size.error
}

/// Whether an effect is one of the arm's own sensor, or of an instrument beside it.
fn is_of_sensor(id: &EffectId) -> bool {
    effect::kind(&id.name).is_some_and(|kind| matches!(kind.family, Family::Sensor | Family::Instrument))
}

/// Which and where, in the contract's words.
pub(crate) fn effect_site(problem: &ResidualModel<'_>, id: &EffectId) -> EffectSite {
    EffectSite {
        effect: id.name.clone(),
        site: problem.model.site_name(id.site),
        with: id.with.and_then(|index| problem.model.chain.joints.get(index).map(|joint| joint.name.clone())),
        n: id.order,
        of: id.of.map(|of| of.name().to_owned()),
        at: id.inner.filter(|_| effect::kind(&id.name).is_some_and(|kind| kind.is_event)),
    }
}

impl Finding<'_> {
    fn at(&self, index: usize) -> Option<&FittedCandidate> {
        self.stage.fitted_candidates.get(index)
    }

    /// The fitted candidate in question.
    pub(crate) fn best(&self) -> Option<&FittedCandidate> {
        self.close.first().and_then(|index| self.at(*index))
    }

    /// The effects that were found, the likeliest of those in question last; nothing where none was, or where something that was re-set between rows is among them.
    pub(crate) fn lasting_effects(&self) -> Option<Vec<AddedEffect>> {
        let in_question = self.close.iter().filter_map(|index| Some(&self.at(*index)?.id));
        let mut found = in_question.chain(&self.besides);
        let has_event = found.any(|id| effect::kind(&id.name).is_some_and(|kind| kind.is_event));
        let is_found = matches!(self.verdict, Verdict::Named | Verdict::Tied | Verdict::Located);
        let best = self.best().filter(|_| is_found && !has_event)?;
        let best = AddedEffect { id: best.id.clone(), values: best.values.clone() };
        Some(self.stage.taken.iter().cloned().chain([best]).collect())
    }

    /// The named effect, if that is the verdict.
    pub(crate) fn named(&self) -> Option<Named> {
        let best = self.best().filter(|_| self.verdict == Verdict::Named)?;
        let size = self.size(best);
        let effect = effect_site(&self.stage.fitted.problem, &best.id);
        Some(Named { effect, size: size.value, unit: size.unit.to_owned(), se: size.error })
    }

    fn size(&self, fitted_candidate: &FittedCandidate) -> Size {
        let Ok(effect) = effect::build(&fitted_candidate.id, self.stage.fitted.problem.model) else {
            return fitted_candidate.score.size;
        };
        let FittedCandidate { score, values, covariance, block_errors, .. } = fitted_candidate;
        // Where nothing but noise is left it is independent.
        let errors = if self.dirty { block_errors.as_slice() } else { &[] };
        let size = match score.has_unseen {
            false => effect.size(values, &at_least(covariance, errors)),
            // A refit frees every number, also those that no plausible size of them could show.
            true => {
                Size { error: score.size.error * factor_of_the_best_known(covariance, errors), ..score.size }
            }
        };
        size.unless_undetermined(effect.parameters())
    }

    /// The known place, if that is the verdict.
    pub(crate) fn located(&self) -> Option<Located> {
        let site = self.site.filter(|_| self.verdict == Verdict::Located)?;
        let model = self.stage.fitted.problem.model;
        let mut family: Vec<String> = Vec::new();
        let close = self
            .close
            .iter()
            .filter_map(|index| self.at(*index))
            .map(|fitted_candidate| &fitted_candidate.id);
        for id in close.chain(&self.besides).filter(|id| id.site == site) {
            if !family.contains(&id.name) {
                family.push(id.name.clone());
            }
        }
        Some(Located { site: model.site_name(site), family })
    }

    /// Of all candidates a joint or link that yields against gravity explains most, clearly: the model's idea of what is down may be wrong.
    pub(crate) fn gravity_warning(&self) -> Option<Note> {
        let first = self.stage.fitted_candidates.first()?;
        let model = self.stage.fitted.problem.model;
        let yields =
            effect::build(&first.id, model).is_ok_and(|effect| effect.looks_at() == LooksAt::Gravity);
        let size = self.size(first);
        (yields && first.holm_p < NAMING_LEVEL && is_below_zero(&size))
            .then(|| Note::RisesUnderLoad(model.label(&first.id)))
    }

    /// What cannot be distinguished, if there is more than one.
    pub(crate) fn tied(&self) -> Vec<EffectSite> {
        let asked = matches!(self.verdict, Verdict::Tied | Verdict::Located);
        let alone = self.verdict == Verdict::Located || self.free_first.is_none();
        if (self.close.len() < 2 && alone) || !asked {
            return Vec::new();
        }
        let tied = self.close.iter().filter_map(|index| self.at(*index));
        tied.map(|fitted_candidate| effect_site(&self.stage.fitted.problem, &fitted_candidate.id)).collect()
    }

    /// Pairs of the best few fitted candidates that move the readings alike in these poses.
    pub(crate) fn alike(&self) -> Vec<Alike> {
        let Some(best) = self.best().map(|best| self.stage.fitted.problem.model.label(&best.id)) else {
            return Vec::new();
        };
        let model = self.stage.fitted.problem.model;
        let same = self.same();
        let mut alike = Vec::new();
        for (correlation, other) in self.correlated() {
            let other = model.label(&other);
            if !same.contains(&other) {
                alike.push(Alike { one: best.clone(), other, correlation });
            }
        }
        alike
    }

    /// Fitted candidates that are the same thing as the best in these rows: they move every reading just as it does, and the tip as much or as little. What the arm's own
    /// sensor does, and what the arm does, may read alike and still send the tip to different places.
    pub(crate) fn same(&self) -> Vec<String> {
        let Some(best) = self.best() else { return Vec::new() };
        let model = self.stage.fitted.problem.model;
        let same = self.correlated().into_iter().filter(|(correlation, other)| {
            *correlation > SAME_CORRELATION && is_of_sensor(other) == is_of_sensor(&best.id)
        });
        same.map(|(_, other)| model.label(&other)).collect()
    }

    /// The best few fitted candidates that move the readings like the best: the canonical correlation of what each adds to what is fitted.
    fn correlated(&self) -> Vec<(f64, EffectId)> {
        let Some(best) = self.best() else { return Vec::new() };
        let fitted = &self.stage.fitted;
        let (problem, fit) = (&fitted.problem, &fitted.fit);
        // Those that were not refitted explain too little to be mistaken for the best.
        let others =
            self.stage.fitted_candidates.iter().filter(|other| other.id != best.id && other.refitted);
        let compared: Vec<&FittedCandidate> =
            std::iter::once(best).chain(others.take(COMPARED_CANDIDATES)).collect();
        let effects: Vec<_> = compared
            .iter()
            .filter_map(|fitted_candidate| effect::build(&fitted_candidate.id, problem.model).ok())
            .collect();
        if effects.len() != compared.len() {
            return Vec::new();
        }
        let probes: Vec<&dyn effect::Effect> = effects.iter().map(AsRef::as_ref).collect();
        let normal = problem.normal(&fit.state, &fit.rows, &fit.weights, &probes);
        let free_parameters = problem.free_parameters().len();
        let count = normal.matrix.nrows() - free_parameters;
        // Beyond what is fitted: two effects that the zeros swallow alike are not alike for it.
        let shadow = fit
            .factor
            .whiten(&normal.matrix.view((0, free_parameters), (free_parameters, count)).into_owned());
        let beyond =
            normal.matrix.view((free_parameters, free_parameters), (count, count)) - shadow.tr_mul(&shadow);
        let mut first = 0;
        let ranges: Vec<std::ops::Range<usize>> = probes
            .iter()
            .map(|probe| {
                let range = first..first + probe.parameters().len();
                first = range.end;
                range
            })
            .collect();
        let Some(own) = ranges.first() else { return Vec::new() };
        let others = compared.iter().zip(&ranges).skip(1);
        let alike =
            others.filter_map(|(other, range)| Some((canonical(&beyond, own, range)?, other.id.clone())));
        let mut alike: Vec<(f64, EffectId)> = alike.collect();
        alike.retain(|(correlation, _)| *correlation > ALIKE_CORRELATION);
        alike.sort_by(|left, right| right.0.total_cmp(&left.0));
        alike
    }

    /// Candidates that predict rows they have not seen though none may be named, the likeliest first, and the mechanisms each may represent: itself, what explains
    /// as much, and what has no name in the library.
    pub(crate) fn corrections(&self) -> Vec<CorrectionCandidate> {
        let problem = &self.stage.fitted.problem;
        let close: Vec<&EffectId> = self
            .close
            .iter()
            .filter_map(|index| self.at(*index))
            .map(|fitted_candidate| &fitted_candidate.id)
            .collect();
        let passing =
            self.stage.fitted_candidates.iter().filter(|fitted_candidate| fitted_candidate.passes());
        let corrections = passing.map(|fitted_candidate| {
            let FittedCandidate { id, values, .. } = fitted_candidate;
            let others: Vec<&EffectId> = close.iter().copied().filter(|other| *other != id).collect();
            correction_candidate(problem, AddedEffect { id: id.clone(), values: values.clone() }, &others)
        });
        corrections.collect()
    }

    /// The likeliest candidates, with why each is not the name.
    pub(crate) fn candidates(&self, count: usize, floor: &Floor) -> Vec<Candidate> {
        let problem = &self.stage.fitted.problem;
        let best = self.stage.fitted_candidates.first().map_or(0.0, |fitted_candidate| fitted_candidate.bic);
        let points = points_in(problem, &self.stage.fitted.fit.rows).max(1) as f64;
        let unit = crate::noise_floor::typical_sigma(problem);
        let probabilities = self.probabilities();
        self.stage
            .fitted_candidates
            .iter()
            .enumerate()
            .take(count)
            .map(|(index, fitted_candidate)| {
                let size = self.size(fitted_candidate);
                Candidate {
                    effect: effect_site(problem, &fitted_candidate.id),
                    label: problem.model.label(&fitted_candidate.id),
                    holm_p: fitted_candidate.holm_p,
                    delta_bic: fitted_candidate.bic - best,
                    probability: probabilities
                        .iter()
                        .find(|(one, _)| *one == index)
                        .map(|(_, likely)| *likely),
                    cv_gain: fitted_candidate.promise.map(|promise| promise.before_mm - promise.after_mm),
                    leaves_mm: fitted_candidate.promise.map(|promise| promise.after_mm),
                    size: size.value,
                    unit: size.unit.to_owned(),
                    se: size.error,
                    plausible: fitted_candidate.score.plausible,
                    absorbed: fitted_candidate.score.absorbed,
                    explains_mm: fitted_candidate.promise.map_or_else(
                        || {
                            expected_reduction(
                                self.stage.fitted.fit.normal.squares,
                                fitted_candidate.score.gain,
                                points,
                            ) * unit
                        },
                        |promise| promise.before_mm - promise.after_mm,
                    ),
                    smallest: smallest(fitted_candidate, floor),
                    rejected: self.rejected(fitted_candidate),
                }
            })
            .collect()
    }
}

/// The smallest size of a candidate that would be found four times in five, in its unit.
fn smallest(fitted_candidate: &FittedCandidate, floor: &Floor) -> f64 {
    let (squares, freedom) = fitted_candidate.left;
    // What the candidate itself explains hides nothing: the noise is what is left with it in. A fit to few rows may leave less than the noise, by chance.
    let noise = (squares / freedom).sqrt().max(floor.scale.unwrap_or(0.0));
    // What is left of it beyond the fitted parameters: the root, for strength is no square.
    let visible = fitted_candidate.score.strength * (1.0 - fitted_candidate.score.absorbed).max(1e-12).sqrt();
    if visible > 0.0 { DETECTABLE_ERRORS * noise / visible } else { f64::MAX }
}

/// By how much the root mean square of so many points falls when so much of the sum of squares goes.
fn expected_reduction(squares: f64, gain: f64, points: f64) -> f64 {
    (squares / points).sqrt() - ((squares - gain).max(0.0) / points).sqrt()
}

/// The greatest canonical correlation of two groups of columns, from their products; nothing where one is not seen at all.
fn canonical(
    products: &nalgebra::DMatrix<f64>,
    one: &std::ops::Range<usize>,
    other: &std::ops::Range<usize>,
) -> Option<f64> {
    let [first, second] =
        [one, other].map(|own| products.view((own.start, own.start), (own.len(), own.len())).into_owned());
    let across = products.view((one.start, other.start), (one.len(), other.len())).into_owned();
    // Of orthonormal columns the singular values of the products across are the cosines of the principal angles (Björck & Golub 1973, theorem 1). They take the
    // bases from QR; here each group is made orthonormal by Cholesky's factor, for only products are at hand.
    let (first, second) = (first.cholesky()?, second.cholesky()?);
    let left = first.l().solve_lower_triangular(&across)?;
    let both = second.l().solve_lower_triangular(&left.transpose())?;
    both.svd(false, false).singular_values.iter().copied().reduce(f64::max)
}

#[cfg(test)]
mod tests;
