//! Many effects at one go: the family of harmonics of a transmission is one decision, not a hundred.
//!
//! One pass over the rows gathers the normal equations of everything fitted and of every candidate, by region of pose
//! space and by random fold. Selection, significance and cross-validation then cost no further pass.

mod fall;
mod left_out;
mod pool;

use super::claim::Claim;
use super::fitted::Fitted;
use super::growth::{Step, StepRms};
use super::lack_of_fit::LackOfFit;
use super::outcome::Named;
use super::thresholds::{BATCH_FAMILY, BATCH_JUDGED_ROWS, BATCH_ROWS, GAIN_ERRORS, OVERWHELMING_GAIN};
use super::verdict::effect_place;
use crate::laboratory::{Laboratory, LaboratoryError};
use crate::noise_floor::Floor;
use fall::Fall;
use left_out::LeftOutPredictions;
use plumb_calibration::arm_model::Model;
use plumb_calibration::effect::EffectId;
use plumb_calibration::fit::FitOptions;
use plumb_estimation::Progress;
use pool::{Pick, Pool};

/// A batch taken in.
pub(super) struct Batch {
    /// The laboratory with the grown model.
    pub(super) laboratory: Laboratory,
    /// One step an effect; the last holds the model.
    pub(super) steps: Vec<Step>,
}

impl Laboratory {
    /// Takes in a family of harmonics, with whatever else the rows ask for beside them, at one go; nothing if the table is
    /// small or no family is at work.
    pub(super) fn batch(&self, again: bool, progress: &Progress) -> Result<Option<Batch>, LaboratoryError> {
        if self.measured_rows().len() < BATCH_ROWS {
            return Ok(None);
        }
        progress.report(0.0, "fitting")?;
        let fitted = self.fit_with(&[], None, progress)?;
        let floor = &Floor::of(&fitted.machine, &fitted.fit, &self.context());
        let pool = Pool::gather(self, &fitted, progress)?;
        progress.report(0.4, "choosing effects")?;
        let Some(picks) = self.picks(again, &pool, &fitted, floor, progress)? else { return Ok(None) };
        progress.report(0.6, "fitting what was chosen")?;
        let (more, moved) = pool.effects(&picks);
        // The weights stay: what is an outlier is judged anew once, when all is in.
        let plain = FitOptions { robust: false, ..self.options().fit };
        let after = self.fit_beside(&more, &fitted, &moved, plain, progress)?;
        let model = self.adopted(&after);
        let steps = self.steps(&pool, &picks, (&fitted, &after), &model, progress)?;
        let laboratory = Self::new(model, self.table().clone(), self.options().clone())?;
        Ok(Some(Batch { laboratory, steps }))
    }

    /// The candidates a batch takes in; nothing if no family is at work. Those that are doubted are closed, and the selection
    /// begins anew: what held beside them may not hold without them.
    fn picks(
        &self,
        again: bool,
        pool: &Pool,
        fitted: &Fitted<'_>,
        floor: &Floor,
        progress: &Progress,
    ) -> Result<Option<Vec<Pick>>, LaboratoryError> {
        let mut closed = Vec::new();
        loop {
            let mut picks = pool.select(&closed);
            picks.truncate(pool.enough(&picks));
            let picks = pool.needed(picks);
            // A family is several harmonics of high order; fewer are left to the search that takes effects one by one, which asks more of each.
            let high = picks.iter().filter(|pick| pool.is_high_order(pick)).count();
            if picks.is_empty() || (high < BATCH_FAMILY && !again) {
                return Ok(None);
            }
            let doubtful = self.doubtful(pool, &picks, fitted, floor, progress)?;
            if doubtful.is_empty() {
                return Ok(Some(picks));
            }
            closed.extend(doubtful);
        }
    }

    /// One step for each pick, with the error that is left after it; the last holds the model.
    fn steps(
        &self,
        pool: &Pool,
        picks: &[Pick],
        (before, after): (&Fitted<'_>, &Fitted<'_>),
        model: &Model,
        progress: &Progress,
    ) -> Result<Vec<Step>, LaboratoryError> {
        let rms = self.rms(&after.machine, &after.fit, progress)?;
        let sized = self.effect_values(&after.machine, &after.fit);
        let known = sized.len().saturating_sub(picks.len());
        let fall = Fall::gather(before, pool, picks);
        let mut steps = Vec::new();
        for (place, pick) in picks.iter().enumerate() {
            let share = place as f64 / picks.len() as f64;
            progress.report(0.8 + 0.2 * share, "describing the fall of the error")?;
            let id: &EffectId = &pool.probes[pick.probe].id;
            let value = sized.get(known + place);
            let last = place + 1 == picks.len();
            steps.push(Step {
                added: Named {
                    effect: effect_place(&before.machine, id),
                    size: value.map_or(0.0, |value| value.size),
                    unit: value.map_or_else(String::new, |value| value.unit.clone()),
                    se: value.map_or(f64::INFINITY, |value| value.se),
                },
                claim: Claim::Mechanism,
                may_be: Vec::new(),
                label: self.model().label(id),
                rms_mm: match last {
                    true => StepRms { fit: rms.fit, cv: rms.cv },
                    false => fall.after(pool, picks, place + 1),
                },
                floor_ratio: None,
                model: last.then(|| model.clone()),
            });
        }
        Ok(steps)
    }

    /// Picks with a name of their own that may not be claimed: another candidate would do as well beside the other picks,
    /// or rows left out are not predicted better with them in. A family of harmonics is judged as a whole, and elsewhere.
    fn doubtful(
        &self,
        pool: &Pool,
        picks: &[Pick],
        fitted: &Fitted<'_>,
        floor: &Floor,
        progress: &Progress,
    ) -> Result<Vec<usize>, LaboratoryError> {
        let named: Vec<(usize, &Pick)> =
            picks.iter().enumerate().filter(|(_, pick)| pool.probes[pick.probe].id.order.is_none()).collect();
        if named.is_empty() {
            return Ok(Vec::new());
        }
        // A doubt needs no more rows than this, and the derivatives by every number that is fitted are kept for each.
        let thin = self.thinned(BATCH_JUDGED_ROWS);
        let laboratory = thin.as_ref().unwrap_or(self);
        let rows = laboratory.measured_rows();
        let (more, moved) = pool.effects(picks);
        let (machine, state) = laboratory.expected(&more, fitted, &moved)?;
        let joints = named.iter().filter_map(|(_, pick)| pool.probes[pick.probe].id.joint()).collect();
        let predictions =
            LeftOutPredictions::of(&machine, &state, (&rows, &fitted.fit.weights), &joints, progress)?;
        // Where more than noise is left whatever is taken in, a name takes overwhelming evidence.
        let unfinished = LackOfFit::beside(predictions.noise(), floor)
            .is_none_or(|lack_of_fit| lack_of_fit.is_significant());
        let asked = if unfinished { OVERWHELMING_GAIN } else { GAIN_ERRORS };
        let mut doubtful = Vec::new();
        for (place, pick) in named {
            progress.check()?;
            // The picks are the last of the machine's parts, in their order.
            let gains = predictions.gains(machine.parts.len() - picks.len() + place);
            let predicts = gains.iter().all(|gain| gain.total > asked * gain.error);
            // A gain must show in every way of leaving out: by region, by range of its joint, by session.
            if !predicts || pool.rivalled(picks, place) {
                doubtful.push(pick.probe);
            }
        }
        Ok(doubtful)
    }
}

#[cfg(test)]
mod tests;
