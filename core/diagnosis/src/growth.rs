//! Growing a model: diagnose and add, until nothing more can be named.

use serde::Serialize;

use super::extrapolation::Extrapolation;
use super::outcome::{Diagnosis, Named, Verdict};
use crate::laboratory::{Laboratory, LaboratoryError};
use plumb_calibration::arm_model::{AddedEffect, Model};
use plumb_calibration::effect::EffectId;
use plumb_estimation::Progress;

/// RMS after a step, mm.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct StepRms {
    /// Over the rows that were fitted.
    pub fit: f64,
    /// Blocked cross-validation.
    pub cv: Option<f64>,
}

/// One effect taken in.
#[derive(Debug, Clone, Serialize)]
pub struct Step {
    /// The effect.
    pub added: Named,
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
    /// How it does where nothing was measured; told where effects were taken in by the batch.
    pub extrapolation: Vec<Extrapolation>,
    /// The grown model.
    #[serde(skip)]
    pub model: Model,
}

/// Batches taken in at most: what the first left crooked, the second straightens.
const ROUNDS: usize = 2;

/// Effects taken in at most.
const MOST: usize = 200;

impl Laboratory {
    /// Diagnoses and adds until the verdict is not `named`.
    ///
    /// # Errors
    /// Nothing can be fitted, or cancellation.
    pub fn grow(&self, progress: &Progress) -> Result<Growth, LaboratoryError> {
        let mut laboratory = self.clone();
        let mut steps: Vec<Step> = Vec::new();
        for round in 0..ROUNDS {
            let Some(batch) = laboratory.batch(round > 0, progress)? else { break };
            steps.extend(batch.steps);
            laboratory = batch.laboratory;
        }
        if !steps.is_empty() {
            return self.grown_by_batches(laboratory, steps, progress);
        }
        let (mut diagnosis, mut found) = laboratory.diagnose_for(progress)?;
        let start = StepRms { fit: diagnosis.rms_mm.fit, cv: diagnosis.rms_mm.cv };
        while let (Verdict::Named, Some((id, values)), Some(named)) =
            (diagnosis.verdict, found.take(), diagnosis.named.clone())
        {
            if steps.len() >= MOST {
                break;
            }
            let label = laboratory.model().label(&id);
            let addition = laboratory.take_in(vec![AddedEffect { id, values }], progress)?;
            laboratory = Laboratory::new(
                addition.model.clone(),
                laboratory.table().clone(),
                laboratory.options().clone(),
            )?;
            (diagnosis, found) = laboratory.diagnose_for(progress)?;
            let sized = addition.added.first().map_or(named.clone(), |value| Named {
                size: value.size,
                se: value.se,
                ..named
            });
            steps.push(Step {
                added: sized,
                label,
                rms_mm: StepRms { fit: diagnosis.rms_mm.fit, cv: diagnosis.rms_mm.cv },
                floor_ratio: diagnosis.left_ratio,
                model: Some(addition.model),
            });
        }
        Ok(Growth { model: laboratory.model().clone(), start, steps, extrapolation: Vec::new(), diagnosis })
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
            diagnosis.warnings.push(format!(
                "does not extrapolate: with {} left out it misses there by {:.3} mm, and by {:.3} mm without what was added; \
                 use it only where was measured",
                way.left_out, way.rms_mm, way.without_mm
            ));
        }
        Ok(Growth {
            model: grown.model().clone(),
            start: StepRms { fit: start.fit, cv: start.cv },
            steps,
            extrapolation,
            diagnosis,
        })
    }
}

/// The named effect with the values it was found at.
pub(super) type Found = Option<(EffectId, Vec<f64>)>;
