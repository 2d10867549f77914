//! Going on with a run that was interrupted: what was done stays done, the step in hand begins again.

use plumb_record::{ChangedLibrary, StoredStep};
use serde_json::Value;

use super::Engine;
use super::found_before::FoundBefore;
use super::journal::{Attempt, Question};
use super::plan::{Entry, Work};
use super::prompting::Received;
use super::start::describe_changed;
use super::step_context::StepContext;
use super::step_error::StepError;
use crate::event::{Event, LogLevel, NamedValue, StepOutcome, StepPath};
use crate::in_words::sentence_case;
use crate::prompt::PromptKind;
use crate::step::MovedJoints;

/// Joints that differ by no more are where they were, deg or mm: what a number loses on its way through the record.
const SAME: f64 = 1e-6;

/// Differences that are too small to be shown to a person, deg or mm: half of the last digit that is shown.
const SHOWN: f64 = 5e-4;

/// Where a resumed run goes on.
pub(crate) struct ResumePoint {
    /// Entry of the plan.
    pub(crate) position: usize,
    /// Repetitions and calls that are open there.
    pub(crate) open: Vec<usize>,
}

impl Engine {
    /// Takes over what the record holds of the steps that are done, and finds the first that is not.
    pub(crate) fn replay(&mut self, stored: &[StoredStep]) -> Result<ResumePoint, StepError> {
        let found = FoundBefore::of(&self.journal.record, self.journal.run)?;
        let mut point = ResumePoint { position: 0, open: Vec::new() };
        while let Some(entry) = self.plan.entries.get(point.position).cloned() {
            let last = stored.iter().rev().find(|attempt| attempt.step == entry.path.0);
            let outcome = last.and_then(|attempt| attempt.outcome.as_deref());
            match &entry.work {
                Work::Leaf => {
                    let Some(attempt) = last else { return Ok(point) };
                    if !self.replay_leaf(&entry, attempt, stored, &found) {
                        return Ok(point);
                    }
                }
                Work::Begin { end } => match outcome {
                    Some("not_needed") => {
                        point.position = end + 1;
                        continue;
                    }
                    _ if last.is_none() => return Ok(point),
                    _ => point.open.push(point.position),
                },
                Work::Turn { turn, turns } => self.set_state(&entry, entry.state_of_turn(*turn, *turns)),
                Work::TurnEnd { end } => match self.next_turn_outcome(point.position, stored) {
                    Some("not_needed") => {
                        point.position = *end;
                        continue;
                    }
                    Some(_) => {}
                    // The end of the last turn, or a turn not begun: whether the repetition is over is worked out again.
                    None => return Ok(point),
                },
                Work::End { called, turns } => {
                    if outcome != Some("passed") {
                        return Ok(point);
                    }
                    self.set_result(&entry, self.result_at_end(*called, *turns));
                    if let Some(attempt) = last {
                        self.show_done(&entry.path, StepOutcome::Passed, attempt);
                    }
                    point.open.pop();
                }
            }
            point.position += 1;
        }
        Ok(point)
    }

    /// Takes over a step from its last attempt; gives whether it was done.
    fn replay_leaf(
        &mut self,
        entry: &Entry,
        last: &StoredStep,
        stored: &[StoredStep],
        found: &FoundBefore,
    ) -> bool {
        let outcome = match last.outcome.as_deref() {
            Some("passed") => {
                self.take_over_step(&entry.step);
                self.set_result(entry, last.result.clone());
                found.events(&entry.path).into_iter().for_each(|event| self.journal.show(event));
                StepOutcome::Passed
            }
            Some("skipped") => {
                let failed = |attempt: &&StoredStep| {
                    attempt.step == entry.path.0 && attempt.outcome.as_deref() == Some("failed")
                };
                if let Some(failed) = stored.iter().find(failed) {
                    self.failed_check
                        .get_or_insert((entry.index, failed.message.clone().unwrap_or_default()));
                }
                StepOutcome::Skipped
            }
            Some("not_needed") => StepOutcome::NotNeeded,
            _ => return false,
        };
        self.show_done(&entry.path, outcome, last);
        true
    }

    /// What became of the first step of the turn after the one that ends at `position`; none when there is none, or it was not begun.
    fn next_turn_outcome<'s>(&self, position: usize, stored: &'s [StoredStep]) -> Option<&'s str> {
        let turn = self.plan.entries.get(position + 1)?;
        let first = self.plan.entries.get(position + 2)?;
        if !matches!(turn.work, Work::Turn { .. }) {
            // The last turn: the end follows, and is known by its own outcome.
            let done = stored.iter().any(|a| a.step == turn.path.0 && a.outcome.as_deref() == Some("passed"));
            return done.then_some("passed");
        }
        let attempt = stored.iter().rev().find(|attempt| attempt.step == first.path.0)?;
        Some(attempt.outcome.as_deref().unwrap_or("begun"))
    }

    fn show_done(&self, step: &StepPath, outcome: StepOutcome, attempt: &StoredStep) {
        self.journal.show(Event::StepFinished {
            step: step.clone(),
            outcome,
            message: attempt.message.clone().unwrap_or_default(),
            values: Vec::new(),
            seconds: 0.0,
        });
    }

    /// Begins the open repetitions and calls anew.
    pub(crate) fn reopen(&mut self, open: &[usize]) -> Result<Vec<(usize, Attempt)>, StepError> {
        let mut attempts = Vec::new();
        for index in open {
            let Some(path) = self.plan.entries.get(*index).map(|entry| entry.path.clone()) else { continue };
            attempts.push((*index, self.journal.begin(&path)?));
        }
        Ok(attempts)
    }

    /// Makes sure that every robot is where the run left it: a person looks, or the record and the robot agree.
    pub(crate) fn confirm_poses(&mut self, position: usize) -> Result<(), StepError> {
        let poses = self.journal.record.poses(self.journal.run)?;
        if self.links.is_new_world() {
            let message = "the world of the run has ended, and one that began anew is in its place: \
                           what the operator did to it is as the world file says";
            self.journal.log(LogLevel::Warning, "world", None, message)?;
        }
        for index in 0..self.arms.len() {
            let Some(name) = self.arms.get(index).map(|arm| arm.name.clone()) else { continue };
            let Some(pose) = poses.iter().find(|pose| pose.device == name) else { continue };
            let state = self.read_pose_anywhere(&name)?;
            let reported = self.arm(&name)?.recorded(&state.joints);
            if self.unattended {
                self.confirm_unattended(&name, &pose.joints, &reported, position)?;
            } else {
                self.confirm_by_asking(&name, &pose.joints, &reported, position)?;
            }
        }
        Ok(())
    }

    /// Lets a person look at plugins that are not those the cell ran with last. Nothing of them has been loaded yet.
    pub(crate) fn confirm_plugins(&mut self, changed: &[ChangedLibrary]) -> Result<(), StepError> {
        if changed.is_empty() {
            return Ok(());
        }
        let path = StepPath("plugins".to_owned());
        let question = Question {
            step: &path,
            title: "A plugin has changed. Run with it?",
            text: format!(
                "{}.\nAfter an update that is as it should be. If nobody has updated it, abort and find out who changed it.",
                sentence_case(&describe_changed(changed))
            ),
            help: None,
            kind: PromptKind::Acknowledge { label: "Run with it".to_owned() },
            simulated: false,
        };
        let prompt = self.journal.ask(question)?;
        let at = StepContext::outside(&path, "plugins");
        loop {
            if let Received::Answer(answer, by) = self.receive(&prompt, &at)? {
                self.journal.answered(&prompt, &answer, &by)?;
                return Ok(());
            }
        }
    }

    fn confirm_by_asking(
        &mut self,
        robot: &str,
        recorded: &Value,
        reported: &Value,
        position: usize,
    ) -> Result<(), StepError> {
        let path = StepPath("resume".to_owned());
        let moved_by_step = self.joints_moved_at(position, robot);
        let question = Question {
            step: &path,
            title: "Is the arm where the run stopped?",
            text: format!(
                "The run was interrupted. {}\nLook at {robot}: confirm if it is there, nobody has moved it since, and its path is clear; otherwise abort and start a new run.",
                differences_in_words(recorded, reported, &moved_by_step)
            ),
            help: None,
            kind: PromptKind::ConfirmPose {
                device: robot.to_owned(),
                recorded: named(recorded),
                reported: named(reported),
            },
            simulated: false,
        };
        let prompt = self.journal.ask(question)?;
        let at = StepContext::outside(&path, "resume");
        loop {
            if let Received::Answer(answer, by) = self.receive(&prompt, &at)? {
                self.journal.answered(&prompt, &answer, &by)?;
                return Ok(());
            }
        }
    }

    /// The joints that the step with which the run goes on moves.
    fn joints_moved_at(&self, position: usize, robot: &str) -> MovedJoints {
        let step = self.plan.entries.get(position).map(|entry| &entry.step);
        step.map_or(MovedJoints::None, |step| step.action.moved_joints(robot))
    }

    /// Without a person, the robot has to say it is where the record left it; only the joints that the interrupted step was moving may
    /// be elsewhere.
    fn confirm_unattended(
        &mut self,
        robot: &str,
        recorded: &Value,
        reported: &Value,
        position: usize,
    ) -> Result<(), StepError> {
        if self.answers.as_ref().is_some_and(|answers| answers.confirm_pose) {
            return Ok(());
        }
        let moved_by_step = self.joints_moved_at(position, robot);
        for (before, now) in drive_numbers(recorded).into_iter().zip(drive_numbers(reported)) {
            // What the record or the robot does not say is no number, and not the same either.
            let is_same = (before.1 - now.1).abs() <= SAME;
            if !is_same && !moved_by_step.contains(&before.0) {
                if self.links.is_new_world() {
                    return Err(StepError::NeedsOperator(format!(
                        "the simulated world of the run has ended, and one that began anew has {robot}'s {} at {:.3}, where the run left \
                         it at {:.3}: begin a new run",
                        before.0, now.1, before.1
                    )));
                }
                return Err(StepError::NeedsOperator(format!(
                    "{robot} reports its {} at {:.3}; the run left it at {:.3}. Somebody has to look: resume without --headless, or say \
                     `confirm_pose: true` in the answers",
                    before.0, now.1, before.1
                )));
            }
        }
        Ok(())
    }
}

/// Which joints are elsewhere than they were recorded last, and why that may be.
fn differences_in_words(recorded: &Value, reported: &Value, moved_by_step: &MovedJoints) -> String {
    let now = named(reported);
    let differences: Vec<String> = named(recorded)
        .iter()
        .filter_map(|joint| {
            let by = now.iter().find(|now| now.name == joint.name)?.value - joint.value;
            if by.abs() <= SHOWN {
                return None;
            }
            let why = match moved_by_step.contains(&joint.name) {
                true => "it was moving when the run was interrupted.",
                false => "the run was not moving it: did somebody?",
            };
            Some(format!(
                "Its {} reads {by:+.3} {} from where it was recorded last: {why}",
                joint.name, joint.unit
            ))
        })
        .collect();
    if differences.is_empty() {
        "All joints read as they were left.".to_owned()
    } else {
        differences.join("\n")
    }
}

fn rows(joints: &Value) -> impl Iterator<Item = &Value> {
    joints.as_array().into_iter().flatten()
}

fn text(row: &Value, key: &str) -> String {
    row.get(key).and_then(Value::as_str).unwrap_or_default().to_owned()
}

fn named(joints: &Value) -> Vec<NamedValue> {
    let value = |row: &Value| row.get("value").and_then(Value::as_f64).unwrap_or(f64::NAN);
    rows(joints)
        .map(|row| NamedValue {
            name: text(row, "name"),
            value: value(row),
            unit: text(row, "unit"),
            uncertainty: None,
        })
        .collect()
}

fn drive_numbers(joints: &Value) -> Vec<(String, f64)> {
    rows(joints)
        .map(|row| (text(row, "name"), row.get("drive").and_then(Value::as_f64).unwrap_or(f64::NAN)))
        .collect()
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn a_person_is_shown_which_joint_is_elsewhere_and_whether_the_run_moved_it() {
        let joints = |waist: f64| json!([{"name": "waist", "value": waist, "unit": "deg"}, {"name": "elbow", "value": -80.0, "unit": "deg"}]);
        let message_for = |moved: &MovedJoints| differences_in_words(&joints(9.3), &joints(5.7), moved);
        let waist = MovedJoints::Named(vec!["waist".to_owned()]);
        assert_eq!(
            message_for(&waist),
            "Its waist reads -3.600 deg from where it was recorded last: it was moving when the run was interrupted."
        );
        assert!(message_for(&MovedJoints::None).ends_with("the run was not moving it: did somebody?"));
        assert_eq!(
            differences_in_words(&joints(9.3), &joints(9.3), &waist),
            "All joints read as they were left."
        );
    }
}
