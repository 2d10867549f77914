//! Whether the probabilities of the lab mean what they say, over a cell's trials.

use plumb_diagnosis::Diagnosis;
use plumb_simulated::physics::campaign::Truth;

use super::cells::Work;
use super::error::BenchmarkError;
use super::lab;
use super::trials::over_cases;
use crate::reliability::Forecast;

/// What was said in some trials.
#[derive(Debug, Default, serde::Serialize)]
pub(super) struct Forecasts {
    /// Of each candidate that was given a probability: that it is hidden. Effects of one name at one site are one candidate.
    pub(super) candidates: Vec<Forecast>,
    /// Of what is named, located or tied: that what is hidden is among it.
    pub(super) verdicts: Vec<Forecast>,
}

impl Forecasts {
    /// Adds what another says.
    pub(super) fn take(&mut self, other: Self) {
        self.candidates.extend(other.candidates);
        self.verdicts.extend(other.verdicts);
    }

    fn of(diagnosis: &Diagnosis, truth: &Truth) -> Self {
        let hides = |effect: &str, site: &str| {
            truth.hidden.iter().any(|hidden| hidden.effect == effect && hidden.site == site)
        };
        Self {
            candidates: candidates(diagnosis, &|_| true, &hides),
            verdicts: diagnosis
                .probability
                .map(|probability| Forecast { probability, came_true: is_in_set(diagnosis, &hides) })
                .into_iter()
                .collect(),
        }
    }
}

/// Effect, site and probability of those candidates that were given one. Effects of one name at one site are one candidate, with the sum of their probabilities.
pub(crate) fn probabilities(diagnosis: &Diagnosis) -> Vec<(&str, &str, f64)> {
    let mut by_site: Vec<(&str, &str, f64)> = Vec::new();
    for candidate in &diagnosis.candidates {
        let (Some(probability), effect) = (candidate.probability, &candidate.effect) else { continue };
        match by_site.iter_mut().find(|(name, site, _)| *name == effect.effect && *site == effect.site) {
            Some((_, _, sum)) => *sum = (*sum + probability).min(1.0),
            None => by_site.push((&effect.effect, &effect.site, probability)),
        }
    }
    by_site
}

/// Forecasts of those candidates that were given a probability and are asked about; one is true if it is hidden.
pub(crate) fn candidates(
    diagnosis: &Diagnosis,
    asked: &impl Fn((&str, &str)) -> bool,
    hides: &impl Fn(&str, &str) -> bool,
) -> Vec<Forecast> {
    let forecast =
        |(name, site, probability): (&str, &str, f64)| Forecast { probability, came_true: hides(name, site) };
    let all = probabilities(diagnosis).into_iter();
    all.filter(|(name, site, _)| asked((*name, *site))).map(forecast).collect()
}

/// Whether what is hidden is named, tied, or in the family that is located.
fn is_in_set(diagnosis: &Diagnosis, hides: &impl Fn(&str, &str) -> bool) -> bool {
    let named = diagnosis.named.iter().map(|named| &named.effect);
    let located = diagnosis.located.as_ref();
    named.chain(&diagnosis.tied).any(|one| hides(&one.effect, &one.site))
        || located.is_some_and(|one| one.family.iter().any(|effect| hides(effect, &one.site)))
}

/// What is said in every trial of a cell.
pub(super) fn forecasts(work: &Work, seed: u64, count: usize) -> Result<Forecasts, BenchmarkError> {
    let reported = over_cases(work, seed, count, |case| {
        let refused = |source| BenchmarkError::Lab { seed: case.truth.seed, source: Box::new(source) };
        Ok(Forecasts::of(&lab::in_full(case).map_err(refused)?, &case.truth))
    })?;
    let mut all = Forecasts::default();
    reported.into_iter().for_each(|one| all.take(one));
    Ok(all)
}
