//! What people are to know.

use std::time::Duration;

use plumb_record::{
    Record, RecordError, RunEnd, RunFilter, RunState, RunSummary, StoredPrompt, record_option, seconds_since,
};
use serde::Serialize;

use crate::commands::answer::is_alive;

/// Runs that are looked at. More that go on at once than this are on no machine.
const RUNS: u32 = 200;

/// How many days after its end a run's end is still reported: anyone who comes back after a weekend has seen an older one.
pub(super) const RECENT_DAYS: u32 = 3;

/// When something is reported.
pub(super) struct Limits {
    /// How long a prompt may wait.
    pub(super) prompt: Duration,
    /// How much longer than planned a step may take.
    pub(super) step: Duration,
    /// Also when a run ends otherwise than passed.
    pub(super) ended: bool,
}

/// Which kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Kind {
    /// A prompt waits.
    PromptWaits,
    /// A step takes far longer than planned.
    StepLate,
    /// The program of a run has gone.
    Killed,
    /// A run ended otherwise than passed.
    Ended,
    /// The central database has heard nothing of a cell for long.
    Silent,
    /// The central database does not answer.
    DatabaseSilent,
    /// Nothing is wrong; somebody tries whether messages arrive.
    Test,
}

/// One thing to be reported.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Trouble {
    /// What distinguishes it from every other one of this record, or of all records of a database.
    #[serde(skip)]
    pub(super) key: String,
    /// Which kind.
    pub(super) kind: Kind,
    /// The cell.
    pub(super) cell: String,
    /// The run; none where it is of no run.
    pub(super) run: Option<i64>,
    /// Since when, UTC.
    pub(super) since: String,
    /// A sentence.
    pub(super) text: String,
}

impl Trouble {
    fn of(run: &RunSummary, kind: Kind, key: String, since: &str, text: String) -> Self {
        let text = format!("{}: {text}", run.cell);
        Self { key, kind, cell: run.cell.clone(), run: Some(run.run.0), since: since.to_owned(), text }
    }

    /// A message that says that it is a test.
    pub(super) fn test() -> Self {
        Self {
            key: "test".to_owned(),
            kind: Kind::Test,
            cell: String::new(),
            run: None,
            since: plumb_record::timestamp(),
            text: "a test of plumb alert: nothing is wrong".to_owned(),
        }
    }
}

/// Everything that is to be reported now.
pub(super) fn look(record: &Record, limits: &Limits) -> Result<Vec<Trouble>, RecordError> {
    let mut found = Vec::new();
    let running = RunFilter { state: Some("running".to_owned()), limit: RUNS, ..RunFilter::default() };
    let mut seen: Vec<String> = Vec::new();
    for run in record.find_runs(&running)? {
        // Of one cell only the newest can go on: those before it were killed, and somebody went on without them.
        if !seen.contains(&run.cell_file) {
            found.extend(of_open_run(record, &run, limits)?);
            seen.push(run.cell_file);
        }
    }
    if limits.ended {
        for run in record.find_runs(&RunFilter { limit: RUNS, ..RunFilter::default() })? {
            found.extend(of_ended_run(&run));
        }
    }
    Ok(found)
}

/// Of a run that has not ended.
fn of_open_run(record: &Record, run: &RunSummary, limits: &Limits) -> Result<Option<Trouble>, RecordError> {
    let number = run.run.0;
    if !is_alive(run) {
        // The run may have ended between the two looks.
        if record.run(run.run)?.state != RunState::Running {
            return Ok(None);
        }
        let text = format!(
            "the program that ran run {number} has gone; `plumb run --resume {number}{}` goes on with it",
            record_option(record.directory())
        );
        return Ok(Some(Trouble::of(run, Kind::Killed, format!("killed {number}"), &run.started, text)));
    }
    if let Some(prompt) = record.open_prompt(run.run)? {
        return Ok(waiting(run, &prompt, limits));
    }
    let Some(step) = record.open_step(run.run)? else { return Ok(None) };
    let planned_s = step.estimate_s.unwrap_or(0.0).max(0.0);
    let late_s = seconds_since(&step.started).unwrap_or(0.0) - planned_s;
    let text = late_text(&step.step, number, late_s);
    let key = format!("step {}", step.row);
    let late = Trouble::of(run, Kind::StepLate, key, &step.started, text);
    Ok((late_s > limits.step.as_secs_f64()).then_some(late))
}

fn waiting(run: &RunSummary, prompt: &StoredPrompt, limits: &Limits) -> Option<Trouble> {
    let waits_s = seconds_since(&prompt.asked)?;
    let title = prompt.description.get("title").and_then(serde_json::Value::as_str).unwrap_or(&prompt.step);
    let text = waiting_text(title, waits_s, run.run.0);
    let trouble = Trouble::of(run, Kind::PromptWaits, format!("prompt {}", prompt.id), &prompt.asked, text);
    (waits_s >= limits.prompt.as_secs_f64()).then_some(trouble)
}

fn of_ended_run(run: &RunSummary) -> Option<Trouble> {
    let RunState::Ended(end) = run.state else { return None };
    let ended = run.ended.as_deref()?;
    if end == RunEnd::Passed || seconds_since(ended)? > f64::from(RECENT_DAYS) * 86_400.0 {
        return None;
    }
    let number = run.run.0;
    let text = ended_text(number, end.name(), run.message.as_deref());
    // A run that was resumed may end again.
    Some(Trouble::of(run, Kind::Ended, format!("ended {number} {ended}"), ended, text))
}

pub(super) fn waiting_text(title: &str, waits_s: f64, run: i64) -> String {
    format!("`{title}` has waited for an answer for {} (run {run})", minutes(waits_s))
}

pub(super) fn late_text(step: &str, run: i64, late_s: f64) -> String {
    format!("step {step} of run {run} has taken {} longer than planned", minutes(late_s))
}

pub(super) fn ended_text(run: i64, state: &str, message: Option<&str>) -> String {
    let message = message.map(|message| format!(", {message}")).unwrap_or_default();
    format!("run {run} has ended: {}{message}", state.replace('_', " "))
}

/// A time for people.
pub(super) fn minutes(seconds: f64) -> String {
    match seconds {
        seconds if seconds < 120.0 => format!("{seconds:.0} s"),
        seconds if seconds < 7_200.0 => format!("{:.0} min", seconds / 60.0),
        seconds => format!("{:.0} h", seconds / 3_600.0),
    }
}
