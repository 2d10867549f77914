//! Corrections that an earlier attempt of a step applied.

use plumb_record::{CONTROLLER_ZERO, NewCorrection, RecordError, StoredCorrection};

use super::Engine;
use super::run_loop::describe;
use super::step_context::StepContext;
use super::step_error::StepError;
use crate::event::{LogLevel, StepPath};
use crate::in_words::corrected_quantity;

/// Corrections that are in force, and the revision that put them there.
pub(crate) struct AppliedCorrections {
    pub(crate) corrections: Vec<NewCorrection>,
    pub(crate) revision: i64,
}

impl Engine {
    /// What this step of this run has applied already: a run that was killed after it applied corrections and before it said so does not
    /// apply them twice. What was taken back since, as the operator went back, was not applied.
    pub(crate) fn applied_before(&self, at: &StepContext) -> Result<Option<AppliedCorrections>, StepError> {
        Ok(applied_by(self.corrections_that_count()?, &at.path.0))
    }

    /// What this run has found and not taken back.
    fn corrections_that_count(&self) -> Result<Vec<StoredCorrection>, RecordError> {
        let run = self.journal.run;
        let undone = self.journal.record.undone_in_run(run)?;
        let mut stored = self.journal.record.corrections_of_run(run)?;
        stored.retain(|one| undone.iter().all(|(id, _)| *id != one.id));
        Ok(stored)
    }

    /// The corrections in force that the entries `first` to `last` of the plan have applied in this run.
    pub(crate) fn applied_between(
        &self,
        first: usize,
        last: usize,
    ) -> Result<Vec<StoredCorrection>, RecordError> {
        let entries = self.plan.entries.get(first..=last).unwrap_or_default();
        let mut applied = self.corrections_that_count()?;
        applied.retain(|one| one.revision.is_some() && entries.iter().any(|entry| entry.path.0 == one.step));
        Ok(applied)
    }

    /// Takes corrections back with the steps that applied them: what was in force before is so again, as a revision of its own. What a robot's
    /// controller has taken over it keeps.
    pub(crate) fn undo(
        &mut self,
        applied: &[StoredCorrection],
        why: &str,
        at: &StepPath,
    ) -> Result<(), RecordError> {
        let mut devices: Vec<&str> = applied.iter().map(|one| one.key.device.as_str()).collect();
        devices.sort_unstable();
        devices.dedup();
        for device in devices {
            let of_device = applied.iter().filter(|one| one.key.device == device);
            let Some(first) = of_device.filter_map(|one| one.revision).min() else { continue };
            self.undo_of(device, first, why, at)?;
        }
        let kept: Vec<String> = applied.iter().filter(|one| is_kept(one)).map(in_words).collect();
        if !kept.is_empty() {
            let message = format!("the controller keeps what it has taken over: {}", kept.join(", "));
            self.journal.log(LogLevel::Warning, "engine", Some(at), &message)?;
        }
        Ok(())
    }

    /// Brings back what was in force for a device before the revision `first`, which this run made.
    fn undo_of(&mut self, device: &str, first: i64, why: &str, at: &StepPath) -> Result<(), RecordError> {
        let cell = self.cell.name.clone();
        let revisions = self.journal.record.revisions(&cell)?;
        let earlier = revisions.iter().filter(|one| one.device == device && one.revision < first);
        let before = earlier.map(|one| one.revision).max().unwrap_or_default();
        let reason = format!("run {}: {why}", self.journal.run);
        match self.journal.undone(&cell, device, before, &reason) {
            Ok(()) => {}
            // All of it is the controller's.
            Err(RecordError::NothingToBringBack { .. }) => return Ok(()),
            Err(error) => return Err(error),
        }
        let is_robot = self.arms.iter().any(|arm| arm.name == device);
        let taken_over = if is_robot { self.take_over_zeros(device) } else { self.give_corrections(device) };
        match taken_over {
            Ok(()) => Ok(()),
            Err(StepError::Record(error)) => Err(error),
            Err(error) => {
                let message =
                    format!("{device} could not be given its earlier corrections: {}", describe(&error));
                self.journal.log(LogLevel::Error, "engine", Some(at), &message)
            }
        }
    }
}

/// Whether a robot's controller has it, from where the record cannot take it back.
pub(crate) fn is_kept(correction: &StoredCorrection) -> bool {
    correction.key.quantity == CONTROLLER_ZERO
}

/// What is corrected, for people.
pub(crate) fn in_words(correction: &StoredCorrection) -> String {
    let key = &correction.key;
    corrected_quantity(&key.quantity, &key.device, &key.site)
}

/// Those of a run's corrections that a step has put in force; none where they are only proposals.
fn applied_by(stored: Vec<StoredCorrection>, step: &str) -> Option<AppliedCorrections> {
    let applied: Vec<_> =
        stored.into_iter().filter(|known| known.step == step && known.revision.is_some()).collect();
    let revision = applied.last().and_then(|known| known.revision)?;
    let corrections = applied.into_iter().map(new_correction).collect();
    Some(AppliedCorrections { corrections, revision })
}

fn new_correction(stored: StoredCorrection) -> NewCorrection {
    NewCorrection {
        key: stored.key,
        old: stored.old,
        new: stored.new,
        uncertainty: stored.uncertainty,
        budget: stored.budget,
        unit: stored.unit,
    }
}

#[cfg(test)]
mod tests {
    use plumb_record::{CorrectionKey, RunId};

    use super::*;

    fn stored(step: &str, joint: &str, revision: Option<i64>) -> StoredCorrection {
        StoredCorrection {
            id: 1,
            run: Some(RunId(1)),
            step: step.to_owned(),
            key: CorrectionKey { device: "arm".into(), quantity: "joint_zero".into(), site: joint.into() },
            old: 1.0,
            new: 2.0,
            uncertainty: Some(0.1),
            budget: None,
            unit: "deg".to_owned(),
            proposed: String::new(),
            revision,
        }
    }

    #[test]
    fn what_a_step_applied_is_found_with_its_revision() {
        let of_run = vec![
            stored("first", "waist", Some(3)),
            stored("second", "waist", Some(4)),
            stored("second", "elbow", Some(4)),
            stored("second", "wrist", None),
        ];
        let applied = applied_by(of_run, "second").expect("it applied two");
        assert_eq!(applied.revision, 4);
        let joints: Vec<&str> = applied.corrections.iter().map(|one| one.key.site.as_str()).collect();
        assert_eq!(joints, ["waist", "elbow"]);
        assert_eq!((applied.corrections[0].old, applied.corrections[0].new), (1.0, 2.0));
    }

    #[test]
    fn what_a_step_only_proposed_is_not_applied() {
        assert!(applied_by(vec![stored("second", "waist", None)], "second").is_none());
        assert!(applied_by(vec![stored("first", "waist", Some(3))], "second").is_none());
    }
}
