//! Candidates: every effect of the library, and of the model file's own definitions, that this table could show; and the best
//! variant of each where something inside it is searched for.

use std::sync::Arc;

use crate::laboratory::{Laboratory, LaboratoryError};
use crate::score_test::{Probe, Score, score};
use crate::thresholds::{HIGH_ORDER, HIGH_ORDER_WEIGHT, ORDERS_SEARCHED};
use plumb_calibration::arm_model::Epochs;
use plumb_calibration::effect::{self, CandidateContext, EffectId, Family, Search};
use plumb_estimation::Progress;

/// Everything that could be at work.
pub(crate) struct Candidates {
    /// Effects of the library.
    pub(crate) listed: Vec<Probe>,
    /// Mechanisms without a name.
    pub(crate) unlisted: Vec<Probe>,
}

impl Candidates {
    /// What the search for an effect of the library costs in Schwarz's criterion of a fit to so many equations; nothing of one that is no candidate.
    pub(crate) fn search_cost(&self, id: &EffectId, equations: f64) -> f64 {
        let probe = self.listed.iter().find(|probe| probe.id == *id);
        probe.map_or(0.0, |probe| probe.search_cost + probe.search.cost(equations))
    }
}

/// All candidates a table could show, ready to be scored.
pub(crate) fn probes(lab: &Laboratory) -> Vec<Probe> {
    let context: CandidateContext<'_> = lab.context();
    let fitted = lab.fitted_effects().unwrap_or_default();
    let mut probes: Vec<Probe> = Vec::new();
    let mut family = 0;
    for kind in effect::kinds() {
        for id in (kind.candidates)(&context) {
            // What is fitted already explains all it can.
            if fitted.iter().any(|known| known.id.same_as(&id)) {
                continue;
            }
            if let Ok(built) = effect::build(&id, lab.model()) {
                // Variants that differ only in what is searched for follow one another.
                let same = probes.last().is_some_and(|last| last.id.same_as(&id));
                // Families are what Holm's correction counts: a time constant tried at ten values is one candidate.
                family += usize::from(!same);
                let rare = id.order.is_some_and(|order| order > HIGH_ORDER);
                probes.push(Probe {
                    id,
                    effect: Arc::from(built),
                    search: kind.search,
                    family,
                    weight: if rare { HIGH_ORDER_WEIGHT } else { 1.0 },
                    search_cost: match kind.family {
                        Family::Epoch => cost_of_dates(lab),
                        // Extended BIC (Chen & Chen 2008) for the one order among so many; Holm's weights do the same for the probabilities.
                        _ if rare => 2.0 * ORDERS_SEARCHED.ln(),
                        _ => 0.0,
                    },
                });
            }
        }
    }
    for definition in &lab.model().definitions {
        let id = EffectId::at(&definition.name, definition.site);
        if let (false, Ok(built)) =
            (fitted.iter().any(|known| known.id.same_as(&id)), effect::build(&id, lab.model()))
        {
            family += 1;
            let effect = Arc::from(built);
            probes.push(Probe { id, effect, search: Search::Nothing, family, weight: 1.0, search_cost: 0.0 });
        }
    }
    probes
}

/// What it costs in Schwarz's criterion that jumps were searched for among the rows: as much each as that of one joint.
fn cost_of_dates(lab: &Laboratory) -> f64 {
    let jumps = match &lab.model().epochs {
        Some(Epochs::Rows(rows)) => rows.len(),
        Some(Epochs::Times(times)) => times.len(),
        Some(Epochs::Sessions(_)) | None => 0,
    };
    let equations = lab.measured_rows().iter().map(|row| lab.observations().range(*row).len()).sum::<usize>();
    jumps as f64 * Search::Jumps.cost(equations as f64)
}

/// The best variant of every family, its score charged for the search: list of (probe, score).
pub(crate) fn best_variants(probes: &[Probe], scores: Vec<Score>) -> Vec<(usize, Score)> {
    let mut best: Vec<(usize, Score)> = Vec::new();
    let mut members: Vec<usize> = Vec::new();
    for (index, score) in scores.into_iter().enumerate() {
        let family = probes.get(index).map(|probe| probe.family);
        match (best.last_mut(), members.last_mut()) {
            (Some(last), Some(count)) if probes.get(last.0).map(|probe| probe.family) == family => {
                *count += 1;
                if score.gain > last.1.gain {
                    *last = (index, score);
                }
            }
            _ => {
                best.push((index, score));
                members.push(1);
            }
        }
    }
    for ((index, score), count) in best.iter_mut().zip(members) {
        match probes.get(*index).map(|probe| probe.search) {
            // A number searched for on a grid costs as one that is fitted; moments of a jump are many tests, and cost as these (Bonferroni).
            Some(Search::Smooth) if score.freedom > 0 => score.charge_parameter(),
            Some(Search::Jumps) => score.p = (score.p * f64::from(count as u32)).min(1.0),
            _ => {}
        }
    }
    best
}

impl Laboratory {
    /// An effect with what is searched for inside it set to what the data like best.
    pub(crate) fn searched(&self, id: EffectId, progress: &Progress) -> Result<EffectId, LaboratoryError> {
        let kind = effect::kind(&id.name);
        if id.inner.is_some() || kind.is_none_or(|kind| kind.search == Search::Nothing) {
            return Ok(id);
        }
        let mut variants = probes(self);
        variants.retain(|probe| probe.id.same_as(&id));
        let fitted = self.fit_with(&[], None, progress)?;
        let scores = score(&fitted.problem, &fitted.fit, &variants);
        let best = best_variants(&variants, scores).into_iter().next();
        let found = best.and_then(|(index, _)| variants.get(index)).map(|probe| probe.id.clone());
        found.ok_or_else(|| {
            let label = self.model().label(&id);
            LaboratoryError::Refused(format!(
                "{label}: this table cannot show it; it lacks what the effect depends on"
            ))
        })
    }
}

#[cfg(test)]
mod tests;
