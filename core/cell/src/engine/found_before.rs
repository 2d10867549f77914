//! What a run that is resumed had found before it was interrupted, reported again with the steps that are done: the last page shows the whole run.

use plumb_record::{Record, RecordError, RunId, StoredCorrection, StoredTrigger};

use crate::event::{Correction, Event, NamedValue, StepPath};

/// What was found, step by step.
pub(crate) struct FoundBefore {
    triggers: Vec<StoredTrigger>,
    /// Those that were undone since are not among them.
    corrections: Vec<StoredCorrection>,
}

impl FoundBefore {
    /// As the record holds it.
    pub(crate) fn of(record: &Record, run: RunId) -> Result<Self, RecordError> {
        let undone = record.undone_in_run(run)?;
        let mut corrections = record.corrections_of_run(run)?;
        corrections.retain(|one| undone.iter().all(|(id, _)| *id != one.id));
        let mut triggers = record.triggers(run)?;
        triggers.retain(|trigger| trigger.fine);
        Ok(Self { triggers, corrections })
    }

    /// What a step found in its last attempt, in the order in which it reported it.
    pub(crate) fn events(&self, step: &StepPath) -> Vec<Event> {
        let trigger = self.triggers.iter().rev().find(|trigger| trigger.step == step.0);
        let corrections = self.corrections.iter().filter(|one| one.step == step.0);
        trigger.and_then(trigger_found).into_iter().chain(corrections.flat_map(correction_events)).collect()
    }
}

fn trigger_found(trigger: &StoredTrigger) -> Option<Event> {
    let joints: Vec<NamedValue> = serde_json::from_value(trigger.joints.clone()).ok()?;
    let half_width = NamedValue {
        name: trigger.joint.clone(),
        value: trigger.half_width,
        unit: trigger.unit.clone(),
        uncertainty: None,
    };
    let (step, device) = (StepPath(trigger.step.clone()), trigger.device.clone());
    Some(Event::TriggerFound { step, device, joints, half_width })
}

fn correction_events(one: &StoredCorrection) -> Vec<Event> {
    let correction = Correction {
        device: one.key.device.clone(),
        quantity: one.key.quantity.clone(),
        site: one.key.site.clone(),
        old: one.old,
        new: one.new,
        uncertainty: one.uncertainty,
        budget: one.budget.clone(),
        unit: one.unit.clone(),
    };
    let proposed = Event::CorrectionProposed { correction: correction.clone() };
    let applied = one.revision.map(|revision| Event::CorrectionApplied { correction, revision });
    [Some(proposed), applied].into_iter().flatten().collect()
}
