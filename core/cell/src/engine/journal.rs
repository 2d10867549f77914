//! Everything that happens is written down first and shown after.

use plumb_record::{
    Interruption, NewCorrection, PlannedRow, Reading, Record, RecordError, RunEnd, RunId, StepEnd, Trigger,
};
use serde_json::Value;

use super::event_sender::EventSender;
use crate::event::{
    Correction, DeviceState, Event, LogLevel, NamedValue, PlannedStep, RunOutcome, StepOutcome, StepPath,
};
use crate::prompt::{Answer, Prompt, PromptId, PromptKind};

/// The record of a run together with its watchers.
pub(crate) struct Journal {
    pub(crate) record: Record,
    pub(crate) run: RunId,
    pub(crate) events: EventSender,
}

/// An attempt at a step that was written down.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Attempt {
    pub(crate) row: i64,
    pub(crate) number: u32,
    pub(crate) started: std::time::Instant,
}

/// How an attempt ended.
pub(crate) struct AttemptEnd<'a> {
    pub(crate) outcome: StepOutcome,
    pub(crate) message: &'a str,
    pub(crate) result: &'a Value,
    pub(crate) values: Vec<NamedValue>,
}

/// What a prompt is about.
#[derive(Clone)]
pub(crate) struct Question<'a> {
    pub(crate) step: &'a StepPath,
    pub(crate) title: &'a str,
    pub(crate) text: String,
    pub(crate) help: Option<String>,
    pub(crate) kind: PromptKind,
    /// The world of a simulated cell does or reads what is asked.
    pub(crate) simulated: bool,
}

type Written = Result<(), RecordError>;

impl Journal {
    pub(crate) fn new(record: Record, run: RunId, events: EventSender) -> Self {
        Self { record, run, events }
    }

    /// Where events go, for other threads that show something.
    pub(crate) fn events(&self) -> EventSender {
        self.events.clone()
    }

    /// Shows something that needs no writing down: it can be read again from the device.
    pub(crate) fn show(&self, event: Event) {
        self.events.send(event);
    }

    pub(crate) fn planned(&mut self, steps: Vec<PlannedStep>, estimate_s: f64, first_time: bool) -> Written {
        if first_time {
            let rows: Vec<PlannedRow> = steps
                .iter()
                .map(|step| PlannedRow {
                    step: step.step.0.clone(),
                    title: step.title.clone(),
                    kind: step.kind.clone(),
                    depth: step.depth,
                    estimate_s: step.estimate_s,
                })
                .collect();
            self.record.note_plan(self.run, &rows)?;
        }
        self.show(Event::Planned { steps, estimate_s });
        Ok(())
    }

    pub(crate) fn begin(&mut self, step: &StepPath) -> Result<Attempt, RecordError> {
        let (row, number) = self.record.start_step(self.run, &step.0)?;
        self.show(Event::StepStarted { step: step.clone(), attempt: number });
        Ok(Attempt { row, number, started: std::time::Instant::now() })
    }

    pub(crate) fn end(&mut self, step: &StepPath, attempt: Attempt, end: AttemptEnd<'_>) -> Written {
        let outcome = outcome_name(end.outcome);
        self.record.end_step(attempt.row, &StepEnd { outcome, message: end.message, result: end.result })?;
        self.show(Event::StepFinished {
            step: step.clone(),
            outcome: end.outcome,
            message: end.message.to_owned(),
            values: end.values,
            seconds: attempt.started.elapsed().as_secs_f64(),
        });
        Ok(())
    }

    /// Notes that what was done of a step no longer counts, nor where it was to end: an attempt that nobody sees, as [`Event::WentBack`] reports it.
    pub(crate) fn take_back(&mut self, step: &StepPath, why: &str) -> Written {
        let (row, _) = self.record.start_step(self.run, &step.0)?;
        self.record.note_intent(row, &Value::Null)?;
        let outcome = outcome_name(StepOutcome::Interrupted);
        self.record.end_step(row, &StepEnd { outcome, message: why, result: &Value::Null })
    }

    pub(crate) fn progress(&self, step: &StepPath, fraction: Option<f64>, text: String) {
        self.show(Event::StepProgress { step: step.clone(), fraction, text });
    }

    /// Shows a stripe to anyone who watches; it goes into the record with its scan.
    pub(crate) fn stripe(&self, step: &StepPath, device: &str, stripe: u32, points: Vec<[f32; 3]>) {
        self.show(Event::StripeTaken { step: step.clone(), device: device.to_owned(), stripe, points });
    }

    pub(crate) fn ask(&mut self, question: Question<'_>) -> Result<Prompt, RecordError> {
        let mut prompt = Prompt {
            id: PromptId(0),
            step: question.step.clone(),
            title: question.title.to_owned(),
            text: question.text,
            help: question.help,
            kind: question.kind,
            simulated: question.simulated,
        };
        let id = self.record.ask_prompt(self.run, &question.step.0, |id| {
            prompt.id = PromptId(id);
            serde_json::to_value(&prompt).unwrap_or(Value::Null)
        })?;
        prompt.id = PromptId(id);
        self.show(Event::PromptAsked { prompt: prompt.clone() });
        Ok(prompt)
    }

    pub(crate) fn answered(&mut self, prompt: &Prompt, answer: &Answer, by: &str) -> Written {
        let value = serde_json::to_value(answer).unwrap_or(Value::Null);
        self.record.answer_prompt(prompt.id.0, &value, by)?;
        let (step, answer) = (prompt.step.clone(), answer.clone());
        self.show(Event::PromptAnswered { prompt: prompt.id, step, answer, by: by.to_owned() });
        Ok(())
    }

    pub(crate) fn withdrawn(&mut self, prompt: &Prompt) -> Written {
        self.record.withdraw_prompt(prompt.id.0)?;
        self.show(Event::PromptWithdrawn { prompt: prompt.id });
        Ok(())
    }

    pub(crate) fn interruption(
        &mut self,
        kind: Interruption,
        step: Option<&StepPath>,
        reason: &str,
    ) -> Written {
        self.record.note_interruption(self.run, kind, step.map(|step| step.0.as_str()), reason)
    }

    pub(crate) fn trigger(
        &mut self,
        step: &StepPath,
        trigger: &Trigger<'_>,
        joints: Vec<NamedValue>,
        half_width: NamedValue,
    ) -> Written {
        self.record.note_trigger(self.run, &step.0, trigger)?;
        if trigger.fine {
            let device = trigger.device.to_owned();
            self.show(Event::TriggerFound { step: step.clone(), device, joints, half_width });
        }
        Ok(())
    }

    /// Notes values, and what they come from: `computed`, or a sensor's name.
    pub(crate) fn noted(&mut self, step: &StepPath, source: &str, values: &[NamedValue]) -> Written {
        let readings: Vec<Reading<'_>> = values
            .iter()
            .map(|value| Reading {
                source,
                name: &value.name,
                value: value.value,
                unit: &value.unit,
                uncertainty: value.uncertainty,
            })
            .collect();
        self.record.note_readings(self.run, &step.0, &readings)
    }

    pub(crate) fn proposed(
        &mut self,
        step: &StepPath,
        cell: &str,
        corrections: &[NewCorrection],
    ) -> Result<Vec<i64>, RecordError> {
        let numbers = self.record.propose_corrections(self.run, &step.0, cell, corrections)?;
        for correction in corrections {
            self.show(Event::CorrectionProposed { correction: shown_correction(correction) });
        }
        Ok(numbers)
    }

    pub(crate) fn applied(
        &mut self,
        cell: &str,
        device: &str,
        numbers: &[i64],
        corrections: &[NewCorrection],
        reason: &str,
    ) -> Result<i64, RecordError> {
        let revision = self.record.apply_corrections(cell, device, numbers, reason)?;
        for correction in corrections {
            self.show(Event::CorrectionApplied { correction: shown_correction(correction), revision });
        }
        Ok(revision)
    }

    /// Brings back what was in force for a device at an earlier revision.
    pub(crate) fn undone(&mut self, cell: &str, device: &str, revision: i64, reason: &str) -> Written {
        let back = self.record.roll_back(cell, device, revision, reason)?;
        for correction in &back.changed {
            let correction = shown_correction(correction);
            self.show(Event::CorrectionUndone { correction, revision: back.revision });
        }
        Ok(())
    }

    pub(crate) fn pose(&mut self, device: &str, joints: &Value) -> Written {
        self.record.note_pose(self.run, device, joints)
    }

    pub(crate) fn device(&self, device: &str, plugin: &str, state: DeviceState, message: Option<String>) {
        self.show(Event::Device { device: device.to_owned(), plugin: plugin.to_owned(), state, message });
    }

    pub(crate) fn log(
        &mut self,
        level: LogLevel,
        source: &str,
        step: Option<&StepPath>,
        message: &str,
    ) -> Written {
        let name = match level {
            LogLevel::Debug => "debug",
            LogLevel::Info => "info",
            LogLevel::Warning => "warning",
            LogLevel::Error => "error",
        };
        self.record.note_log(self.run, name, source, step.map(|step| step.0.as_str()), message)?;
        let (source, step, message) = (source.to_owned(), step.cloned(), message.to_owned());
        self.show(Event::Log { level, source, step, message });
        Ok(())
    }

    /// Writes the end of the run down; it is shown when the devices are shut down too.
    pub(crate) fn run_ended(&mut self, outcome: RunOutcome, message: &str) -> Written {
        let end = match outcome {
            RunOutcome::Passed => RunEnd::Passed,
            RunOutcome::Failed => RunEnd::Failed,
            RunOutcome::Error => RunEnd::Error,
            RunOutcome::Aborted => RunEnd::Aborted,
            RunOutcome::NeedsOperator => RunEnd::NeedsOperator,
        };
        self.record.end_run(self.run, end, message)
    }
}

fn outcome_name(outcome: StepOutcome) -> &'static str {
    match outcome {
        StepOutcome::Passed => "passed",
        StepOutcome::Failed => "failed",
        StepOutcome::Error => "error",
        StepOutcome::Skipped => "skipped",
        StepOutcome::NotNeeded => "not_needed",
        StepOutcome::Interrupted => "interrupted",
    }
}

fn shown_correction(correction: &NewCorrection) -> Correction {
    Correction {
        device: correction.key.device.clone(),
        quantity: correction.key.quantity.clone(),
        site: correction.key.site.clone(),
        old: correction.old,
        new: correction.new,
        uncertainty: correction.uncertainty,
        budget: correction.budget.clone(),
        unit: correction.unit.clone(),
    }
}

#[cfg(test)]
mod tests {
    use plumb_record::{CorrectionKey, NewRun};
    use tokio::sync::mpsc::{UnboundedReceiver, unbounded_channel};

    use super::*;
    use crate::event::StampedEvent;

    fn journal() -> (tempfile::TempDir, Journal, UnboundedReceiver<StampedEvent>) {
        let directory = tempfile::tempdir().expect("a directory");
        let mut record = Record::open(directory.path()).expect("a record");
        let run = record.start_run(&NewRun { cell: "cell".into(), ..NewRun::default() }).expect("a run");
        let (sender, events) = unbounded_channel();
        (directory, Journal::new(record, run, EventSender::new(sender)), events)
    }

    fn zero() -> NewCorrection {
        let key = CorrectionKey { device: "arm".into(), quantity: "joint_zero".into(), site: "waist".into() };
        NewCorrection { key, old: 0.0, new: 1.0, uncertainty: Some(0.1), budget: None, unit: "deg".into() }
    }

    fn next(events: &mut UnboundedReceiver<StampedEvent>) -> Option<Event> {
        events.try_recv().ok().map(|stamped| stamped.event)
    }

    /// Nothing can be written any more.
    fn break_the_record(directory: &std::path::Path, table: &str) {
        let other = rusqlite::Connection::open(directory.join("plumb.sqlite3")).expect("opened");
        other.execute_batch(&format!("PRAGMA foreign_keys = OFF; DROP TABLE {table}")).expect("dropped");
    }

    #[test]
    fn a_correction_that_could_not_be_written_down_is_not_shown() {
        let (directory, mut journal, mut events) = journal();
        let step = StepPath("apply".to_owned());
        let numbers = journal.proposed(&step, "cell", &[zero()]).expect("written");
        assert!(matches!(next(&mut events), Some(Event::CorrectionProposed { .. })));
        journal
            .applied("cell", "arm", &[numbers[0], 99], &[zero(), zero()], "test")
            .expect_err("none of number 99");
        assert_eq!(next(&mut events), None, "neither of them is in force, neither is shown");
        break_the_record(directory.path(), "corrections");
        journal.applied("cell", "arm", &numbers, &[zero()], "test").expect_err("nowhere to write");
        journal.proposed(&step, "cell", &[zero()]).expect_err("nowhere to write");
        assert_eq!(next(&mut events), None);
    }

    #[test]
    fn a_step_that_could_not_be_written_down_is_not_shown_and_a_retry_has_the_records_number() {
        let (directory, mut journal, mut events) = journal();
        let step = StepPath("lower".to_owned());
        for attempt in 1..=3 {
            let begun = journal.begin(&step).expect("written");
            assert_eq!(begun.number, attempt);
            let shown = next(&mut events);
            assert_eq!(shown, Some(Event::StepStarted { step: step.clone(), attempt }));
        }
        break_the_record(directory.path(), "steps");
        journal.begin(&step).expect_err("nowhere to write");
        assert_eq!(next(&mut events), None);
    }
}
