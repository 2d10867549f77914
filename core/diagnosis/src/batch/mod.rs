//! Many effects at one go: the family of harmonics of a transmission is one decision, not a hundred.
//!
//! One pass over the rows gathers the normal equations of everything fitted and of every candidate, by region of pose
//! space and by random fold. Selection, significance and cross-validation then cost no further pass.

mod judged;
mod left_out;
mod pool;
mod step_errors;

use super::claim::Claim;
use super::fitted::Fitted;
use super::growth::{Step, StepRms};
use super::outcome::Named;
use super::thresholds::{BATCH_FAMILY, BATCH_ROWS};
use super::verdict::effect_site;
use crate::laboratory::{Laboratory, LaboratoryError};
use crate::noise_floor::Floor;
use judged::{InPlaceOf, Judged};
use plumb_calibration::arm_model::{Model, ValuePrior};
use plumb_calibration::effect::EffectId;
use plumb_calibration::fit::FitOptions;
use plumb_estimation::Progress;
use pool::{Pick, Pool};
use step_errors::StepErrors;

/// A batch taken in.
pub(super) struct Batch {
    /// The laboratory with the grown model.
    pub(super) laboratory: Laboratory,
    /// One step an effect; the last holds the model.
    pub(super) steps: Vec<Step>,
    /// Times the held-out rows were looked at to judge corrections.
    pub(super) opened: u32,
}

/// What a batch takes in.
struct Chosen {
    picks: Vec<Pick>,
    /// Those of them that are corrections.
    corrections: Vec<InPlaceOf>,
    opened: u32,
}

impl Laboratory {
    /// Takes in a family of harmonics, with whatever else the rows ask for beside them, at one go; nothing if the table is
    /// small or no family is at work. At most so many of them are corrections.
    pub(super) fn batch(
        &self,
        again: bool,
        corrections: usize,
        progress: &Progress,
    ) -> Result<Option<Batch>, LaboratoryError> {
        if self.measured_rows().len() < BATCH_ROWS {
            return Ok(None);
        }
        progress.report(0.0, "fitting")?;
        let fitted = self.fit_with(&[], None, progress)?;
        let floor = &Floor::of(&fitted.problem, &fitted.fit, &self.context());
        let pool = Pool::gather(self, &fitted, progress)?;
        progress.report(0.4, "choosing effects")?;
        let Some(chosen) = self.chosen((again, corrections), &pool, &fitted, floor, progress)? else {
            return Ok(None);
        };
        progress.report(0.6, "fitting what was chosen")?;
        let precisions = pool.precisions(&chosen.picks);
        let (more, moved) = pool.effects(&chosen.picks, &precisions);
        let known = self.knowing(pool.priors(&chosen.picks, &precisions));
        // The weights stay: what is an outlier is judged anew once, when all is in.
        let plain = FitOptions { robust: false, ..self.options().fit };
        let after = known.fit_beside(&more, &fitted, &moved, plain, progress)?;
        let mut model = known.adopted(&after);
        if !chosen.corrections.is_empty() {
            // A correction is an interpolation: it holds where it was fitted, and a cell must know where that is.
            model.measured_region = self.measured_region();
        }
        model.corrections.extend(chosen.corrections.iter().map(|one| one.correction.clone()));
        let steps = known.steps(&pool, (&chosen, &precisions), (&fitted, &after), &model, progress)?;
        let laboratory = Self::new(model, self.table().clone(), self.options().clone())?;
        Ok(Some(Batch { laboratory, steps, opened: chosen.opened }))
    }

    /// The same where so much is known beforehand of values besides.
    fn knowing(&self, priors: Vec<ValuePrior>) -> Self {
        let mut model = self.model().clone();
        model.priors.extend(priors);
        self.with_model(model)
    }

    /// What a batch takes in; nothing if no family is at work. Candidates that are doubted are closed, and the selection
    /// begins anew: what held beside them may not hold without them.
    fn chosen(
        &self,
        (again, corrections): (bool, usize),
        pool: &Pool,
        fitted: &Fitted<'_>,
        floor: &Floor,
        progress: &Progress,
    ) -> Result<Option<Chosen>, LaboratoryError> {
        let (mut closed, mut opened) = (Vec::new(), 0);
        loop {
            progress.check()?;
            let mut picks = pool.select(&closed);
            picks.truncate(pool.enough(&picks));
            let picks = pool.needed(picks);
            // A family is several harmonics of high order; fewer are left to the search that takes effects one by one, which asks more of each.
            let high = picks.iter().filter(|pick| pool.is_high_order(pick)).count();
            if picks.is_empty() || (high < BATCH_FAMILY && !again) {
                return Ok(None);
            }
            let Judged { mut doubtful, in_place: mut kept } =
                self.judged(pool, &picks, |probe| pool.has_own_name(probe), (fitted, floor), progress)?;
            // The best of them come first, as they were selected.
            let more = kept.split_off(corrections.min(kept.len()));
            doubtful.extend(more.iter().map(|one| one.probe));
            if !doubtful.is_empty() {
                closed.extend(doubtful);
                continue;
            }
            kept.extend(self.imitating(pool, &picks, (fitted, floor), progress)?);
            let requested = kept.is_empty() || corrections > 0;
            opened += u32::from(requested && !kept.is_empty());
            if requested && (kept.is_empty() || self.bear_out(pool, &picks, &kept, fitted)) {
                return Ok(Some(Chosen { picks, corrections: kept, opened }));
            }
            closed.extend(kept.iter().map(|one| one.probe));
        }
    }

    /// One step for each pick, with the error that is left after it; the last holds the model.
    fn steps(
        &self,
        pool: &Pool,
        (chosen, precisions): (&Chosen, &[f64]),
        (before, after): (&Fitted<'_>, &Fitted<'_>),
        model: &Model,
        progress: &Progress,
    ) -> Result<Vec<Step>, LaboratoryError> {
        let picks = chosen.picks.as_slice();
        let rms = self.rms(&after.problem, &after.fit, progress)?;
        let sized = self.effect_values(&self.standard_errors(after));
        let known = sized.len().saturating_sub(picks.len());
        let step_errors = StepErrors::gather(before, pool, picks, precisions);
        let mut steps = Vec::new();
        for (index, pick) in picks.iter().enumerate() {
            let fraction = index as f64 / picks.len() as f64;
            progress.report(0.8 + 0.2 * fraction, "describing the fall of the error")?;
            let id: &EffectId = &pool.probes[pick.probe].id;
            let value = sized.get(known + index);
            let last = index + 1 == picks.len();
            let correction = chosen.corrections.iter().find(|one| one.probe == pick.probe);
            steps.push(Step {
                added: Named {
                    effect: effect_site(&before.problem, id),
                    size: value.map_or(0.0, |value| value.size),
                    unit: value.map_or_else(String::new, |value| value.unit.clone()),
                    se: value.map_or(f64::INFINITY, |value| value.se),
                },
                claim: if correction.is_some() { Claim::Correction } else { Claim::Mechanism },
                may_be: correction.map_or_else(Vec::new, |one| one.correction.may_be.clone()),
                label: self.model().label(id),
                rms_mm: match last {
                    true => StepRms { fit: rms.fit, cv: rms.cv },
                    false => step_errors.after(pool, picks, index + 1),
                },
                floor_ratio: None,
                model: last.then(|| model.clone()),
            });
        }
        Ok(steps)
    }
}

#[cfg(test)]
mod tests;
