//! Growing a model: diagnose and add, until nothing more can be named; then go on with corrections, which predict rows they have not seen though their mechanism is
//! not identified.

use serde::Serialize;

use super::claim::Claim;
use super::extrapolation::Extrapolation;
use super::fitted::reductions_by_pose;
use super::found::{CorrectionCandidate, Found};
use super::note::Note;
use super::outcome::{Diagnosis, Named, Verdict};
use super::predictive_gain::Gain;
use super::thresholds::{BATCH_ROWS, CORRECTIONS_TRIED, MOST_CORRECTIONS};
use crate::laboratory::{Addition, Laboratory, LaboratoryError, MapStep, Mapped, Rms, without};
use plumb_calibration::arm_model::{AddedEffect, Correction, Model};
use plumb_calibration::effect::{EffectId, acts_by_epoch, kind};
use plumb_estimation::Progress;

/// RMS after a step, mm.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct StepRms {
    /// Over the rows that were fitted.
    pub fit: f64,
    /// Blocked cross-validation.
    pub cv: Option<f64>,
}

impl From<Rms> for StepRms {
    fn from(rms: Rms) -> Self {
        Self { fit: rms.fit, cv: rms.cv }
    }
}

/// One effect taken in.
#[derive(Debug, Clone, Serialize)]
pub struct Step {
    /// The effect.
    pub added: Named,
    /// What is claimed of it.
    pub claim: Claim,
    /// Of a correction: the mechanisms it may represent.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub may_be: Vec<String>,
    /// As `add` takes it.
    #[serde(skip)]
    pub label: String,
    /// RMS with it in.
    pub rms_mm: StepRms,
    /// What is left over the floor; nothing if the floor is unknown.
    pub floor_ratio: Option<f64>,
    /// The model with it in; nothing inside a batch, whose last step holds it.
    #[serde(skip)]
    pub model: Option<Model>,
}

/// A model grown as far as the data carry it.
#[derive(Debug, Clone, Serialize)]
pub struct Growth {
    /// The diagnosis of what it has become.
    #[serde(flatten)]
    pub diagnosis: Diagnosis,
    /// RMS before anything was added.
    pub start: StepRms,
    /// What was added, in order.
    pub steps: Vec<Step>,
    /// RMS with the mechanisms alone, without any correction; nothing where no correction was added.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mechanisms_alone: Option<StepRms>,
    /// The residual map that was added last; nothing where none was.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub residual_map: Option<MapStep>,
    /// How it does where nothing was measured; reported where effects were taken in by the batch.
    pub extrapolation: Vec<Extrapolation>,
    /// The grown model.
    #[serde(skip)]
    pub model: Model,
}

/// Batches taken in at most: what the first left crooked, the second straightens.
const ROUNDS: usize = 2;

/// Effects taken in at most.
const MOST: usize = 200;

fn count_of_corrections<'s>(steps: impl Iterator<Item = &'s Step>) -> usize {
    steps.filter(|step| step.claim == Claim::Correction).count()
}

/// A model with what was re-set among its rows.
struct AfterReset {
    laboratory: Laboratory,
    steps: Vec<Step>,
    /// The diagnosis of it, where one was made.
    diagnosed: Option<(Diagnosis, Found)>,
    /// Times the held-out rows were looked at.
    opened: u32,
}

/// A model being grown.
struct Growing {
    laboratory: Laboratory,
    diagnosis: Diagnosis,
    found: Found,
    steps: Vec<Step>,
    /// Times the held-out rows were looked at to judge a correction.
    opened: u32,
}

impl Growing {
    /// Takes an addition over and diagnoses what is left. The last of its steps is given the model and what that leaves; the others have their error already.
    fn go_on(
        &mut self,
        addition: Addition,
        mut steps: Vec<Step>,
        progress: &Progress,
    ) -> Result<(), LaboratoryError> {
        let Addition { model, added: values, .. } = addition;
        self.laboratory = Laboratory::new(
            model.clone(),
            self.laboratory.table().clone(),
            self.laboratory.options().clone(),
        )?;
        // Anew with it in: what it took away may have hidden or imitated something else.
        (self.diagnosis, self.found) = self.laboratory.diagnose_for(progress)?;
        for (step, value) in steps.iter_mut().zip(&values) {
            step.added.size = value.size;
            step.added.se = value.se;
            step.added.unit.clone_from(&value.unit);
        }
        if let Some(last) = steps.last_mut() {
            last.rms_mm = StepRms { fit: self.diagnosis.rms_mm.fit, cv: self.diagnosis.rms_mm.cv };
            last.floor_ratio = self.diagnosis.left_ratio;
            last.model = Some(model);
        }
        self.steps.extend(steps);
        Ok(())
    }

    /// A step whose size and error are not known yet.
    fn step(&self, added: Named, effect: &AddedEffect, (claim, may_be): (Claim, Vec<String>)) -> Step {
        let label = self.laboratory.model().label(&effect.id);
        let rms_mm = StepRms { fit: self.diagnosis.rms_mm.fit, cv: self.diagnosis.rms_mm.cv };
        Step { added, claim, may_be, label, rms_mm, floor_ratio: None, model: None }
    }

    /// A step of a correction whose size and error are not known yet.
    fn step_of(&self, candidate: &CorrectionCandidate) -> Step {
        let CorrectionCandidate { effect, site, may_be } = candidate;
        let named = Named { effect: site.clone(), size: 0.0, unit: String::new(), se: 0.0 };
        self.step(named, effect, (Claim::Correction, may_be.clone()))
    }

    /// Adds what is named; whether anything was. What makes held-out rows worse is not added, however well it does elsewhere: the model is used where nothing
    /// was fitted.
    fn add_named(&mut self, progress: &Progress) -> Result<bool, LaboratoryError> {
        let named = self.diagnosis.named.clone().filter(|_| self.diagnosis.verdict == Verdict::Named);
        let (Some(effect), Some(named)) = (self.found.named.take(), named) else { return Ok(false) };
        let label = self.laboratory.model().label(&effect.id);
        // Each look at the locked rows makes them a little less independent; the report says how many there were.
        self.opened += u32::from(!self.laboratory.split().check_rows().is_empty());
        let reduction = self.laboratory.held_out_reduction(std::slice::from_ref(&effect), progress)?;
        if reduction.is_some_and(|reduction| reduction.total < 0.0) {
            self.diagnosis.warnings.push(Note::WorseHeldOut(label));
            return Ok(false);
        }
        let step = self.step(named, &effect, (Claim::Mechanism, Vec::new()));
        let addition = self.laboratory.take_in(vec![effect], progress)?;
        self.go_on(addition, vec![step], progress)?;
        Ok(true)
    }

    /// Adds what was re-set, named or as a correction if those are wanted; whether anything was.
    fn add_reset(&mut self, with_corrections: bool, progress: &Progress) -> Result<bool, LaboratoryError> {
        if self.found.named.as_ref().is_some_and(|effect| acts_by_epoch(&effect.id.name)) {
            return self.add_named(progress);
        }
        let corrections = std::mem::take(&mut self.found.corrections);
        let (reset, others): (Vec<_>, Vec<_>) =
            corrections.into_iter().partition(|candidate| acts_by_epoch(&candidate.effect.id.name));
        self.found.corrections = reset;
        if with_corrections && self.add_correction(progress)? {
            return Ok(true);
        }
        // What goes by the pose is added later, if at all.
        self.found.corrections = others;
        Ok(false)
    }

    /// Adds what is named, and at most so many corrections, until there is nothing more to add.
    fn go_to_the_end(&mut self, corrections: usize, progress: &Progress) -> Result<(), LaboratoryError> {
        // A mechanism first, as long as there is one; a correction would take part of what a name needs.
        while self.steps.len() < MOST {
            if self.add_named(progress)? {
                continue;
            }
            let left = corrections.saturating_sub(count_of_corrections(self.steps.iter()));
            if left == 0 {
                break;
            }
            // One at a time, for something may be named then; together where none is borne out by itself.
            if !self.add_correction(progress)? && self.add_together(left, progress)? == 0 {
                break;
            }
        }
        Ok(())
    }

    /// Grows anew from what was found to act at once in the beginning, where held-out rows are predicted better with that alone than with all that was added one by one: the first of
    /// several effects takes part of what belongs to the others, and what is left then looks like something else.
    fn or_together(
        &mut self,
        (laboratory, steps): (Laboratory, Vec<Step>),
        together: Vec<CorrectionCandidate>,
        corrections: usize,
        progress: &Progress,
    ) -> Result<(), LaboratoryError> {
        let left = corrections.saturating_sub(count_of_corrections(steps.iter()));
        if together.len() < 2 || together.len() > left || !self.diagnosis.verdict.is_unnamed() {
            return Ok(());
        }
        let effects: Vec<AddedEffect> = together.iter().map(|one| one.effect.clone()).collect();
        self.opened += 1;
        let one_by_one = self.laboratory.fit_with(&[], None, progress)?;
        let at_once = laboratory.fit_with(&effects, None, progress)?;
        let held = laboratory.split().check_rows();
        if !Gain::over(&reductions_by_pose((&one_by_one, &at_once), &held)).is_some_and(|gain| gain.counts())
        {
            return Ok(());
        }
        let found = Found { together, ..Found::default() };
        let mut other =
            Growing { laboratory, diagnosis: self.diagnosis.clone(), found, steps, opened: self.opened };
        if other.add_together(left, progress)? > 0 {
            other.go_to_the_end(corrections, progress)?;
            *self = other;
        }
        Ok(())
    }

    /// Adds what was found to act at once, if the held-out rows bear all of it out together; how many corrections that were. One of several effects, added alone, bends to
    /// what the others do, and held-out rows need not bear it out.
    fn add_together(&mut self, most: usize, progress: &Progress) -> Result<usize, LaboratoryError> {
        let together = std::mem::take(&mut self.found.together);
        if together.len() < 2 || together.len() > most {
            return Ok(0);
        }
        let effects: Vec<AddedEffect> = together.iter().map(|one| one.effect.clone()).collect();
        self.opened += 1;
        if !self.laboratory.is_borne_out(&effects, progress)? {
            return Ok(0);
        }
        let mut steps: Vec<Step> = together.iter().map(|one| self.step_of(one)).collect();
        for (count, step) in steps.iter_mut().enumerate().take(effects.len() - 1) {
            let first = effects.iter().take(count + 1).cloned().collect();
            step.rms_mm = self.laboratory.take_in(first, progress)?.rms_mm.into();
        }
        self.add_corrections(together, steps, progress)?;
        Ok(effects.len())
    }

    /// Adds the first correction that the held-out rows bear out; whether there was one.
    fn add_correction(&mut self, progress: &Progress) -> Result<bool, LaboratoryError> {
        let candidates = std::mem::take(&mut self.found.corrections);
        for candidate in candidates.into_iter().take(CORRECTIONS_TRIED) {
            self.opened += 1;
            if self.laboratory.is_borne_out(std::slice::from_ref(&candidate.effect), progress)? {
                let step = self.step_of(&candidate);
                self.add_corrections(vec![candidate], vec![step], progress)?;
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Asks of each correction once more, with all that was added besides in the model: what hid or imitated it when it was added does so no longer, and one that is named
    /// now is a mechanism. Neither of two that may explain one thing together is asked.
    fn name_corrections(&mut self, progress: &Progress) -> Result<(), LaboratoryError> {
        let corrections: Vec<EffectId> =
            self.laboratory.model().corrections.iter().map(|one| one.id.clone()).collect();
        for id in &corrections {
            let label = self.laboratory.model().label(id);
            let shared =
                corrections.iter().any(|other| !other.same_as(id) && may_explain_one_thing(id, other));
            let Some(step) = self.steps.iter_mut().find(|step| step.label == label).filter(|_| !shared)
            else {
                continue;
            };
            if !self.laboratory.names_without(id, progress)? {
                continue;
            }
            step.claim = Claim::Mechanism;
            step.may_be.clear();
            let mut model = self.laboratory.model().clone();
            call_mechanism(&mut model, id);
            self.laboratory = self.laboratory.with_model(model);
            // What is written of a step is its own model.
            self.steps
                .iter_mut()
                .filter_map(|step| step.model.as_mut())
                .for_each(|model| call_mechanism(model, id));
        }
        Ok(())
    }

    /// Adds corrections that the held-out rows bear out.
    fn add_corrections(
        &mut self,
        corrections: Vec<CorrectionCandidate>,
        steps: Vec<Step>,
        progress: &Progress,
    ) -> Result<(), LaboratoryError> {
        let effects = corrections.iter().map(|one| one.effect.clone()).collect();
        let mut addition = self.laboratory.take_in(effects, progress)?;
        // A correction is an interpolation: it holds where it was fitted, and a cell must know where that is.
        addition.model.measured_region = self.laboratory.measured_region();
        let known = corrections.into_iter().map(|one| Correction { id: one.effect.id, may_be: one.may_be });
        addition.model.corrections.extend(known);
        self.go_on(addition, steps, progress)
    }
}

/// Claims a correction of a model, where it has it, as a mechanism. The region is that of the corrections: mechanisms hold outside it as well.
fn call_mechanism(model: &mut Model, id: &EffectId) {
    model.corrections.retain(|one| !one.id.same_as(id));
    model.measured_region = model.measured_region.take().filter(|_| !model.corrections.is_empty());
}

/// Whether two effects may share the explanation of one thing: they act at one joint, and both go with the pose, or both with how it was reached. What goes with the pose is the same
/// in every return to it, so that one of each kind cannot stand in for the other.
fn may_explain_one_thing(one: &EffectId, other: &EffectId) -> bool {
    let by_conditions = |id: &EffectId| kind(&id.name).is_some_and(|kind| kind.depends_on_conditions);
    one.site == other.site && by_conditions(one) == by_conditions(other)
}

impl Laboratory {
    /// Diagnoses and adds until the verdict is not `named`: mechanisms only.
    ///
    /// # Errors
    /// Nothing can be fitted, or cancellation.
    pub fn grow(&self, progress: &Progress) -> Result<Growth, LaboratoryError> {
        self.grow_by(0, progress)
    }

    /// The same with corrections, and a residual map last where rows that were not seen are predicted better with one.
    ///
    /// # Errors
    /// Nothing can be fitted, or cancellation.
    pub fn grow_with_map(&self, progress: &Progress) -> Result<Growth, LaboratoryError> {
        let mut growth = self.grow_with_corrections(progress)?;
        if !growth.diagnosis.verdict.is_unnamed() {
            return Ok(growth);
        }
        let grown = Self::new(growth.model.clone(), self.table().clone(), self.options().clone())?;
        growth.diagnosis.check_opened += u32::from(!grown.split().check_rows().is_empty());
        if let Some(Mapped { model, step, error_mm }) = grown.with_map(progress)? {
            growth.diagnosis.rms_mm = step.rms_mm;
            growth.diagnosis.error_mm = error_mm;
            growth.model = model;
            growth.residual_map = Some(step);
        }
        Ok(growth)
    }

    /// The same, and where nothing can be named goes on with corrections: effects that predict unseen rows in every blocked cross-validation and on held-out rows.
    ///
    /// # Errors
    /// Nothing can be fitted, or cancellation.
    pub fn grow_with_corrections(&self, progress: &Progress) -> Result<Growth, LaboratoryError> {
        let mut growth = self.grow_by(MOST_CORRECTIONS, progress)?;
        let corrections = count_of_corrections(growth.steps.iter());
        if corrections > 0 {
            growth.diagnosis.warnings.push(Note::Corrections(corrections));
        }
        if growth.diagnosis.verdict.is_unnamed() {
            let grown = Self::new(growth.model.clone(), self.table().clone(), self.options().clone())?;
            growth.diagnosis.explainable = grown.explainable(progress)?;
        }
        Ok(growth)
    }

    /// Adds what is named, and at most so many corrections.
    fn grow_by(&self, corrections: usize, progress: &Progress) -> Result<Growth, LaboratoryError> {
        let laboratory = self.without_map().unwrap_or_else(|| self.clone());
        let AfterReset { mut laboratory, mut steps, diagnosed, mut opened } =
            laboratory.with_what_was_reset(corrections, progress)?;
        let reset = steps.len();
        for round in 0..ROUNDS {
            // Waves of low order stay whatever is claimed of them; those with a name of their own are limited.
            let named = steps.iter().filter(|step| step.added.effect.n.is_none());
            let left = corrections.saturating_sub(count_of_corrections(named));
            let Some(batch) = laboratory.batch(round > 0, left, progress)? else { break };
            steps.extend(batch.steps);
            opened += batch.opened;
            laboratory = batch.laboratory;
        }
        if steps.len() > reset {
            let mut growth = self.grown_by_batches(laboratory, steps, progress)?;
            growth.diagnosis.check_opened += opened;
            return Ok(growth);
        }
        let (diagnosis, found) = match diagnosed {
            Some(known) => known,
            None => laboratory.diagnose_for(progress)?,
        };
        let start = StepRms { fit: diagnosis.rms_mm.fit, cv: diagnosis.rms_mm.cv };
        // What was re-set was added before: the story begins with the model the user gave.
        let start = if reset > 0 { self.compare(progress)?.rms_mm.into() } else { start };
        let (before, together) = ((laboratory.clone(), steps.clone()), found.together.clone());
        let mut growing = Growing { laboratory, diagnosis, found, steps, opened };
        growing.go_to_the_end(corrections, progress)?;
        growing.or_together(before, together, corrections, progress)?;
        growing.name_corrections(progress)?;
        let Growing { laboratory, mut diagnosis, steps, opened, .. } = growing;
        diagnosis.check_opened += opened;
        let mechanisms_alone = match count_of_corrections(steps.iter()) {
            0 => None,
            _ => Some(laboratory.mechanisms_alone(progress)?),
        };
        Ok(Growth {
            model: laboratory.model().clone(),
            start,
            steps,
            mechanisms_alone,
            residual_map: None,
            extrapolation: Vec::new(),
            diagnosis,
        })
    }

    /// The model with what was re-set among the rows of a large table, before batches look at the pose: a step in the order of the rows is imitated by any number of
    /// waves of the pose, each of which would be given a name. Adds effects by epoch as long as the diagnosis names them, or bears them out as corrections.
    fn with_what_was_reset(
        self,
        corrections: usize,
        progress: &Progress,
    ) -> Result<AfterReset, LaboratoryError> {
        let jumped = self.table().len() >= BATCH_ROWS
            && self.dated(progress)?.is_some_and(|dated| !dated.jumps.is_empty());
        if !jumped {
            return Ok(AfterReset { laboratory: self, steps: Vec::new(), diagnosed: None, opened: 0 });
        }
        let (diagnosis, found) = self.diagnose_for(progress)?;
        let mut growing = Growing { laboratory: self, diagnosis, found, steps: Vec::new(), opened: 0 };
        while growing.add_reset(growing.steps.len() < corrections, progress)? {}
        let Growing { laboratory, diagnosis, found, steps, opened } = growing;
        Ok(AfterReset { laboratory, steps, diagnosed: Some((diagnosis, found)), opened })
    }

    /// Whether the model without one of its effects is diagnosed to lack just that.
    fn names_without(&self, id: &EffectId, progress: &Progress) -> Result<bool, LaboratoryError> {
        let model = without(self.model(), &self.model().label(id))?;
        let without = Self::new(model, self.table().clone(), self.options().clone())?;
        let (_, found) = without.diagnose_for(progress)?;
        Ok(found.named.is_some_and(|named| named.id.same_as(id)))
    }

    /// Whether the held-out rows are predicted better with effects than without them, by more than one standard error over poses; never where none are locked.
    fn is_borne_out(&self, effects: &[AddedEffect], progress: &Progress) -> Result<bool, LaboratoryError> {
        Ok(self.held_out_reduction(effects, progress)?.is_some_and(|gain| gain.counts()))
    }

    /// By how much the squared errors of the held-out rows fall with effects, mm2, over poses; nothing where none are locked.
    fn held_out_reduction(
        &self,
        effects: &[AddedEffect],
        progress: &Progress,
    ) -> Result<Option<Gain>, LaboratoryError> {
        if let Some(dated) = self.dated_for(effects.iter().map(|effect| &effect.id), progress)? {
            return dated.held_out_reduction(effects, progress);
        }
        // Nothing that is fitted has seen these rows, not even the choice of the effect.
        let held = self.split().check_rows();
        let before = self.fit_with(&[], None, progress)?;
        let after = self.fit_with(effects, Some(&before), progress)?;
        Ok(Gain::over(&reductions_by_pose((&before, &after), &held)))
    }

    /// The error of the model without its corrections.
    fn mechanisms_alone(&self, progress: &Progress) -> Result<StepRms, LaboratoryError> {
        let mut model = self.model().clone();
        let corrections = std::mem::take(&mut model.corrections);
        // What is left is the model that may be believed outside the region as well.
        model.effects.retain(|added| !corrections.iter().any(|one| one.id.same_as(&added.id)));
        let alone = Self::new(model, self.table().clone(), self.options().clone())?;
        let rms = alone.compare(progress)?.rms_mm;
        Ok(StepRms { fit: rms.fit, cv: rms.cv })
    }

    /// What is to say once batches have taken in all they could: nothing passes any more.
    fn grown_by_batches(
        &self,
        grown: Laboratory,
        steps: Vec<Step>,
        progress: &Progress,
    ) -> Result<Growth, LaboratoryError> {
        let start = self.compare(progress)?.rms_mm;
        let fitted = grown.fit_with(&[], None, progress)?;
        let extrapolation = grown.extrapolation(&fitted, self, progress)?;
        let mut diagnosis = grown.settled(&fitted, progress)?;
        for way in extrapolation.iter().filter(|way| way.harmful()) {
            diagnosis.warnings.push(Note::DoesNotExtrapolate(way.clone()));
        }
        Ok(Growth {
            model: grown.model().clone(),
            start: start.into(),
            mechanisms_alone: match count_of_corrections(steps.iter()) {
                0 => None,
                _ => Some(grown.mechanisms_alone(progress)?),
            },
            steps,
            residual_map: None,
            extrapolation,
            diagnosis,
        })
    }
}

#[cfg(test)]
mod tests;
