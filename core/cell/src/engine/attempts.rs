//! One step, tried until it passes or something else is decided.

use std::sync::Arc;
use std::time::Instant;

use plumb_record::RecordError;
use serde_json::Value;

use super::Engine;
use super::journal::{Attempt, AttemptEnd};
use super::plan::Entry;
use super::run_loop::{LeafEnd, RunEnd, describe};
use super::step_context::{Done, StepContext, TimeLimit};
use super::step_error::StepError;
use crate::event::{LogLevel, RunOutcome, StepOutcome, StepPath};
use crate::prompt::Decision;
use crate::step::OnError;

/// What a failed attempt leads to.
enum AfterFailure {
    Again,
    GoOn,
    Back(usize),
    End(RunEnd),
}

impl Engine {
    /// Carries out one step, again where that is decided.
    pub(crate) fn run_leaf(&mut self, entry: &Entry) -> Result<LeafEnd, RecordError> {
        loop {
            self.take_in_log(Some(&entry.path))?;
            if let Some(end) = self.wait_where_asked(entry)? {
                return Ok(LeafEnd::End(end));
            }
            let attempt = self.journal.begin(&entry.path)?;
            let _step = tracing::info_span!("step", step = %entry.path, attempt = attempt.number).entered();
            let intent = if attempt.number > 1 {
                self.journal.record.intent(self.journal.run, &entry.path.0)?
            } else {
                None
            };
            self.clock.restart();
            let at = StepContext {
                path: entry.path.clone(),
                title: entry.step.title.clone(),
                answer_name: entry.answer_name.clone(),
                scope: entry.scope,
                attempt,
                intent,
                limit: entry.step.time_limit.map(|within| TimeLimit {
                    within,
                    began: Instant::now(),
                    clock: Arc::clone(&self.clock),
                }),
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
                    return Ok(LeafEnd::Done);
                }
                Ok(None) => {
                    self.end_not_needed(entry, attempt)?;
                    return Ok(LeafEnd::Done);
                }
                Err(error) => match self.not_passed(entry, &at, error)? {
                    AfterFailure::Again => {}
                    AfterFailure::GoOn => return Ok(LeafEnd::Done),
                    AfterFailure::Back(to) => return Ok(LeafEnd::Back(to)),
                    AfterFailure::End(end) => return Ok(LeafEnd::End(end)),
                },
            }
        }
    }

    /// Writes down what the devices had to say.
    pub(crate) fn take_in_log(&mut self, step: Option<&StepPath>) -> Result<(), RecordError> {
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
    ) -> Result<AfterFailure, RecordError> {
        let (outcome, message) = match error {
            StepError::Record(error) => return Err(error),
            StepError::Interrupted { interrupt, reason } => {
                self.end_attempt(entry, at, StepOutcome::Interrupted, &reason)?;
                return Ok(match self.handle_interrupt(interrupt, &reason, entry)? {
                    Some(end) => AfterFailure::End(end),
                    None => AfterFailure::Again,
                });
            }
            StepError::NeedsOperator(message) => {
                self.end_attempt(entry, at, StepOutcome::Error, &message)?;
                return Ok(AfterFailure::End(RunEnd { outcome: RunOutcome::NeedsOperator, message }));
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
    ) -> Result<AfterFailure, RecordError> {
        let ways_out = self.ways_out(entry)?;
        let decided = self.decide(&entry.step, at, message, &ways_out).and_then(|decision| {
            if decision == Decision::Move {
                self.move_by_hand(&ways_out, at)?;
            }
            Ok(decision)
        });
        let decision = match decided {
            Ok(decision) => decision,
            Err(StepError::Record(error)) => return Err(error),
            Err(StepError::Interrupted { interrupt, reason }) => {
                return Ok(match self.handle_interrupt(interrupt, &reason, entry)? {
                    Some(end) => AfterFailure::End(end),
                    // A pause in a question is followed by the question again.
                    None => return self.after_failure(entry, at, outcome, message),
                });
            }
            // The arm could not be moved by hand: what went wrong then is asked about in its turn.
            Err(other) if !self.unattended => {
                return self.after_failure(entry, at, outcome, &describe(&other));
            }
            Err(other) => {
                let message = describe(&other);
                return Ok(AfterFailure::End(RunEnd { outcome: RunOutcome::Error, message }));
            }
        };
        match decision {
            Decision::Retry => match ways_out.again_from.filter(|_| !self.unattended) {
                Some(from) => Ok(AfterFailure::Back(from)),
                None => self.retry(entry, at, outcome),
            },
            Decision::Move => Ok(ways_out.again_from.map_or(AfterFailure::Again, AfterFailure::Back)),
            Decision::Back => Ok(ways_out.back_to.map_or(AfterFailure::Again, AfterFailure::Back)),
            Decision::Skip => {
                if outcome == StepOutcome::Failed {
                    self.failed_check.get_or_insert_with(|| (entry.index, message.to_owned()));
                }
                self.skip(entry)?;
                Ok(AfterFailure::GoOn)
            }
            Decision::Abort => {
                let end = if outcome == StepOutcome::Failed { RunOutcome::Failed } else { RunOutcome::Error };
                Ok(AfterFailure::End(RunEnd {
                    outcome: end,
                    message: format!("step `{}`: {message}", entry.path),
                }))
            }
        }
    }

    /// Writes down that a step was left out.
    fn skip(&mut self, entry: &Entry) -> Result<(), RecordError> {
        let attempt = self.journal.begin(&entry.path)?;
        let end = AttemptEnd {
            outcome: StepOutcome::Skipped,
            message: "left out",
            result: &Value::Null,
            values: Vec::new(),
        };
        self.journal.end(&entry.path, attempt, end)
    }

    /// Starts lost devices again before the step is tried again; what to do is asked once more where that fails.
    fn retry(
        &mut self,
        entry: &Entry,
        at: &StepContext,
        outcome: StepOutcome,
    ) -> Result<AfterFailure, RecordError> {
        let message = match self.reconnect_lost() {
            Ok(()) => return Ok(AfterFailure::Again),
            Err(StepError::Record(error)) => return Err(error),
            Err(other) => describe(&other),
        };
        self.journal.log(LogLevel::Error, "engine", Some(&entry.path), &message)?;
        // A person is asked again; what was decided beforehand has been tried.
        let is_decided = entry.step.on_error.is_some_and(|on_error| on_error != OnError::Ask);
        if self.unattended || is_decided {
            return Ok(AfterFailure::End(RunEnd { outcome: RunOutcome::Error, message }));
        }
        self.after_failure(entry, at, outcome, &message)
    }
}
