//! Who is asked: the likeliest fitted candidates of the library, and the mechanisms without a name that explain most.

use nalgebra::DMatrix;

use super::linearization::Linearization;
use crate::candidates::best_variants;
use crate::fitted::Fitted;
use crate::forward_selection::{FittedCandidate, Stage};
use crate::score_test::{Probe, score};
use crate::thresholds::{EVIDENCE_CANDIDATES, EVIDENCE_UNLISTED};
use plumb_calibration::effect::{self, Effect, EffectId, Site};

/// Waves whose overtones are asked for at most: those behind explain much less.
const WAVES_ASKED: usize = 3;

/// Which candidate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Who {
    /// A fitted candidate of the library, by its index in the stage's list.
    Listed(usize),
    /// Something without a name.
    Unlisted(Site),
}

/// A candidate, and its parameters among the columns.
pub(super) struct AskedCandidate {
    pub(super) id: EffectId,
    pub(super) who: Who,
    pub(super) parameters: Vec<usize>,
    /// What its search costs in Schwarz's criterion.
    pub(super) cost: f64,
    /// Fall of the sum of squares with it alone in, without a flexible part.
    pub(super) gain: f64,
}

/// Everything that is asked of a stage.
pub(super) struct Asked {
    pub(super) candidates: Vec<AskedCandidate>,
    /// Of the likeliest waves: the parameters of their second and third overtone. A wave that has them is no sine: something sticks and slips, or a tooth is worn.
    pub(super) overtones: Vec<(EffectId, Vec<usize>)>,
    /// Equations of these rows by parameters.
    pub(super) columns: DMatrix<f64>,
}

/// The candidates of a stage, and their columns.
pub(super) fn candidates(
    stage: &Stage<'_>,
    about: &Linearization<'_>,
    unlisted: &[Probe],
    rows: &[usize],
) -> Asked {
    let (problem, fit) = (&stage.fitted.problem, &stage.fitted.fit);
    let listed = stage.fitted_candidates.iter().enumerate().take(EVIDENCE_CANDIDATES);
    let built =
        listed.filter_map(|(index, one)| Some((index, one, effect::build(&one.id, problem.model).ok()?)));
    let built: Vec<(usize, &FittedCandidate, Box<dyn Effect>)> = built.collect();
    let mut unlisted_probes = best_variants(unlisted, score(problem, fit, unlisted));
    // By what they explain, not by criterion: they are weighed in the same sets as the others, where their numbers are charged.
    unlisted_probes.sort_by(|left, right| right.1.gain.total_cmp(&left.1.gain));
    let unlisted_probes: Vec<(&Probe, f64)> = unlisted_probes
        .iter()
        .take(EVIDENCE_UNLISTED)
        .filter_map(|(index, score)| Some((unlisted.get(*index)?, score.gain)))
        .collect();
    let mut candidates: Vec<AskedCandidate> = Vec::new();
    let mut effects: Vec<&dyn Effect> = Vec::new();
    let mut next = 0;
    for (index, fitted_candidate, effect) in &built {
        let parameters: Vec<usize> = (next..next + effect.parameters().len()).collect();
        next += parameters.len();
        let (cost, gain) = (fitted_candidate.search_cost, gain_of(stage, fitted_candidate));
        let (id, who) = (fitted_candidate.id.clone(), Who::Listed(*index));
        candidates.push(AskedCandidate { id, who, parameters, cost, gain });
        effects.push(effect.as_ref());
    }
    let equations = fit.normal.equations as f64;
    for (probe, gain) in unlisted_probes {
        let parameters: Vec<usize> = (next..next + probe.effect.parameters().len()).collect();
        next += parameters.len();
        let cost = probe.search_cost + probe.search.cost(equations);
        let (id, who) = (probe.id.clone(), Who::Unlisted(probe.id.site));
        candidates.push(AskedCandidate { id, who, parameters, cost, gain });
        effects.push(probe.effect.as_ref());
    }
    let waves = overtones(stage);
    let mut overtones = Vec::new();
    for (id, effects_of) in &waves {
        let count: usize = effects_of.iter().map(|effect| effect.parameters().len()).sum();
        overtones.push((id.clone(), (next..next + count).collect()));
        next += count;
        effects.extend(effects_of.iter().map(AsRef::as_ref));
    }
    let Fitted { problem, fit } = about.fitted(stage);
    let free_parameters = problem.free_parameters().len();
    let block = problem.block(&fit.state, rows, &fit.weights, &effects);
    let columns = block.jacobian.rows(free_parameters, block.jacobian.nrows() - free_parameters).transpose();
    Asked { candidates, overtones, columns }
}

/// By how much the sum of squares falls with a fitted candidate in: what its score promises, where it was not refitted.
pub(super) fn gain_of(stage: &Stage<'_>, fitted_candidate: &FittedCandidate) -> f64 {
    match fitted_candidate.refitted {
        true => stage.fitted.fit.normal.squares - fitted_candidate.left.0,
        false => fitted_candidate.score.gain,
    }
}

/// The likeliest waves, and the second and third overtone of each.
fn overtones(stage: &Stage<'_>) -> Vec<(EffectId, Vec<Box<dyn Effect>>)> {
    let model = stage.fitted.problem.model;
    let listed = stage.fitted_candidates.iter().take(EVIDENCE_CANDIDATES).map(|one| &one.id);
    let waves = listed.filter_map(|id| Some((id, id.order?)));
    let mut found = Vec::new();
    for (id, order) in waves.take(WAVES_ASKED) {
        let overtones = [2.0, 3.0].map(|times| EffectId { order: Some(times * order), ..id.clone() });
        let built = overtones.iter().filter_map(|id| effect::build(id, model).ok());
        let built: Vec<Box<dyn Effect>> = built.collect();
        if !built.is_empty() {
            found.push((id.clone(), built));
        }
    }
    found
}
