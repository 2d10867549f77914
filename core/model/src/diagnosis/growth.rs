//! Growing a model: diagnose and add, until nothing more can be named.

use serde::Serialize;

use super::outcome::{Diagnosis, Named, Verdict};
use crate::effect::EffectId;
use crate::file::{AddedEffect, Model};
use crate::laboratory::{Laboratory, LaboratoryError};
use crate::progress::Progress;

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
    /// The model with it in.
    #[serde(skip)]
    pub model: Model,
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
    /// The grown model.
    #[serde(skip)]
    pub model: Model,
}

/// Effects taken in at most.
const MOST: usize = 200;

impl Laboratory {
    /// Diagnoses and adds until the verdict is not `named`.
    ///
    /// # Errors
    /// Nothing can be fitted, or cancellation.
    pub fn grow(&self, progress: &Progress) -> Result<Growth, LaboratoryError> {
        let mut laboratory = self.clone();
        let (mut diagnosis, mut found) = laboratory.diagnose_for(progress)?;
        let start = StepRms { fit: diagnosis.rms_mm.fit, cv: diagnosis.rms_mm.cv };
        let mut steps: Vec<Step> = Vec::new();
        while let (Verdict::Named, Some((id, values)), Some(named)) =
            (diagnosis.verdict, found.take(), diagnosis.named.clone())
        {
            if steps.len() >= MOST {
                break;
            }
            let label = id.label(laboratory.model());
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
                model: addition.model,
            });
        }
        Ok(Growth { model: laboratory.model().clone(), start, steps, diagnosis })
    }
}

/// The named effect with the values it was found at.
pub(super) type Found = Option<(EffectId, Vec<f64>)>;
