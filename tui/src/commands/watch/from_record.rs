//! The events of a run as its record reports them, for who watches from another terminal. What is not written down, such as where a moving joint is,
//! is not reported.

use std::path::Path;
use std::thread;
use std::time::Duration;

use plumb_cell::event::{
    Correction, Event, LogLevel, NamedValue, PlannedStep, RunOutcome, StampedEvent, StepOutcome, StepPath,
};
use plumb_cell::prompt::PromptId;
use plumb_record::{Record, RecordError, RunEnd, RunId, RunState, StoredCorrection, StoredStep};
use serde_json::Value;
use tokio::sync::mpsc::{UnboundedReceiver, unbounded_channel};

/// How often the record is looked at.
const LOOK: Duration = Duration::from_millis(100);

/// How far the record has been reported.
#[derive(Default)]
struct Reported {
    plan: bool,
    steps: usize,
    ended: Vec<bool>,
    prompts: usize,
    /// Prompts that were asked and wait.
    open: Vec<i64>,
    triggers: usize,
    corrections: usize,
    applied: Vec<i64>,
    undone: Vec<i64>,
    interruptions: usize,
    log: usize,
    state: Option<RunState>,
    sequence: u64,
}

/// A correction as events have it.
fn shown(one: &StoredCorrection) -> Correction {
    Correction {
        device: one.key.device.clone(),
        quantity: one.key.quantity.clone(),
        site: one.key.site.clone(),
        old: one.old,
        new: one.new,
        uncertainty: one.uncertainty,
        budget: one.budget.clone(),
        unit: one.unit.clone(),
    }
}

/// Something that happened, and when.
type Happened = (String, Event);

/// Follows a run in the record at `directory` on a thread of its own, from its beginning to its end and through every time it is resumed.
///
/// # Errors
/// There is no such run, or the record cannot be read.
pub(super) fn follow(directory: &Path, run: i64) -> Result<UnboundedReceiver<StampedEvent>, RecordError> {
    let record = Record::open(directory)?;
    let run = record.run(RunId(run))?.run;
    let (to_screens, events) = unbounded_channel();
    thread::spawn(move || {
        let mut reported = Reported::default();
        while let Ok(happened) = reported.look(&record, run) {
            for (time, event) in happened {
                reported.sequence += 1;
                if to_screens.send(StampedEvent { sequence: reported.sequence, time, event }).is_err() {
                    return;
                }
            }
            thread::sleep(LOOK);
        }
    });
    Ok(events)
}

impl Reported {
    /// What is new, in the order it happened.
    fn look(&mut self, record: &Record, run: RunId) -> Result<Vec<Happened>, RecordError> {
        // Read first: what ended the run was written before.
        let summary = record.run(run)?;
        let mut happened = Vec::new();
        if !self.plan {
            let started = Event::RunStarted {
                run: run.0,
                cell: summary.cell.clone(),
                procedure: summary.procedure.clone(),
                title: summary.title.clone(),
                unattended: summary.unattended,
                resumed_at: None,
            };
            let steps = planned(record, run)?;
            if steps.is_empty() && summary.state == RunState::Running {
                return Ok(happened);
            }
            let estimate_s = steps.iter().filter_map(|step| step.estimate_s).sum();
            happened.push((summary.started.clone(), started));
            happened.push((summary.started.clone(), Event::Planned { steps, estimate_s }));
            self.plan = true;
        }
        let mut later = Vec::new();
        self.steps(record, run, &mut later)?;
        self.prompts(record, run, &mut later)?;
        self.findings(record, run, &mut later)?;
        self.words(record, run, &mut later)?;
        later.sort_by(|one, other| one.0.cmp(&other.0));
        happened.extend(later);
        if self.state != Some(summary.state) {
            if let RunState::Ended(end) = summary.state {
                let (outcome, message) = (outcome_of(end), summary.message.unwrap_or_default());
                happened.push((
                    summary.ended.unwrap_or_default(),
                    Event::RunEnded { run: run.0, outcome, message },
                ));
            }
            self.state = Some(summary.state);
        }
        Ok(happened)
    }

    fn steps(
        &mut self,
        record: &Record,
        run: RunId,
        happened: &mut Vec<Happened>,
    ) -> Result<(), RecordError> {
        let steps = record.steps(run)?;
        for step in steps.iter().skip(self.steps) {
            let event = Event::StepStarted { step: StepPath(step.step.clone()), attempt: step.attempt };
            happened.push((step.started.clone(), event));
        }
        self.steps = steps.len();
        self.ended.resize(steps.len(), false);
        for (step, reported) in steps.iter().zip(&mut self.ended) {
            if let (Some(ended), false) = (&step.ended, *reported) {
                happened.push((ended.clone(), finished(step)));
                *reported = true;
            }
        }
        Ok(())
    }

    fn prompts(
        &mut self,
        record: &Record,
        run: RunId,
        happened: &mut Vec<Happened>,
    ) -> Result<(), RecordError> {
        let prompts = record.prompts(run)?;
        for stored in prompts.iter().skip(self.prompts) {
            if let Ok(prompt) = serde_json::from_value(stored.description.clone()) {
                happened.push((stored.asked.clone(), Event::PromptAsked { prompt }));
                self.open.push(stored.id);
            }
        }
        self.prompts = prompts.len();
        for stored in &prompts {
            let waits = self.open.contains(&stored.id);
            let prompt = PromptId(stored.id);
            let ended = match (&stored.answer, &stored.withdrawn) {
                (Some(given), _) => serde_json::from_value(given.answer.clone()).ok().map(|answer| {
                    let (step, by) = (StepPath(stored.step.clone()), given.by.clone());
                    (given.time.clone(), Event::PromptAnswered { prompt, step, answer, by })
                }),
                (None, Some(time)) => Some((time.clone(), Event::PromptWithdrawn { prompt })),
                (None, None) => None,
            };
            if let Some(ended) = ended.filter(|_| waits) {
                happened.push(ended);
                self.open.retain(|known| *known != stored.id);
            }
        }
        Ok(())
    }

    fn findings(
        &mut self,
        record: &Record,
        run: RunId,
        happened: &mut Vec<Happened>,
    ) -> Result<(), RecordError> {
        let triggers = record.triggers(run)?;
        let steps = record.steps(run)?;
        for trigger in triggers.iter().skip(self.triggers).filter(|trigger| trigger.fine) {
            let began = steps.iter().rev().find(|step| step.step == trigger.step);
            let time = began.map(|step| step.ended.clone().unwrap_or_else(|| step.started.clone()));
            let half_width = NamedValue {
                name: trigger.joint.clone(),
                value: trigger.half_width,
                unit: trigger.unit.clone(),
                uncertainty: None,
            };
            let (step, device) = (StepPath(trigger.step.clone()), trigger.device.clone());
            let joints = joints(&trigger.joints);
            happened
                .push((time.unwrap_or_default(), Event::TriggerFound { step, device, joints, half_width }));
        }
        self.triggers = triggers.len();
        let corrections = record.corrections_of_run(run)?;
        for (index, one) in corrections.iter().enumerate() {
            let correction = shown(one);
            if index >= self.corrections {
                happened.push((
                    one.proposed.clone(),
                    Event::CorrectionProposed { correction: correction.clone() },
                ));
            }
            if let (Some(revision), false) = (one.revision, self.applied.contains(&one.id)) {
                happened.push((one.proposed.clone(), Event::CorrectionApplied { correction, revision }));
                self.applied.push(one.id);
            }
        }
        self.corrections = corrections.len();
        for (id, revision) in record.undone_in_run(run)? {
            let Some(one) = corrections.iter().find(|one| one.id == id) else { continue };
            if self.undone.contains(&id) {
                continue;
            }
            self.undone.push(id);
            let mut correction = shown(one);
            std::mem::swap(&mut correction.old, &mut correction.new);
            correction.uncertainty = None;
            correction.budget = None;
            happened.push((one.proposed.clone(), Event::CorrectionUndone { correction, revision }));
        }
        Ok(())
    }

    fn words(
        &mut self,
        record: &Record,
        run: RunId,
        happened: &mut Vec<Happened>,
    ) -> Result<(), RecordError> {
        let interruptions = record.interruptions(run)?;
        for one in interruptions.iter().skip(self.interruptions) {
            let (step, reason) = (one.step.clone().map(StepPath), one.reason.clone());
            let event = match one.kind.as_str() {
                "paused" => Event::Paused { step, reason },
                "resumed" => Event::Resumed,
                "stopped" => Event::Stopped { reason },
                _ => continue,
            };
            happened.push((one.time.clone(), event));
        }
        self.interruptions = interruptions.len();
        let log = record.log(run)?;
        for line in log.iter().skip(self.log) {
            let level = match line.level.as_str() {
                "debug" => LogLevel::Debug,
                "warning" => LogLevel::Warning,
                "error" => LogLevel::Error,
                _ => LogLevel::Info,
            };
            let (source, step) = (line.source.clone(), line.step.clone().map(StepPath));
            happened
                .push((line.time.clone(), Event::Log { level, source, step, message: line.message.clone() }));
        }
        self.log = log.len();
        Ok(())
    }
}

fn planned(record: &Record, run: RunId) -> Result<Vec<PlannedStep>, RecordError> {
    let step = |row: plumb_record::PlannedRow| PlannedStep {
        step: StepPath(row.step),
        title: row.title,
        asks: matches!(row.kind.as_str(), "prompt" | "apply"),
        kind: row.kind,
        depth: row.depth,
        moves: Vec::new(),
        estimate_s: row.estimate_s,
    };
    Ok(record.plan(run)?.into_iter().map(step).collect())
}

fn finished(step: &StoredStep) -> Event {
    let outcome = match step.outcome.as_deref() {
        Some("passed") => StepOutcome::Passed,
        Some("failed") => StepOutcome::Failed,
        Some("skipped") => StepOutcome::Skipped,
        Some("not_needed") => StepOutcome::NotNeeded,
        Some("interrupted") => StepOutcome::Interrupted,
        _ => StepOutcome::Error,
    };
    Event::StepFinished {
        step: StepPath(step.step.clone()),
        outcome,
        message: step.message.clone().unwrap_or_default(),
        values: Vec::new(),
        seconds: 0.0,
    }
}

fn outcome_of(end: RunEnd) -> RunOutcome {
    match end {
        RunEnd::Passed => RunOutcome::Passed,
        RunEnd::Failed => RunOutcome::Failed,
        RunEnd::Error => RunOutcome::Error,
        RunEnd::Aborted => RunOutcome::Aborted,
        RunEnd::NeedsOperator => RunOutcome::NeedsOperator,
    }
}

fn joints(recorded: &Value) -> Vec<NamedValue> {
    let joint = |row: &Value| {
        Some(NamedValue {
            name: row.get("name")?.as_str()?.to_owned(),
            value: row.get("value")?.as_f64()?,
            unit: row.get("unit")?.as_str()?.to_owned(),
            uncertainty: None,
        })
    };
    recorded.as_array().into_iter().flatten().filter_map(joint).collect()
}
