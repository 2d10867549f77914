//! What is asked of one stage: the suspects beside a flexible part, each weighed by its marginal likelihood.

use super::suspects::{Suspect, Who};
use crate::explainable::{Features, Mixed, MixedFit};
use crate::forward_selection::{Contender, Stage};
use plumb_estimation::for_each;

/// A suspect's fit and its criterion: twice the negative logarithm of its marginal likelihood.
pub(super) struct Weighed<'s> {
    pub(super) suspect: &'s Suspect,
    pub(super) fit: MixedFit,
    pub(super) criterion: f64,
}

/// Everything that is asked of one stage.
pub(super) struct Bench<'b> {
    pub(super) stage: &'b Stage<'b>,
    pub(super) rows: Vec<usize>,
    pub(super) features: Features,
    pub(super) mixed: Mixed,
    /// Without any suspect.
    pub(super) nothing: MixedFit,
    pub(super) equations: f64,
}

impl Bench<'_> {
    pub(super) fn criterion(&self, fit: &MixedFit, cost: f64) -> f64 {
        fit.deviance + fit.rank as f64 * self.equations.ln() + cost
    }

    pub(super) fn weigh<'s>(&self, suspects: &'s [Suspect]) -> Vec<Weighed<'s>> {
        let fits = for_each(suspects, |one| self.mixed.fit(&one.parameters, Some(&self.nothing.ratios)));
        let weighed = suspects.iter().zip(fits).filter_map(|(suspect, fit)| {
            let fit = fit.filter(|fit| fit.rank > 0)?;
            Some(Weighed { suspect, criterion: self.criterion(&fit, suspect.cost), fit })
        });
        let mut weighed: Vec<Weighed<'_>> = weighed.collect();
        weighed.sort_by(|left, right| left.criterion.total_cmp(&right.criterion));
        weighed
    }

    pub(super) fn contender(&self, weighed: &Weighed<'_>) -> Option<&Contender> {
        match weighed.suspect.who {
            Who::Listed(index) => self.stage.contenders.get(index),
            Who::Unlisted(_) => None,
        }
    }
}
