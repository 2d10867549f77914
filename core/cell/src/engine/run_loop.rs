//! The state machine: from entry to entry of the plan.

use plumb_record::{Interruption, RecordError};
use serde_json::{Value, json};

use super::Engine;
use super::inbox::Interrupt;
use super::journal::{Attempt, AttemptEnd};
use super::plan::{Entry, Work};
use super::scope::ScopeId;
use super::step_error::StepError;
use crate::event::{LogLevel, RunOutcome, StepOutcome};
use crate::step::Inside;

/// How a run ended, with a sentence.
pub(crate) struct RunEnd {
    pub(crate) outcome: RunOutcome,
    pub(crate) message: String,
}

/// What comes after a step.
pub(crate) enum LeafEnd {
    /// The next one.
    Done,
    /// This entry of the plan, which was done before.
    Back(usize),
    /// Nothing: the run ends.
    End(RunEnd),
}

/// What comes after an entry.
enum Next {
    Entry(usize),
    End(RunEnd),
}

impl Engine {
    /// Carries out the plan from the entry at `position`. `open` are the repetitions and calls that were begun before a resume.
    pub(crate) fn run_from(
        &mut self,
        mut position: usize,
        mut open: Vec<(usize, Attempt)>,
    ) -> Result<RunEnd, RecordError> {
        while let Some(entry) = self.plan.entries.get(position).cloned() {
            let next = self.run_entry(&entry, position, &mut open)?;
            match next {
                Next::Entry(next) => position = next,
                Next::End(end) => {
                    self.close_open(&open, &end)?;
                    return Ok(end);
                }
            }
        }
        Ok(match self.failed_check.take() {
            Some((_, message)) => RunEnd { outcome: RunOutcome::Failed, message },
            None => {
                let skipped = self.journal.record.run(self.journal.run)?.skipped;
                RunEnd { outcome: RunOutcome::Passed, message: passed_in_words(&skipped) }
            }
        })
    }

    /// Ends the repetitions and calls that the end of the run left open.
    fn close_open(&mut self, open: &[(usize, Attempt)], end: &RunEnd) -> Result<(), RecordError> {
        let outcome = match end.outcome {
            RunOutcome::Failed => StepOutcome::Failed,
            RunOutcome::Error | RunOutcome::NeedsOperator => StepOutcome::Error,
            RunOutcome::Passed | RunOutcome::Aborted => StepOutcome::Interrupted,
        };
        for (index, attempt) in open.iter().rev() {
            let Some(path) = self.plan.entries.get(*index).map(|entry| entry.path.clone()) else { continue };
            let end =
                AttemptEnd { outcome, message: "not finished", result: &Value::Null, values: Vec::new() };
            self.journal.end(&path, *attempt, end)?;
        }
        Ok(())
    }

    fn run_entry(
        &mut self,
        entry: &Entry,
        position: usize,
        open: &mut Vec<(usize, Attempt)>,
    ) -> Result<Next, RecordError> {
        match &entry.work {
            Work::Leaf => Ok(match self.run_leaf(entry)? {
                LeafEnd::End(end) => Next::End(end),
                LeafEnd::Done => Next::Entry(position + 1),
                LeafEnd::Back(to) => {
                    self.go_back(entry, to, open)?;
                    Next::Entry(to)
                }
            }),
            Work::Begin { end } => self.begin_entry(entry, position, *end, open),
            Work::Turn { turn, turns } => {
                self.set_state(entry, entry.state_of_turn(*turn, *turns));
                Ok(Next::Entry(position + 1))
            }
            Work::TurnEnd { end } => self.end_turn(entry, position, *end, open),
            Work::End { called, turns } => {
                self.end_entry(entry, *called, *turns, open)?;
                Ok(Next::Entry(position + 1))
            }
        }
    }

    /// Begins a repetition or call, whose last entry is `end`; goes past it where it is not needed.
    fn begin_entry(
        &mut self,
        entry: &Entry,
        position: usize,
        end: usize,
        open: &mut Vec<(usize, Attempt)>,
    ) -> Result<Next, RecordError> {
        if let Some(end) = self.wait_where_asked(entry)? {
            return Ok(Next::End(end));
        }
        let attempt = self.journal.begin(&entry.path)?;
        match self.is_needed(entry) {
            Ok(true) => {
                open.push((position, attempt));
                Ok(Next::Entry(position + 1))
            }
            Ok(false) => {
                self.end_not_needed(entry, attempt)?;
                self.skip_entries(position + 1, end)?;
                Ok(Next::Entry(end + 1))
            }
            Err(error) => self.give_up(entry, attempt, error).map(Next::End),
        }
    }

    /// After a turn of a repetition: on to the next, or to the repetition's last entry, `end`, where its condition holds.
    fn end_turn(
        &mut self,
        entry: &Entry,
        position: usize,
        end: usize,
        open: &mut Vec<(usize, Attempt)>,
    ) -> Result<Next, RecordError> {
        match self.is_repetition_over(entry) {
            Ok(true) => {
                self.skip_entries(position + 1, end)?;
                Ok(Next::Entry(end))
            }
            Ok(false) => Ok(Next::Entry(position + 1)),
            Err(error) => match open.pop() {
                Some((_, attempt)) => self.give_up(entry, attempt, error).map(Next::End),
                None => Ok(Next::End(RunEnd { outcome: RunOutcome::Error, message: describe(&error) })),
            },
        }
    }

    /// Ends a repetition or call.
    fn end_entry(
        &mut self,
        entry: &Entry,
        called: Option<ScopeId>,
        turns: u32,
        open: &mut Vec<(usize, Attempt)>,
    ) -> Result<(), RecordError> {
        self.set_result(entry, self.result_at_end(called, turns));
        let Some((_, attempt)) = open.pop() else { return Ok(()) };
        let end = AttemptEnd {
            outcome: StepOutcome::Passed,
            message: "done",
            result: &Value::Null,
            values: Vec::new(),
        };
        self.journal.end(&entry.path, attempt, end)
    }

    /// The result of a call, which is that of all steps of the procedure called, or of a repetition.
    pub(crate) fn result_at_end(&self, called: Option<ScopeId>, turns: u32) -> Value {
        match called.and_then(|scope| self.plan.scopes.get(scope)) {
            Some(scope) => Value::Object(scope.results().clone()),
            None => json!({"turns": turns}),
        }
    }

    fn give_up(&mut self, entry: &Entry, attempt: Attempt, error: StepError) -> Result<RunEnd, RecordError> {
        let message = describe(&error);
        let end = AttemptEnd {
            outcome: StepOutcome::Error,
            message: &message,
            result: &Value::Null,
            values: Vec::new(),
        };
        self.journal.end(&entry.path, attempt, end)?;
        Ok(RunEnd { outcome: RunOutcome::Error, message: format!("step `{}`: {message}", entry.path) })
    }

    pub(crate) fn set_result(&mut self, entry: &Entry, result: Value) {
        if let Some(scope) = self.plan.scopes.get_mut(entry.scope) {
            scope.set_result(&entry.step.id, result);
            self.with_results.insert(entry.index);
        }
    }

    pub(crate) fn set_state(&mut self, entry: &Entry, state: Value) {
        if let Some(scope) = self.plan.scopes.get_mut(entry.scope) {
            scope.set_state(&entry.step.id, state);
        }
    }

    pub(crate) fn is_needed(&mut self, entry: &Entry) -> Result<bool, StepError> {
        let Some(when) = &entry.step.when else { return Ok(true) };
        let values = self.values(entry.scope, &[when.text()])?;
        Ok(when.truth(&self.calculator, &values)?)
    }

    pub(crate) fn is_repetition_over(&mut self, entry: &Entry) -> Result<bool, StepError> {
        let Inside::Repeated { until: Some(until), .. } = entry.step.action.inside() else {
            return Ok(false);
        };
        let values = self.values(entry.scope, &[until.text()])?;
        Ok(until.truth(&self.calculator, &values)?)
    }

    pub(crate) fn end_not_needed(&mut self, entry: &Entry, attempt: Attempt) -> Result<(), RecordError> {
        let end = AttemptEnd {
            outcome: StepOutcome::NotNeeded,
            message: "not needed",
            result: &Value::Null,
            values: Vec::new(),
        };
        self.journal.end(&entry.path, attempt, end)
    }

    /// Writes down that the shown entries from `from` up to `to` are not needed.
    fn skip_entries(&mut self, from: usize, to: usize) -> Result<(), RecordError> {
        for index in from..to {
            let Some(entry) = self.plan.entries.get(index).filter(|entry| entry.is_shown()).cloned() else {
                continue;
            };
            let attempt = self.journal.begin(&entry.path)?;
            self.end_not_needed(&entry, attempt)?;
        }
        Ok(())
    }

    /// Pauses here if that was asked for; gives the end of the run if it is ended instead.
    pub(crate) fn wait_where_asked(&mut self, entry: &Entry) -> Result<Option<RunEnd>, RecordError> {
        let interrupt = self.inbox.interrupt().or(self.inbox.pause_before_next.then_some(Interrupt::Pause));
        self.inbox.pause_before_next = false;
        match interrupt {
            None => Ok(None),
            Some(interrupt) => match super::interrupted(interrupt) {
                StepError::Interrupted { interrupt, reason } => {
                    self.handle_interrupt(interrupt, &reason, entry)
                }
                _ => Ok(None),
            },
        }
    }

    /// Pauses or ends the run; gives its end if that is what was wanted.
    pub(crate) fn handle_interrupt(
        &mut self,
        interrupt: Interrupt,
        reason: &str,
        entry: &Entry,
    ) -> Result<Option<RunEnd>, RecordError> {
        if super::prompting::is_pause(interrupt) {
            return match self.pause(interrupt, Some(&entry.path), reason) {
                Ok(()) => Ok(None),
                Err(StepError::Interrupted { interrupt, reason }) => {
                    self.handle_interrupt(interrupt, &reason, entry)
                }
                Err(StepError::Record(error)) => Err(error),
                Err(other) => self.device_failed_on_resume(other, entry),
            };
        }
        let (kind, outcome) = match interrupt {
            Interrupt::Finish => (Interruption::FinishAsked, RunOutcome::Passed),
            Interrupt::Keep | Interrupt::FromOutside { keep: true, .. } => {
                (Interruption::Left, RunOutcome::NeedsOperator)
            }
            _ => (Interruption::AbortAsked, RunOutcome::Aborted),
        };
        self.journal.interruption(kind, Some(&entry.path), reason)?;
        Ok(Some(RunEnd { outcome, message: format!("{reason} before the end, at step `{}`", entry.path) }))
    }

    /// A robot could not be made ready again: the step in hand will fail on it and ask what to do.
    fn device_failed_on_resume(
        &mut self,
        error: StepError,
        entry: &Entry,
    ) -> Result<Option<RunEnd>, RecordError> {
        match error {
            StepError::Lost { device, message } => match self.note_lost(&device, &entry.path, &message) {
                Err(StepError::Record(error)) => Err(error),
                _ => Ok(None),
            },
            other => {
                self.journal.log(LogLevel::Error, "engine", Some(&entry.path), &describe(&other))?;
                Ok(None)
            }
        }
    }
}

pub(crate) fn describe(error: &StepError) -> String {
    match error {
        StepError::Interrupted { reason, .. } => reason.clone(),
        StepError::Failed(message) | StepError::Error(message) | StepError::NeedsOperator(message) => {
            message.clone()
        }
        StepError::Lost { message, .. } => message.clone(),
        StepError::Record(error) => error.to_string(),
    }
}

/// The sentence a passed run ends with: a step that was skipped has not passed.
fn passed_in_words(skipped: &[String]) -> String {
    match skipped {
        [] => "all steps passed".to_owned(),
        [only] => format!("1 step skipped: {only}; all others passed"),
        many => format!("{} steps skipped: {}; all others passed", many.len(), many.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::passed_in_words;

    #[test]
    fn a_skipped_step_has_not_passed() {
        assert_eq!(passed_in_words(&[]), "all steps passed");
        assert_eq!(
            passed_in_words(&["waist.lower".to_owned()]),
            "1 step skipped: waist.lower; all others passed"
        );
    }
}
