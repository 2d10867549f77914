//! A name among structure that nothing explains, how probable each candidate is, and why the others are rejected.

use super::Finding;
use super::evidence::Against;
use crate::candidates::Candidates;
use crate::epochs::with_rivals;
use crate::forward_selection::{FittedCandidate, Stage};
use crate::laboratory::{Laboratory, LaboratoryError, points_in};
use crate::mechanism_test::{Doubt, GEOMETRY, Mechanism, explains_as_well, posterior};
use crate::noise_floor::{Floor, typical_sigma};
use crate::note::Note;
use crate::outcome::{Rejection, Verdict};
use crate::predictive_gain::Gain;
use crate::score_test::Probe;
use crate::thresholds::NAMING_LEVEL;
use plumb_calibration::effect::{self, EffectId, Site};
use plumb_estimation::Progress;

impl<'a> Finding<'a> {
    /// Asks for a mechanism where more than noise may be left and nothing is named, or something while nobody knows the noise.
    pub(super) fn weighed(
        mut self,
        lab: &Laboratory,
        mut base: Option<Stage<'a>>,
        candidates: &Candidates,
        floor: &Floor,
        progress: &Progress,
    ) -> Result<Self, LaboratoryError> {
        let in_the_dark = self.verdict == Verdict::Named && floor.scale.is_none();
        if self.dirty && (self.verdict.is_unnamed() || in_the_dark) {
            progress.report(0.8, "weighing it beside what nothing explains")?;
            let ask = |stage: &Stage<'_>| lab.mechanism_of(stage, &candidates.unlisted, progress);
            self = self.among_structure(&mut base, ask, floor)?;
        }
        if matches!(self.verdict, Verdict::Named | Verdict::Tied | Verdict::Located) {
            progress.report(0.85, "asking the geometry that is not free")?;
            self.ask_left_out_geometry(base.as_ref(), &candidates.listed);
        }
        Ok(self)
    }

    /// Takes a name back that errors of the geometry explain as well, where the model does not free all of it; says so beside a tie or a place.
    fn ask_left_out_geometry(&mut self, base: Option<&Stage<'_>>, listed: &[Probe]) {
        let likeliest = self.best().filter(|best| best.holm_p < NAMING_LEVEL);
        let Some(name) = likeliest.map(|best| best.id.clone()) else { return };
        // The stage with nothing taken in: geometry is a rival of all effects together, not of the last alone.
        let first = base.unwrap_or(&self.stage);
        let taken = self.stage.taken.iter().map(|taken| taken.id.clone());
        let found: Vec<EffectId> = taken.chain(std::iter::once(name)).collect();
        if explains_as_well(first, listed, &found, &self.rows) {
            self.free_first = Some(GEOMETRY);
            if self.verdict == Verdict::Named {
                self.verdict = Verdict::Tied;
            }
        }
    }

    /// Asks whether an effect is identified although more is left: first with nothing taken in, then beside what was. Where none is, the place of the foremost is
    /// reported if that much is known, else any other verdict remains as it is, and a name only if it is the foremost then too and nothing is to be said against it.
    fn among_structure(
        mut self,
        base: &mut Option<Stage<'a>>,
        ask: impl Fn(&Stage<'_>) -> Result<Option<Mechanism>, LaboratoryError>,
        floor: &Floor,
    ) -> Result<Self, LaboratoryError> {
        let named = self.verdict == Verdict::Named;
        let asked_base = match base.as_ref().filter(|_| !named) {
            Some(base) => ask(base)?,
            None => None,
        };
        if let Some(mechanism) = asked_base.filter(Mechanism::is_reported)
            && let Some(base) = base.take()
        {
            self.stage = base;
            // Asked of the stage without them, the finding says nothing of what was taken in besides.
            self.besides.clear();
            return Ok(self.settled_by(mechanism, floor));
        }
        Ok(match ask(&self.stage)? {
            Some(mechanism) if mechanism.is_reported() && !named => self.settled_by(mechanism, floor),
            mechanism => {
                let doubted = mechanism.as_ref().is_some_and(|mechanism| {
                    let likeliest = self.close.first().is_some_and(|best| mechanism.close.contains(best));
                    !likeliest || mechanism.doubt.is_some()
                });
                if named && doubted {
                    self.verdict = Verdict::Located;
                    self.site = self.best().map(|best| best.id.site);
                }
                Self { mechanism, ..self }
            }
        })
    }

    /// The verdict is that of the weighing beside a flexible part.
    fn settled_by(mut self, mechanism: Mechanism, floor: &Floor) -> Self {
        mechanism.take_values(&mut self.stage.fitted_candidates);
        // Explanations by epoch are compared row by row besides: what the flexible part leaves of one may be what another lacks.
        let rivals = with_rivals(&self.stage, mechanism.close.clone());
        self.close = mechanism.close.iter().copied().filter(|index| rivals.contains(index)).collect();
        self.close.extend(rivals.into_iter().filter(|index| !mechanism.close.contains(index)));
        let sites: Vec<_> = self.close.iter().filter_map(|index| Some(self.at(*index)?.id.site)).collect();
        let one_site = sites.first().filter(|first| sites.iter().all(|site| site == *first));
        (self.verdict, self.site) = match (sites.len(), one_site) {
            (1, _) if mechanism.doubt.is_none() => (Verdict::Named, None),
            (_, Some(site)) => (Verdict::Located, Some(*site)),
            _ => (Verdict::Tied, None),
        };
        self.left_unexplained_mm = self.best().map(|best| self.left_mm(best, floor));
        self.mechanism = Some(mechanism);
        self
    }

    /// Root mean square error of a point with an effect in, less the noise where it is known, mm.
    fn left_mm(&self, best: &FittedCandidate, floor: &Floor) -> f64 {
        let problem = &self.stage.fitted.problem;
        let points = points_in(problem, &self.stage.fitted.fit.rows).max(1) as f64;
        let (squares, freedom) = best.left;
        let noise = floor.scale.map_or(0.0, |scale| scale * scale * freedom);
        ((squares - noise).max(0.0) / points).sqrt() * typical_sigma(problem)
    }

    /// Posterior probability of a fitted candidate; nothing for one that was not weighed that no real machine has, or where more than noise is left and
    /// nothing was weighed beside a flexible part.
    pub(super) fn probabilities(&self) -> Vec<(usize, f64)> {
        if let Some(mechanism) = &self.mechanism {
            return mechanism.probabilities.clone();
        }
        // Where more is left than noise, every difference between models that all lack something would count for evidence.
        if self.dirty {
            return Vec::new();
        }
        let fitted_candidates = self.stage.fitted_candidates.iter().enumerate();
        let plausible: Vec<(usize, f64)> = fitted_candidates
            .filter(|(_, one)| one.is_plausible())
            .map(|(index, one)| (index, one.bic))
            .collect();
        let mut criteria: Vec<f64> = plausible.iter().map(|(_, bic)| *bic).collect();
        criteria.push(self.stage.bic);
        plausible.iter().zip(posterior(&criteria)).map(|((index, _), likely)| (*index, likely)).collect()
    }

    /// What no pose distinguishes from the effects in question, because on this arm it is the same: said of whatever is named, located or tied.
    pub(crate) fn twins(&self) -> Vec<Note> {
        if !matches!(self.verdict, Verdict::Named | Verdict::Located | Verdict::Tied) {
            return Vec::new();
        }
        let model = self.stage.fitted.problem.model;
        let close = self.close.iter().filter_map(|index| self.at(*index));
        let twin = |fitted_candidate: &FittedCandidate| {
            let effect = effect::build(&fitted_candidate.id, model).ok()?;
            let twin = effect.twin(&model.chain)?;
            Some(Note::Twin { label: model.label(&fitted_candidate.id), twin })
        };
        close.filter_map(twin).collect()
    }

    /// Posterior probability that it is one of those in question: the named effect, or the tie.
    pub(crate) fn probability(&self) -> Option<f64> {
        let probabilities = self.probabilities();
        let own = self.close.iter().filter_map(|index| probabilities.iter().find(|(one, _)| one == index));
        let own: Vec<f64> = own.map(|(_, likely)| *likely).collect();
        (!own.is_empty()).then(|| own.iter().sum::<f64>().min(1.0))
    }

    /// Why a fitted candidate is not the name, and which rival is in its way; nothing for the one that is named.
    pub(super) fn rejected(&self, fitted_candidate: &FittedCandidate) -> Option<Rejection> {
        let is_best = self.best().is_some_and(|best| best.id == fitted_candidate.id);
        let close = self
            .close
            .iter()
            .filter_map(|index| self.at(*index))
            .any(|other| other.id == fitted_candidate.id);
        if is_best && self.verdict == Verdict::Named {
            return None;
        }
        if let (true, Some(group)) = (is_best, self.free_first) {
            return Some(Rejection::HeldGeometry(group));
        }
        Some(if fitted_candidate.holm_p >= NAMING_LEVEL {
            Rejection::NotSignificant(fitted_candidate.holm_p)
        } else if !fitted_candidate.score.plausible {
            Rejection::Implausible
        } else if close && self.close.len() > 1 {
            Rejection::IndistinguishableFrom(self.others_in_question(fitted_candidate))
        } else if fitted_candidate.outvoted {
            Rejection::Outvoted
        } else if fitted_candidate.refitted && !fitted_candidate.gains.iter().all(Gain::counts) {
            Rejection::NotPredicted
        } else {
            self.rival(fitted_candidate, is_best)
        })
    }

    /// The names of those that explain it as well as a fitted candidate.
    fn others_in_question(&self, fitted_candidate: &FittedCandidate) -> Vec<String> {
        let model = self.stage.fitted.problem.model;
        let others = self.close.iter().filter_map(|index| self.at(*index));
        let labels =
            others.filter(|other| other.id != fitted_candidate.id).map(|other| model.label(&other.id));
        labels.collect()
    }

    /// What is in the way of a fitted candidate that passes everything but being the likeliest, or undoubted.
    fn rival(&self, fitted_candidate: &FittedCandidate, is_best: bool) -> Rejection {
        let model = self.stage.fitted.problem.model;
        let best = self.best().filter(|_| !is_best);
        let better = best.or_else(|| {
            // What was weighed beside a flexible part is judged by that, whatever fits better without it.
            let judged = self.mechanism.is_some();
            let first = self.stage.fitted_candidates.iter().find(|one| one.is_plausible());
            first.filter(|first| !judged && first.id != fitted_candidate.id)
        });
        if let Some(better) = better {
            return Rejection::WorseThan(model.label(&better.id));
        }
        // What is said against the foremost of those that were weighed is said of no other.
        if self.is_less_likely_beside_smooth(fitted_candidate) {
            return Rejection::LessLikelyBesideSmooth;
        }
        match self.mechanism.as_ref().and_then(|mechanism| mechanism.doubt.clone()) {
            Some(Doubt::Smooth) => Rejection::SmoothExplains,
            Some(Doubt::Unlisted(site)) => Rejection::UnlistedAt(model.site_name(site)),
            Some(Doubt::MoreAtItsJoint) => Rejection::MoreLeftAt(model.site_name(fitted_candidate.id.site)),
            Some(Doubt::NotPredicted) => Rejection::SmoothPredicts,
            Some(Doubt::Size) => Rejection::OtherSize,
            Some(Doubt::NotPassed) => Rejection::NotSignificantBesideSmooth,
            None => self.against_the_name(fitted_candidate.id.site),
        }
    }

    /// Whether others are likelier beside the flexible part.
    fn is_less_likely_beside_smooth(&self, fitted_candidate: &FittedCandidate) -> bool {
        let Some(mechanism) = &self.mechanism else { return false };
        let mut foremost = mechanism.close.iter().filter_map(|index| self.at(*index));
        !foremost.any(|one| one.id == fitted_candidate.id)
    }

    /// What speaks against a name at this site, besides other candidates.
    fn against_the_name(&self, site: Site) -> Rejection {
        let model = self.stage.fitted.problem.model;
        match self.against {
            Some(Against::Unlisted) => Rejection::UnlistedAt(model.site_name(site)),
            Some(Against::LeftAlong) => Rejection::MoreLeftAt(model.site_name(site)),
            Some(Against::FlexibleTerms) => Rejection::FlexibleTermsAt(model.site_name(site)),
            Some(Against::LeftOver) | None => Rejection::MoreThanNoiseLeft,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{fitted_candidate, gain, two_links_with};
    use crate::{candidates, unlisted};

    const DECLARED: &str = "free: [joint_zero(*)]\nnoise: {p1_mm: 0.05}";

    /// What is found of the small arm, whose elbow has a gain that is wrong.
    fn with_finding(ask: impl Fn(&mut Finding<'_>, &Floor)) {
        let lab: Laboratory = two_links_with(DECLARED, 40, 0.05, 22, |q| [0.0, 0.01 * q[1]]);
        let floor = Floor::among(&lab.problem(&[]).unwrap(), None);
        let asked = Candidates { listed: candidates::probes(&lab), unlisted: unlisted::probes(&lab) };
        let mut finding = lab.find(&floor, &asked, &Progress::unwatched()).unwrap();
        ask(&mut finding, &floor);
    }

    #[test]
    fn what_is_left_with_an_effect_in_is_reported_beyond_the_noise() {
        with_finding(|finding, floor| {
            // 305 squares on 105 degrees of freedom: 200 beyond a noise of 1, in 40 points, sigmas of 0.05 mm.
            let one = FittedCandidate { left: (305.0, 105.0), ..fitted_candidate("joint_gain", 1, 0.0) };
            assert!((finding.left_mm(&one, floor) - 5.0_f64.sqrt() * 0.05).abs() < 1e-12);
            let unknown = Floor { scale: None, ..floor.clone() };
            assert!((finding.left_mm(&one, &unknown) - (305.0_f64 / 40.0).sqrt() * 0.05).abs() < 1e-12);
            let clean = FittedCandidate { left: (100.0, 105.0), ..fitted_candidate("joint_gain", 1, 0.0) };
            assert_eq!(finding.left_mm(&clean, floor), 0.0);
        });
    }

    #[test]
    fn the_named_effect_is_as_probable_as_it_is_likelier_than_the_others_and_than_none() {
        with_finding(|finding, _| {
            assert_eq!(finding.verdict, Verdict::Named);
            let probable = finding.probability().unwrap();
            let criteria: Vec<f64> = finding
                .stage
                .fitted_candidates
                .iter()
                .filter(|one| one.is_plausible())
                .map(|one| one.bic)
                .chain([finding.stage.bic])
                .collect();
            let best = criteria[0];
            let likely = 1.0 / criteria.iter().map(|one| (-0.5 * (one - best)).exp()).sum::<f64>();
            assert!(probable > 0.99 && (probable - likely).abs() < 1e-9, "{probable} {likely}");
            // Where more is left than noise nothing is said without weighing.
            finding.dirty = true;
            assert!(finding.probability().is_none() && finding.probabilities().is_empty());
        });
    }

    #[test]
    fn what_a_smooth_function_leaves_of_the_best_is_why_it_is_no_name() {
        with_finding(|finding, _| {
            let rejected = |finding: &mut Finding<'_>, close: Vec<usize>, doubt: Option<Doubt>| {
                finding.verdict = Verdict::Located;
                finding.close.truncate(1);
                finding.mechanism = Some(Mechanism::made(close, doubt));
                finding.rejected(finding.best().unwrap()).unwrap()
            };
            let best = finding.close[0];
            let not_passed = rejected(finding, vec![best], Some(Doubt::NotPassed));
            assert_eq!(not_passed, Rejection::NotSignificantBesideSmooth);
            assert_eq!(rejected(finding, vec![best], Some(Doubt::Smooth)), Rejection::SmoothExplains);
            for doubt in [None, Some(Doubt::NotPassed)] {
                let of_another = rejected(finding, vec![best + 1], doubt);
                assert_eq!(of_another, Rejection::LessLikelyBesideSmooth);
            }
            assert_eq!(rejected(finding, vec![best], None), Rejection::MoreThanNoiseLeft);
            // Another that fits better without the smooth function is not in its way.
            finding.close = vec![
                finding.stage.fitted_candidates.iter().rposition(FittedCandidate::is_plausible).unwrap(),
            ];
            let last = finding.close[0];
            assert!(last > best, "others are plausible");
            assert_eq!(rejected(finding, vec![last], Some(Doubt::Smooth)), Rejection::SmoothExplains);
        });
    }

    #[test]
    fn a_candidate_is_reported_the_first_reason_why_it_is_no_name() {
        with_finding(|finding, _| {
            let named = finding.best().unwrap().id.clone();
            let own = finding.stage.fitted_candidates[0].id.clone();
            assert!(named == own && finding.rejected(&finding.stage.fitted_candidates[0]).is_none());
            let other = || fitted_candidate("joint_zero", 0, 50.0);
            let why = |one: FittedCandidate| finding.rejected(&one).unwrap();
            assert_eq!(
                why(FittedCandidate { holm_p: NAMING_LEVEL, ..other() }),
                Rejection::NotSignificant(NAMING_LEVEL)
            );
            let mut implausible = other();
            implausible.score.plausible = false;
            assert_eq!(why(implausible), Rejection::Implausible);
            let outvoted = FittedCandidate { outvoted: true, ..other() };
            assert_eq!(why(outvoted), Rejection::Outvoted);
            assert_eq!(why(FittedCandidate { gains: vec![gain(0.5)], ..other() }), Rejection::NotPredicted);
            // What was not refitted was not asked to predict.
            let expected = FittedCandidate { gains: vec![gain(0.5)], refitted: false, ..other() };
            let worse = || Rejection::WorseThan("joint_gain(elbow)".to_owned());
            assert_eq!(why(expected), worse());
            assert_eq!(why(other()), worse());
        });
        with_finding(|finding, _| {
            (finding.verdict, finding.free_first) = (Verdict::Tied, Some(GEOMETRY));
            let rejection = finding.rejected(&finding.stage.fitted_candidates[0]).unwrap();
            assert_eq!(rejection, Rejection::HeldGeometry(GEOMETRY));
        });
        with_finding(|finding, _| {
            finding.verdict = Verdict::Tied;
            finding.close.push(1);
            finding.stage.fitted_candidates[1].holm_p = 1e-9;
            finding.stage.fitted_candidates[1].score.plausible = true;
            let rejection = finding.rejected(&finding.stage.fitted_candidates[1]).unwrap();
            assert_eq!(rejection, Rejection::IndistinguishableFrom(vec!["joint_gain(elbow)".to_owned()]));
        });
    }
}
