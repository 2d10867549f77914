//! Growing a model: diagnose and add, until nothing more can be named; then go on with corrections, which predict rows they have not seen though their mechanism is
//! not identified.

use serde::Serialize;

use super::claim::Claim;
use super::extrapolation::Extrapolation;
use super::fitted::falls_by_pose;
use super::found::{CorrectionCandidate, Found};
use super::note::Note;
use super::outcome::{Diagnosis, Named, Verdict};
use super::predictive_gain::Gain;
use super::thresholds::{BATCH_ROWS, CORRECTIONS_TRIED, MOST_CORRECTIONS};
use crate::laboratory::{Addition, Laboratory, LaboratoryError, MapStep, Mapped, Rms};
use plumb_calibration::arm_model::{AddedEffect, Correction, Model};
use plumb_calibration::effect::acts_by_epoch;
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
    /// Takes an addition over and diagnoses what is left.
    fn go_on(
        &mut self,
        addition: Addition,
        (added, label): (Named, String),
        (claim, may_be): (Claim, Vec<String>),
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
        let added = match values.first() {
            Some(value) => Named { size: value.size, se: value.se, unit: value.unit.clone(), ..added },
            None => added,
        };
        self.steps.push(Step {
            added,
            claim,
            may_be,
            label,
            rms_mm: StepRms { fit: self.diagnosis.rms_mm.fit, cv: self.diagnosis.rms_mm.cv },
            floor_ratio: self.diagnosis.left_ratio,
            model: Some(model),
        });
        Ok(())
    }

    /// Adds what is named; whether anything was. What makes held-out rows worse is not added, however well it does elsewhere: the model is used where nothing
    /// was fitted.
    fn add_named(&mut self, progress: &Progress) -> Result<bool, LaboratoryError> {
        let named = self.diagnosis.named.clone().filter(|_| self.diagnosis.verdict == Verdict::Named);
        let (Some(effect), Some(named)) = (self.found.named.take(), named) else { return Ok(false) };
        let label = self.laboratory.model().label(&effect.id);
        // Each look at the locked rows makes them a little less independent; the report says how many there were.
        self.opened += u32::from(!self.laboratory.split().check_rows().is_empty());
        if self.laboratory.locked_fall(&effect, progress)?.is_some_and(|fall| fall.total < 0.0) {
            self.diagnosis.warnings.push(Note::WorseHeldOut(label));
            return Ok(false);
        }
        let addition = self.laboratory.take_in(vec![effect], progress)?;
        self.go_on(addition, (named, label), (Claim::Mechanism, Vec::new()), progress)?;
        Ok(true)
    }

    /// Adds what was re-set, named or as a correction if those are wanted; whether anything was.
    fn add_reset(&mut self, with_corrections: bool, progress: &Progress) -> Result<bool, LaboratoryError> {
        if self.found.named.as_ref().is_some_and(|effect| acts_by_epoch(&effect.id.name)) {
            return self.add_named(progress);
        }
        self.found.corrections.retain(|candidate| acts_by_epoch(&candidate.effect.id.name));
        Ok(with_corrections && self.add_correction(progress)?)
    }

    /// Adds the first correction that the held-out rows bear out; whether there was one.
    fn add_correction(&mut self, progress: &Progress) -> Result<bool, LaboratoryError> {
        let candidates = std::mem::take(&mut self.found.corrections);
        for candidate in candidates.into_iter().take(CORRECTIONS_TRIED) {
            let CorrectionCandidate { effect, place, may_be } = candidate;
            self.opened += 1;
            if !self.laboratory.is_borne_out(&effect, progress)? {
                continue;
            }
            let id = effect.id.clone();
            let label = self.laboratory.model().label(&id);
            let mut addition = self.laboratory.take_in(vec![effect], progress)?;
            // A correction is an interpolation: it holds where it was fitted, and a cell must know where that is.
            addition.model.measured_region = self.laboratory.measured_region();
            addition.model.corrections.push(Correction { id, may_be: may_be.clone() });
            let named = Named { effect: place, size: 0.0, unit: String::new(), se: 0.0 };
            self.go_on(addition, (named, label), (Claim::Correction, may_be), progress)?;
            return Ok(true);
        }
        Ok(false)
    }
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
        let (mut laboratory, mut steps) = laboratory.with_what_was_reset(corrections, progress)?;
        let (reset, mut opened) = (steps.len(), 0);
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
        let (diagnosis, found) = laboratory.diagnose_for(progress)?;
        let start = StepRms { fit: diagnosis.rms_mm.fit, cv: diagnosis.rms_mm.cv };
        // What was re-set was added before: the story begins with the model the user gave.
        let start = if reset > 0 { self.compare(progress)?.rms_mm.into() } else { start };
        let mut corrected = count_of_corrections(steps.iter());
        let mut growing = Growing { laboratory, diagnosis, found, steps, opened: 0 };
        // A mechanism first, as long as there is one; a correction would take part of what a name needs.
        while growing.steps.len() < MOST {
            if growing.add_named(progress)? {
                continue;
            }
            if corrected >= corrections || !growing.add_correction(progress)? {
                break;
            }
            corrected += 1;
        }
        let Growing { laboratory, mut diagnosis, steps, opened, .. } = growing;
        diagnosis.check_opened += opened;
        let mechanisms_alone = match corrected {
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
    ) -> Result<(Self, Vec<Step>), LaboratoryError> {
        let jumped = self.table().len() >= BATCH_ROWS
            && self.dated(progress)?.is_some_and(|dated| !dated.jumps.is_empty());
        if !jumped {
            return Ok((self, Vec::new()));
        }
        let (diagnosis, found) = self.diagnose_for(progress)?;
        let mut growing = Growing { laboratory: self, diagnosis, found, steps: Vec::new(), opened: 0 };
        while growing.add_reset(growing.steps.len() < corrections, progress)? {}
        Ok((growing.laboratory, growing.steps))
    }

    /// Whether the held-out rows are predicted better with an effect than without it, by more than one standard error over poses; never where none are locked.
    fn is_borne_out(&self, effect: &AddedEffect, progress: &Progress) -> Result<bool, LaboratoryError> {
        Ok(self.locked_fall(effect, progress)?.is_some_and(|gain| gain.counts()))
    }

    /// By how much the squared errors of the held-out rows fall with an effect, mm2, over poses; nothing where none are locked.
    fn locked_fall(
        &self,
        effect: &AddedEffect,
        progress: &Progress,
    ) -> Result<Option<Gain>, LaboratoryError> {
        if let Some(dated) = self.dated_for(std::iter::once(&effect.id), progress)? {
            return dated.locked_fall(effect, progress);
        }
        // Nothing that is fitted has seen these rows, not even the choice of the effect.
        let held = self.split().check_rows();
        let before = self.fit_with(&[], None, progress)?;
        let after = self.fit_with(std::slice::from_ref(effect), Some(&before), progress)?;
        Ok(Gain::over(&falls_by_pose((&before, &after), &held)))
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
mod tests {
    use super::*;
    use crate::testing::two_links;

    #[test]
    fn a_model_grows_by_what_is_named_until_nothing_is() {
        let both = |q: [f64; 2]| [0.002 * (5.0 * q[0]).sin(), 0.0015 * (12.0 * q[1]).sin()];
        let lab = two_links(150, "joint_zero(*)", 0.05, 3, both);
        let grown = lab.grow(&Progress::unwatched()).unwrap();
        let added: Vec<(&str, Option<f64>)> =
            grown.steps.iter().map(|step| (step.added.effect.place.as_str(), step.added.effect.n)).collect();
        assert_eq!(added, [("shoulder", Some(5.0)), ("elbow", Some(12.0))]);
        assert!(grown.steps.iter().all(|step| step.claim == Claim::Mechanism));
        assert_eq!(grown.model.effects.len(), 2);
        assert_eq!(grown.mechanisms_alone, None, "no correction was added");
        // The size a step shows is that of the model it made: the first wave's, with nothing else in yet.
        let first = grown.steps[0].model.as_ref().unwrap();
        let amplitude = first.effects[0].values[0].hypot(first.effects[0].values[1]).to_degrees();
        assert!(
            (grown.steps[0].added.size - amplitude).abs() < 1e-9,
            "{:?} {amplitude}",
            grown.steps[0].added
        );
        // Noise of three coordinates is left.
        let left = grown.steps[1].rms_mm.fit;
        assert!(
            (left / (0.05 * 3.0_f64.sqrt()) - 1.0).abs() < 0.15 && grown.start.fit > 3.0 * left,
            "{left}"
        );
    }

    #[test]
    fn what_was_reset_is_added_before_batches_of_a_large_table() {
        let reset = |rows: usize, by: f64| {
            let lab = crate::testing::by_wire(rows, 0.05, 8, |row| if row < rows / 2 { 0.0 } else { by });
            lab.with_what_was_reset(0, &Progress::unwatched()).unwrap()
        };
        let (grown, steps) = reset(BATCH_ROWS, 0.3);
        assert_eq!(steps.len(), 1, "{steps:?}");
        assert_eq!(steps[0].added.effect.effect, "reading_reset");
        assert_eq!(grown.model().effects.len(), 1);
        assert!(reset(BATCH_ROWS - 1, 0.3).1.is_empty(), "a small table is grown one by one");
        assert!(reset(BATCH_ROWS, 0.0).1.is_empty(), "nothing jumps");
    }

    #[test]
    fn the_mechanisms_alone_are_the_model_without_its_corrections() {
        let lab = two_links(60, "joint_zero(*)", 0.05, 9, |q| [0.001 * (3.0 * q[0]).sin(), 0.004 * q[1]]);
        let added = |text: &str| {
            let id = plumb_calibration::effect::parse(text, lab.model()).unwrap();
            let values =
                vec![0.0; plumb_calibration::effect::build(&id, lab.model()).unwrap().parameters().len()];
            AddedEffect { id, values }
        };
        let (gain, wave) = (added("joint_gain(elbow)"), added("joint_harmonic(shoulder, 3)"));
        let with = |effects: &[AddedEffect], corrections: &[AddedEffect]| {
            let ids = corrections.iter().map(|one| one.id.clone());
            let corrections = ids.map(|id| Correction { id, may_be: Vec::new() }).collect();
            lab.with_model(Model { effects: effects.to_vec(), corrections, ..lab.model().clone() })
        };
        let watch = Progress::unwatched();
        let alone = with(&[gain.clone(), wave.clone()], std::slice::from_ref(&wave))
            .mechanisms_alone(&watch)
            .unwrap();
        let expected = with(&[gain], &[]).compare(&watch).unwrap().rms_mm;
        assert!((alone.fit - expected.fit).abs() < 1e-9 && alone.fit > 0.15, "{alone:?}");
    }

    /// What grows from an arm whose elbow has a wave of this amplitude, three rows in ten of which are locked away.
    fn growing(amplitude: f64) -> Growing {
        let lab = two_links(80, "joint_zero(*)", 0.05, 12, |q| [0.0, amplitude * (3.0 * q[1]).sin()]);
        let holdout = crate::split::Holdout::Random { fraction: 0.3, seed: 4 };
        let options = crate::laboratory::Options { holdout, ..lab.options().clone() };
        let laboratory = Laboratory::new(lab.model().clone(), lab.table().clone(), options).unwrap();
        let (diagnosis, found) = laboratory.diagnose_for(&Progress::unwatched()).unwrap();
        Growing { laboratory, diagnosis, found, steps: Vec::new(), opened: 0 }
    }

    /// An effect of that arm, at nothing.
    fn effect_of(laboratory: &Laboratory, text: &str) -> AddedEffect {
        let id = plumb_calibration::effect::parse(text, laboratory.model()).unwrap();
        let built = plumb_calibration::effect::build(&id, laboratory.model()).unwrap();
        AddedEffect { id, values: vec![0.0; built.parameters().len()] }
    }

    #[test]
    fn the_first_correction_that_locked_rows_bear_out_is_added_with_its_region() {
        let watch = Progress::unwatched();
        let mut growing = growing(0.002);
        let lab = growing.laboratory.clone();
        let candidate = |text: &str| CorrectionCandidate {
            effect: effect_of(&lab, text),
            place: crate::testing::effect_at(text, "elbow"),
            may_be: vec![text.to_owned(), "dirt".to_owned()],
        };
        let (nothing, wave) = (candidate("joint_gain(shoulder)"), candidate("joint_harmonic(elbow, 3)"));
        let (id, may_be) = (wave.effect.id.clone(), wave.may_be.clone());
        let with = |corrections: Vec<CorrectionCandidate>| Found { corrections, ..Found::default() };
        growing.found = with(vec![candidate("joint_harmonic(elbow, 3)")]);
        assert!(!growing.add_reset(true, &watch).unwrap(), "a wave is nothing that was re-set");
        growing.found = with(vec![nothing, wave]);
        assert!(growing.add_correction(&watch).unwrap());
        assert_eq!((growing.opened, growing.steps.len()), (2, 1), "two looks at the locked rows");
        assert_eq!(count_of_corrections(growing.steps.iter()), 1);
        let (step, model) = (&growing.steps[0], growing.laboratory.model());
        assert_eq!((step.claim, &step.may_be), (Claim::Correction, &may_be));
        assert_eq!(model.corrections, [Correction { id, may_be }]);
        assert!(model.measured_region.is_some() && model.effects.len() == 1);
        growing.found.corrections.clear();
        assert!(!growing.add_correction(&watch).unwrap() && growing.opened == 2);
    }

    #[test]
    fn a_name_that_makes_locked_rows_worse_is_not_added() {
        let watch = Progress::unwatched();
        let mut growing = growing(0.0);
        let fall = |growing: &Growing, effect: &AddedEffect| {
            growing.laboratory.locked_fall(effect, &watch).unwrap().unwrap().total
        };
        let waves: Vec<AddedEffect> = (1..9)
            .map(|order| effect_of(&growing.laboratory, &format!("joint_harmonic(elbow, {order})")))
            .collect();
        let worse = waves.into_iter().find(|wave| fall(&growing, wave) < 0.0).unwrap();
        let place = crate::testing::effect_at("joint_harmonic", "elbow");
        growing.diagnosis.named = Some(Named { effect: place, size: 0.1, unit: "deg".to_owned(), se: 0.01 });
        growing.found.named = Some(worse.clone());
        assert!(!growing.add_named(&watch).unwrap(), "the verdict is not that it is named");
        assert_eq!(growing.opened, 0);
        growing.diagnosis.verdict = Verdict::Named;
        growing.found.named = Some(worse.clone());
        assert!(!growing.add_named(&watch).unwrap());
        let label = growing.laboratory.model().label(&worse.id);
        assert_eq!(growing.diagnosis.warnings.last(), Some(&Note::WorseHeldOut(label)));
        assert_eq!((growing.opened, growing.steps.len()), (1, 0));
    }
}
