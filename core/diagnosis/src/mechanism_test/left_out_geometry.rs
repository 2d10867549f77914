//! Errors of the arm's geometry that the model does not free, as rivals of a name. Each kind of them (lengths, offsets, twists, skews) is a random effect: its numbers
//! have one variance, which is estimated (restricted likelihood, Patterson & Thompson 1971; Rasmussen & Williams 2006, section 5.4.1). A handful of wrong numbers of
//! the geometry can be imitated by a few effects that were chosen from many; so effects are charged for the choice (Chen & Chen 2008, extended BIC).

use std::collections::BTreeMap;

use nalgebra::DMatrix;

use crate::explainable::{Features, Mixed, chosen_rows};
use crate::forward_selection::Stage;
use crate::score_test::Probe;
use crate::thresholds::{EVIDENCE_ROWS, TIE_BIC};
use plumb_calibration::effect::{self, Effect, EffectId};

/// The group that holds all of the geometry, as a model file's `free:` takes it.
pub(crate) const GEOMETRY: &str = "geometry(*)";

/// Whether errors of the geometry that is not free explain what these effects were found to explain. `base` is the stage with nothing taken in, the last of `found`
/// is the name in question, `listed` are all candidates, `kept` the rows that are no outliers with all of `found` in: an outlier that only the right effect shows to be one
/// would otherwise be for geometry to explain.
pub(crate) fn explains_as_well(
    base: &Stage<'_>,
    listed: &[Probe],
    found: &[EffectId],
    kept: &[usize],
) -> bool {
    let (problem, fit) = (&base.fitted.problem, &base.fitted.fit);
    let mut rows = chosen_rows(problem, fit, EVIDENCE_ROWS);
    rows.retain(|row| kept.contains(row));
    let components = components(base, listed, &rows);
    let built: Vec<Box<dyn Effect>> =
        found.iter().filter_map(|id| effect::build(id, problem.model).ok()).collect();
    let (Some(name), false) = (built.last(), components.is_empty()) else { return false };
    let columns = columns(base, &built.iter().map(AsRef::as_ref).collect::<Vec<_>>(), &rows);
    let (all, own) = (columns.ncols(), name.parameters().len());
    let features = Features::plain(problem, fit, &rows).with_components(&components);
    let equations = (columns.nrows() as f64).ln();
    // An infinite ratio is a variance of zero: the geometry as the model has it.
    let absent = vec![f64::INFINITY; components.len()];
    let Some(mixed) = Mixed::new(&features, &columns) else { return false };
    let everything: Vec<usize> = (0..all).collect();
    let parts = (
        mixed.fit(&everything, Some(&absent)),
        mixed.fit(&[], None),
        mixed.fit(&everything[all - own..], None),
    );
    let (Some(effects), Some(geometry), Some(beside)) = parts else { return false };
    let families = listed.last().map_or(1.0, |last| last.family as f64);
    let chosen = effects.deviance + effects.rank as f64 * equations + cost_of_choice(families, found.len());
    let with_name = beside.deviance + beside.rank as f64 * equations;
    chosen > geometry.deviance && with_name > geometry.deviance - TIE_BIC
}

/// What it costs in the extended BIC to choose so many effects of so many families. The first is free: it is charged by Holm's correction already.
pub(super) fn cost_of_choice(families: f64, count: usize) -> f64 {
    (1..count).map(|before| 2.0 * ((families - before as f64).max(1.0) / (before as f64 + 1.0)).ln()).sum()
}

/// The columns of each kind of the geometry that is not free, by equations of these rows.
fn components(base: &Stage<'_>, listed: &[Probe], rows: &[usize]) -> Vec<DMatrix<f64>> {
    let mut kinds: BTreeMap<&str, Vec<&dyn Effect>> = BTreeMap::new();
    for probe in listed {
        if let Some(kind) = effect::kind(&probe.id.name).filter(|kind| kind.geometry_group) {
            kinds.entry(kind.name).or_default().push(probe.effect.as_ref());
        }
    }
    kinds.values().map(|effects| columns(base, effects, rows)).collect()
}

/// How the parameters of some effects move the readings: equations of these rows by parameters, sigmas.
fn columns(base: &Stage<'_>, effects: &[&dyn Effect], rows: &[usize]) -> DMatrix<f64> {
    let (problem, fit) = (&base.fitted.problem, &base.fitted.fit);
    let block = problem.block(&fit.state, rows, &fit.weights, effects);
    let free_parameters = problem.free_parameters().len();
    block.jacobian.rows(free_parameters, block.jacobian.nrows() - free_parameters).transpose()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_effect_is_not_charged_for_the_choice_and_five_are_charged_for_a_choice_of_many() {
        assert_eq!(cost_of_choice(100.0, 1), 0.0);
        // 2 ln(C(100, 5) / 100): there are 75,287,520 ways to choose five of a hundred.
        assert!((cost_of_choice(100.0, 5) - 2.0 * (75_287_520.0_f64 / 100.0).ln()).abs() < 1e-9);
    }
}
