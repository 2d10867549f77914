//! Corrections that an earlier attempt of a step applied.

use plumb_record::{NewCorrection, StoredCorrection};

use super::Engine;
use super::step_context::StepContext;
use super::step_error::StepError;

/// Corrections that are in force, and the revision that put them there.
pub(crate) struct AppliedCorrections {
    pub(crate) corrections: Vec<NewCorrection>,
    pub(crate) revision: i64,
}

impl Engine {
    /// What this step of this run has applied already: a run that was killed after it applied corrections and before it said so does not
    /// apply them twice.
    pub(crate) fn applied_before(&self, at: &StepContext) -> Result<Option<AppliedCorrections>, StepError> {
        let stored = self.journal.record.corrections_of_run(self.journal.run)?;
        Ok(applied_by(stored, &at.path.0))
    }
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
            key: CorrectionKey { device: "arm".into(), quantity: "joint_zero".into(), place: joint.into() },
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
        let joints: Vec<&str> = applied.corrections.iter().map(|one| one.key.place.as_str()).collect();
        assert_eq!(joints, ["waist", "elbow"]);
        assert_eq!((applied.corrections[0].old, applied.corrections[0].new), (1.0, 2.0));
    }

    #[test]
    fn what_a_step_only_proposed_is_not_applied() {
        assert!(applied_by(vec![stored("second", "waist", None)], "second").is_none());
        assert!(applied_by(vec![stored("first", "waist", Some(3))], "second").is_none());
    }
}
