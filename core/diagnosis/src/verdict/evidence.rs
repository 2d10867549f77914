//! What a verdict rests on besides the fitted candidates: mechanisms without a name, directions, what is left.

use crate::candidates::{Candidates, best_variants};
use crate::direction_test;
use crate::forward_selection::{Stage, is_shared_error};
use crate::laboratory::Laboratory;
use crate::lack_of_fit::LackOfFit;
use crate::noise_floor::Floor;
use crate::score_test::{Probe, score};
use crate::thresholds::{TIE_BIC, UNLISTED_LEVEL};
use plumb_calibration::arm_model::AddedEffect;
use plumb_calibration::effect::{self, Search, Site};
use plumb_estimation::{bic_above, holm};

/// What a verdict rests on besides the fitted candidates.
#[derive(Default)]
pub(super) struct Evidence {
    /// What is left without the effect in question.
    pub(super) lack_of_fit: Option<LackOfFit>,
    /// What is left when everything that passed is in.
    pub(super) left_over: Option<LackOfFit>,
    /// Places where something without a name is still at work when everything that passed is in.
    pub(super) unlisted_sites: Vec<Site>,
    /// Place of something without a name that does better than the effect in question.
    pub(super) rivals: Option<Site>,
    /// Places where, by its direction, all may sit that the model as it is lacks; the likeliest first.
    pub(super) alone: Vec<Site>,
    /// Places along whose motion more is left than across it when everything that passed is in.
    pub(super) uneven: Vec<Site>,
    /// Joint on which more than one of the effects sits that can imitate anything.
    pub(super) flexible_terms_at: Option<Site>,
    /// Readings next to each other err alike: chance says nothing of what they share.
    pub(super) errs_alike: bool,
}

/// What speaks against a name at a site, besides other candidates.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Against {
    /// A mechanism without a name is at work there too.
    Unlisted,
    /// More is left along the motion of that site than across it.
    LeftAlong,
    /// Several effects that can imitate anything were taken in there.
    FlexibleTerms,
    /// More than noise is left with everything in.
    LeftOver,
}

impl Evidence {
    /// What speaks against a name at this site, the most specific first.
    pub(super) fn against_a_name_at(&self, site: Site) -> Option<Against> {
        if self.unlisted_sites.contains(&site) {
            Some(Against::Unlisted)
        } else if self.uneven.contains(&site) {
            Some(Against::LeftAlong)
        } else if self.flexible_terms_at == Some(site) {
            Some(Against::FlexibleTerms)
        } else {
            self.is_unfinished().then_some(Against::LeftOver)
        }
    }

    /// Whether more than noise is left with everything in.
    pub(super) fn is_unfinished(&self) -> bool {
        self.left_over.is_some_and(|lack_of_fit| lack_of_fit.is_significant())
    }
}

impl Laboratory {
    /// What the stages say besides their fitted candidates, the first with nothing taken in and the last with all. Of what is left where readings next to each other err alike
    /// no mechanism without a name and no direction is asked once it is less than the noise.
    pub(super) fn evidence_of(
        &self,
        stages: &[Stage<'_>],
        candidates: &Candidates,
        floor: &Floor,
    ) -> Evidence {
        let mut evidence = Evidence::default();
        let (Some(first), Some(full)) = (stages.first(), stages.last()) else { return evidence };
        evidence.errs_alike = full.fitted.problem.neighbours_err_alike();
        evidence.left_over = LackOfFit::of(&full.fitted, floor);
        let alone = self.direction_tests(&first.fitted, floor);
        evidence.alone = direction_test::possible_sites(&alone, floor);
        evidence.flexible_terms_at = flexible_terms_at(&full.taken);
        if !is_shared_error(evidence.errs_alike, evidence.left_over) {
            evidence.unlisted_sites = unlisted_sites(full, &candidates.unlisted);
            let rest = if stages.len() == 1 { alone } else { self.direction_tests(&full.fitted, floor) };
            evidence.uneven = direction_test::uneven_sites(&rest);
        }
        evidence
    }
}

/// The joint on which more than one effect sits that imitates anything.
pub(super) fn flexible_terms_at(taken: &[AddedEffect]) -> Option<Site> {
    let flexible = taken.iter().map(|taken| &taken.id);
    let flexible = flexible.filter(|id| effect::kind(&id.name).is_some_and(|kind| kind.imitates_anything));
    let mut sites = flexible.map(|id| id.site);
    while let Some(site) = sites.next() {
        if sites.clone().any(|other| other == site) {
            return Some(site);
        }
    }
    None
}

/// Sites of those p values that are significant after Holm's correction, the clearest first.
pub(super) fn significant_sites(tests: &[(f64, Site)]) -> Vec<Site> {
    let p_values: Vec<f64> = tests.iter().map(|(p, _)| *p).collect();
    let adjusted = holm(&p_values, &vec![1.0; p_values.len()]);
    let mut found: Vec<(f64, Site)> = adjusted
        .into_iter()
        .zip(tests)
        .map(|(p, (_, site))| (p, *site))
        .filter(|(p, _)| *p < UNLISTED_LEVEL)
        .collect();
    found.sort_by(|left, right| left.0.total_cmp(&right.0));
    found.into_iter().map(|(_, site)| site).collect()
}

/// Sites where something the library has no name for is at work beyond a stage, the clearest first.
fn unlisted_sites(stage: &Stage<'_>, unlisted: &[Probe]) -> Vec<Site> {
    let scores = best_variants(unlisted, score(&stage.fitted.problem, &stage.fitted.fit, unlisted));
    let tests = scores.iter().filter_map(|(index, score)| Some((score.p, unlisted.get(*index)?.id.site)));
    significant_sites(&tests.collect::<Vec<_>>())
}

/// Where something without a name does better than every fitted candidate, clearly, and is no chance find itself.
pub(super) fn unlisted_against(stage: &Stage<'_>, unlisted: &[Probe]) -> Option<Site> {
    let best = stage
        .fitted_candidates
        .iter()
        .filter(|fitted_candidate| fitted_candidate.score.plausible)
        .map(|fitted_candidate| fitted_candidate.bic);
    let best = best.fold(f64::INFINITY, f64::min);
    let fit = &stage.fitted.fit;
    let (squares, equations, rank) = (fit.normal.squares, fit.normal.equations as f64, fit.rank() as f64);
    let scores = best_variants(unlisted, score(&stage.fitted.problem, fit, unlisted));
    let p_values: Vec<f64> = scores.iter().map(|(_, score)| score.p).collect();
    let adjusted = holm(&p_values, &vec![1.0; p_values.len()]);
    let strongest = scores.iter().zip(adjusted).filter_map(|((index, score), p)| {
        let promised = (squares - score.gain).max(squares * 1e-9);
        let cost = Search::Smooth.cost(equations);
        let least = stage.fitted.problem.least_variance();
        let own = bic_above(least, promised, equations, rank + score.freedom as f64, cost);
        Some((own, unlisted.get(*index)?.id.site)).filter(|_| score.freedom > 0 && p < UNLISTED_LEVEL)
    });
    let (own, site) = strongest.min_by(|left, right| left.0.total_cmp(&right.0))?;
    (own < best - TIE_BIC && own < stage.bic - TIE_BIC).then_some(site)
}
