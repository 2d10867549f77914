//! The state machine: from entry to entry of the plan.

use std::time::Instant;

use plumb_record::{Interruption, RecordError};
use serde_json::{Value, json};

use super::Engine;
use super::inbox::Interrupt;
use super::journal::{Attempt, AttemptEnd};
use super::plan::{Entry, Work};
use super::step_context::{Done, StepContext};
use super::step_error::StepError;
use crate::event::{LogLevel, RunOutcome, StepOutcome, StepPath};
use crate::prompt::Decision;
use crate::step::{Action, OnError};

/// How a run ended, with a sentence.
pub(super) struct RunEnd {
    pub(super) outcome: RunOutcome,
    pub(super) message: String,
}

/// What comes after an entry.
enum Next {
    Entry(usize),
    End(RunEnd),
}

/// What a failed attempt leads to.
enum After {
    Again,
    GoOn,
    End(RunEnd),
}

impl Engine {
    /// Carries out the plan from the entry at `position`. `open` are the repetitions and calls that were begun before a resume.
    pub(super) fn run_from(
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
            Some(message) => RunEnd { outcome: RunOutcome::Failed, message },
            None => RunEnd { outcome: RunOutcome::Passed, message: "all steps passed".to_owned() },
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
                Some(end) => Next::End(end),
                None => Next::Entry(position + 1),
            }),
            Work::Begin { end } => {
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
                        self.skip_entries(position + 1, *end)?;
                        Ok(Next::Entry(end + 1))
                    }
                    Err(error) => self.give_up(entry, attempt, error).map(Next::End),
                }
            }
            Work::Turn { turn, turns } => {
                self.set_state(entry, json!({"turn": turn, "turns": turns}));
                Ok(Next::Entry(position + 1))
            }
            Work::TurnEnd { end } => match self.is_repetition_over(entry) {
                Ok(true) => {
                    self.skip_entries(position + 1, *end)?;
                    Ok(Next::Entry(*end))
                }
                Ok(false) => Ok(Next::Entry(position + 1)),
                Err(error) => match open.last().copied() {
                    Some((_, attempt)) => {
                        open.pop();
                        self.give_up(entry, attempt, error).map(Next::End)
                    }
                    None => Ok(Next::End(RunEnd { outcome: RunOutcome::Error, message: describe(&error) })),
                },
            },
            Work::End { called, turns } => {
                let result = match called.and_then(|scope| self.plan.scopes.get(scope)) {
                    Some(scope) => Value::Object(scope.results().clone()),
                    None => json!({"turns": turns}),
                };
                self.set_result(entry, result.clone());
                if let Some((_, attempt)) = open.pop() {
                    let end = AttemptEnd {
                        outcome: StepOutcome::Passed,
                        message: "done",
                        result: &Value::Null,
                        values: Vec::new(),
                    };
                    self.journal.end(&entry.path, attempt, end)?;
                }
                Ok(Next::Entry(position + 1))
            }
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

    pub(super) fn set_result(&mut self, entry: &Entry, result: Value) {
        if let Some(scope) = self.plan.scopes.get_mut(entry.scope) {
            scope.set_result(&entry.step.id, result);
        }
    }

    pub(super) fn set_state(&mut self, entry: &Entry, state: Value) {
        if let Some(scope) = self.plan.scopes.get_mut(entry.scope) {
            scope.set_state(&entry.step.id, state);
        }
    }

    fn is_needed(&mut self, entry: &Entry) -> Result<bool, StepError> {
        let Some(when) = &entry.step.when else { return Ok(true) };
        let values = self.values(entry.scope, &[when.text()])?;
        Ok(when.truth(&self.calculator, &values)?)
    }

    pub(super) fn is_repetition_over(&mut self, entry: &Entry) -> Result<bool, StepError> {
        let Action::Repeat(repeat) = &entry.step.action else { return Ok(false) };
        let Some(until) = &repeat.until else { return Ok(false) };
        let values = self.values(entry.scope, &[until.text()])?;
        Ok(until.truth(&self.calculator, &values)?)
    }

    fn end_not_needed(&mut self, entry: &Entry, attempt: Attempt) -> Result<(), RecordError> {
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
    fn wait_where_asked(&mut self, entry: &Entry) -> Result<Option<RunEnd>, RecordError> {
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
    fn handle_interrupt(
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

    /// Carries out one step, again where that is decided; gives the end of the run if it ends here.
    fn run_leaf(&mut self, entry: &Entry) -> Result<Option<RunEnd>, RecordError> {
        loop {
            self.take_in_log(Some(&entry.path))?;
            if let Some(end) = self.wait_where_asked(entry)? {
                return Ok(Some(end));
            }
            let attempt = self.journal.begin(&entry.path)?;
            let intent = if attempt.number > 1 {
                self.journal.record.intent(self.journal.run, &entry.path.0)?
            } else {
                None
            };
            let at = StepContext {
                path: entry.path.clone(),
                title: entry.step.title.clone(),
                answer_name: entry.answer_name.clone(),
                scope: entry.scope,
                attempt,
                intent,
                deadline: entry.step.time_limit.map(|limit| Instant::now() + limit),
            };
            let carried_out = match self.is_needed(entry) {
                Ok(true) => self.execute(&entry.step, &at).map(Some),
                Ok(false) => Ok(None),
                Err(error) => Err(error),
            };
            self.take_in_log(Some(&entry.path))?;
            match carried_out {
                Ok(Some(done)) => {
                    self.passed(entry, attempt, done)?;
                    return Ok(None);
                }
                Ok(None) => {
                    self.end_not_needed(entry, attempt)?;
                    return Ok(None);
                }
                Err(error) => match self.not_passed(entry, &at, error)? {
                    After::Again => {}
                    After::GoOn => return Ok(None),
                    After::End(end) => return Ok(Some(end)),
                },
            }
        }
    }

    /// Writes down what the devices had to say.
    pub(super) fn take_in_log(&mut self, step: Option<&StepPath>) -> Result<(), RecordError> {
        for line in self.links.log_lines() {
            self.journal.log(line.level, &line.device, step, &line.message)?;
        }
        Ok(())
    }

    fn passed(&mut self, entry: &Entry, attempt: Attempt, done: Done) -> Result<(), RecordError> {
        self.note_poses()?;
        let end = AttemptEnd {
            outcome: StepOutcome::Passed,
            message: &done.message,
            result: &done.result,
            values: done.values,
        };
        self.journal.end(&entry.path, attempt, end)?;
        self.set_result(entry, done.result);
        Ok(())
    }

    fn not_passed(
        &mut self,
        entry: &Entry,
        at: &StepContext,
        error: StepError,
    ) -> Result<After, RecordError> {
        let (outcome, message) = match error {
            StepError::Record(error) => return Err(error),
            StepError::Interrupted { interrupt, reason } => {
                self.end_attempt(entry, at, StepOutcome::Interrupted, &reason)?;
                return Ok(match self.handle_interrupt(interrupt, &reason, entry)? {
                    Some(end) => After::End(end),
                    None => After::Again,
                });
            }
            StepError::NeedsOperator(message) => {
                self.end_attempt(entry, at, StepOutcome::Error, &message)?;
                return Ok(After::End(RunEnd { outcome: RunOutcome::NeedsOperator, message }));
            }
            StepError::Lost { device, message } => {
                if let Err(StepError::Record(error)) = self.note_lost(&device, &entry.path, &message) {
                    return Err(error);
                }
                (StepOutcome::Error, message)
            }
            StepError::Failed(message) => (StepOutcome::Failed, message),
            StepError::Error(message) => (StepOutcome::Error, message),
        };
        self.end_attempt(entry, at, outcome, &message)?;
        self.after_failure(entry, at, outcome, &message)
    }

    fn end_attempt(
        &mut self,
        entry: &Entry,
        at: &StepContext,
        outcome: StepOutcome,
        message: &str,
    ) -> Result<(), RecordError> {
        self.note_poses()?;
        let end = AttemptEnd { outcome, message, result: &Value::Null, values: Vec::new() };
        self.journal.end(&entry.path, at.attempt, end)
    }

    /// Does what is decided about a step that failed.
    fn after_failure(
        &mut self,
        entry: &Entry,
        at: &StepContext,
        outcome: StepOutcome,
        message: &str,
    ) -> Result<After, RecordError> {
        let decision = match self.decide(&entry.step, at, message) {
            Ok(decision) => decision,
            Err(StepError::Record(error)) => return Err(error),
            Err(StepError::Interrupted { interrupt, reason }) => {
                return Ok(match self.handle_interrupt(interrupt, &reason, entry)? {
                    Some(end) => After::End(end),
                    // A pause in a question is followed by the question again.
                    None => return self.after_failure(entry, at, outcome, message),
                });
            }
            Err(other) => {
                let message = describe(&other);
                return Ok(After::End(RunEnd { outcome: RunOutcome::Error, message }));
            }
        };
        match decision {
            Decision::Retry => match self.reconnect_lost() {
                Ok(()) => Ok(After::Again),
                Err(StepError::Record(error)) => Err(error),
                Err(other) => {
                    let message = describe(&other);
                    self.journal.log(LogLevel::Error, "engine", Some(&entry.path), &message)?;
                    // A person is asked again; what was decided beforehand has been tried.
                    match self.unattended
                        || entry.step.on_error.is_some_and(|on_error| on_error != OnError::Ask)
                    {
                        true => Ok(After::End(RunEnd { outcome: RunOutcome::Error, message })),
                        false => self.after_failure(entry, at, outcome, &message),
                    }
                }
            },
            Decision::Skip => {
                if outcome == StepOutcome::Failed {
                    self.failed_check.get_or_insert_with(|| message.to_owned());
                }
                let attempt = self.journal.begin(&entry.path)?;
                let end = AttemptEnd {
                    outcome: StepOutcome::Skipped,
                    message: "left out",
                    result: &Value::Null,
                    values: Vec::new(),
                };
                self.journal.end(&entry.path, attempt, end)?;
                Ok(After::GoOn)
            }
            Decision::Abort => {
                let end = if outcome == StepOutcome::Failed { RunOutcome::Failed } else { RunOutcome::Error };
                Ok(After::End(RunEnd { outcome: end, message: format!("step `{}`: {message}", entry.path) }))
            }
        }
    }
}

pub(super) fn describe(error: &StepError) -> String {
    match error {
        StepError::Interrupted { reason, .. } => reason.clone(),
        StepError::Failed(message) | StepError::Error(message) | StepError::NeedsOperator(message) => {
            message.clone()
        }
        StepError::Lost { message, .. } => message.clone(),
        StepError::Record(error) => error.to_string(),
    }
}
