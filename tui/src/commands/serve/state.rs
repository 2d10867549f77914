//! What the page shows: the last run of each cell, read from the record.

use plumb_cell::prompt::{Prompt, PromptKind};
use plumb_record::{
    PlannedRow, QueueEntry, Record, RecordError, RunFilter, RunState, RunSummary, StoredStep,
};
use serde::Serialize;

use crate::commands::answer::{SIMULATE, is_alive, ways_to_answer};

/// Version of this contract.
const VERSION: u32 = 1;

/// Lines of the log that are shown.
const LOG_LINES: usize = 20;

/// Runs that are looked at for the newest of each cell.
const RUNS: u32 = 200;

/// Everything the page shows.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct PageState {
    version: u32,
    /// Whether answers are taken at all.
    pub(super) answers: bool,
    /// Who may answer now.
    pub(super) holder: Option<String>,
    cells: Vec<CellPage>,
}

/// One cell's last run.
#[derive(Debug, Clone, PartialEq, Serialize)]
struct CellPage {
    cell: String,
    run: i64,
    procedure: String,
    title: String,
    operator: String,
    /// `running`, `passed`, `failed`, `error`, `aborted`, `needs_operator`; `killed` where it should run and no program runs it.
    state: String,
    message: Option<String>,
    started: String,
    ended: Option<String>,
    steps: Vec<StepLine>,
    prompt: Option<PromptBox>,
    corrections: Vec<CorrectionLine>,
    /// Procedures that wait for the cell, in their order.
    queued: Vec<String>,
    log: Vec<LogLine>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
struct StepLine {
    step: String,
    title: String,
    depth: u32,
    /// `passed`, `failed`, ... of its last attempt; `running`; none where it has not begun.
    outcome: Option<String>,
    message: Option<String>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
struct PromptBox {
    id: i64,
    step: String,
    title: String,
    text: String,
    asked: String,
    /// What the prompt asks for, as events have it.
    kind: PromptKind,
    /// How it is answered, in words.
    answer_with: String,
    /// What leaves it and everything like it to the program; in a simulated cell alone.
    #[serde(skip_serializing_if = "Option::is_none")]
    simulate: Option<&'static str>,
    /// Why it can be answered beside the arm alone.
    only_at_the_arm: Option<&'static str>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
struct CorrectionLine {
    device: String,
    quantity: String,
    #[serde(rename = "place")]
    site: String,
    old: f64,
    new: f64,
    uncertainty: Option<f64>,
    unit: String,
    in_force: bool,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
struct LogLine {
    time: String,
    level: String,
    message: String,
}

/// Reads it from the record.
///
/// # Errors
/// The record cannot be read.
pub(super) fn read(record: &Record, answers: bool, holder: Option<String>) -> Result<PageState, RecordError> {
    let filter = RunFilter { limit: RUNS, ..RunFilter::default() };
    let mut newest: Vec<RunSummary> = Vec::new();
    for run in record.find_runs(&filter)? {
        if newest.iter().all(|newer| newer.cell_file != run.cell_file) {
            newest.push(run);
        }
    }
    newest.sort_by(|one, other| one.cell.cmp(&other.cell));
    let cells = newest.iter().map(|run| cell_page(record, run)).collect::<Result<_, _>>()?;
    Ok(PageState { version: VERSION, answers, holder, cells })
}

fn cell_page(record: &Record, run: &RunSummary) -> Result<CellPage, RecordError> {
    let (plan, steps) = (record.plan(run.run)?, record.steps(run.run)?);
    let goes_on = run.state == RunState::Running;
    let alive = goes_on && is_alive(run);
    let log = record.log(run.run)?;
    let queue = record.queue(Some(&run.cell_file))?;
    let (corrections, undone) = (record.corrections_of_run(run.run)?, record.undone_in_run(run.run)?);
    Ok(CellPage {
        cell: run.cell.clone(),
        run: run.run.0,
        procedure: run.procedure.clone(),
        title: run.title.clone(),
        operator: run.operator.clone(),
        state: state_name(run.state, alive).to_owned(),
        message: run.message.clone(),
        started: run.started.clone(),
        ended: run.ended.clone(),
        steps: plan.iter().map(|row| step_line(row, &steps)).collect(),
        prompt: if alive { open_prompt(record, run)? } else { None },
        corrections: corrections
            .into_iter()
            .map(|one| CorrectionLine {
                device: one.key.device,
                quantity: one.key.quantity,
                site: one.key.site,
                old: one.old,
                new: one.new,
                uncertainty: one.uncertainty,
                unit: one.unit,
                in_force: one.revision.is_some() && undone.iter().all(|(id, _)| *id != one.id),
            })
            .collect(),
        queued: queue.into_iter().filter(QueueEntry::is_waiting).map(|entry| entry.procedure).collect(),
        log: log
            .iter()
            .skip(log.len().saturating_sub(LOG_LINES))
            .map(|line| LogLine {
                time: line.time.clone(),
                level: line.level.clone(),
                message: line.message.clone(),
            })
            .collect(),
    })
}

/// The state of a run, as its page and the JSON have it.
fn state_name(state: RunState, alive: bool) -> &'static str {
    match state {
        RunState::Running if alive => "running",
        RunState::Running => "killed",
        RunState::Ended(end) => end.name(),
    }
}

/// A row of the plan with what became of it.
fn step_line(row: &PlannedRow, steps: &[StoredStep]) -> StepLine {
    let last = steps.iter().rev().find(|step| step.step == row.step);
    StepLine {
        step: row.step.clone(),
        title: row.title.clone(),
        depth: row.depth,
        outcome: last.map(|step| step.outcome.clone().unwrap_or_else(|| "running".to_owned())),
        message: last.and_then(|step| step.message.clone()),
    }
}

fn open_prompt(record: &Record, run: &RunSummary) -> Result<Option<PromptBox>, RecordError> {
    let Some(stored) = record.open_prompt(run.run)? else { return Ok(None) };
    // A prompt of a newer program that this one cannot read is not shown, rather than shown half.
    let Ok(prompt) = serde_json::from_value::<Prompt>(stored.description) else { return Ok(None) };
    Ok(Some(PromptBox {
        id: stored.id,
        step: prompt.step.to_string(),
        title: prompt.title,
        text: prompt.text,
        asked: stored.asked,
        answer_with: ways_to_answer(&prompt.kind),
        simulate: prompt.simulated.then_some(SIMULATE),
        only_at_the_arm: only_at_the_arm(&prompt.kind),
        kind: prompt.kind,
    }))
}

/// Why a prompt is answered beside the arm alone: its answer moves the arm, or says where it is. No motion is commanded
/// over the network.
pub(super) fn only_at_the_arm(kind: &PromptKind) -> Option<&'static str> {
    match kind {
        PromptKind::JogTo { .. } => Some("it moves the arm: answer it where the arm is seen"),
        PromptKind::ConfirmPose { .. } => Some("it asks where the arm is: answer it where the arm is seen"),
        PromptKind::Photo => Some("it asks for a file on the cell's own machine"),
        _ => None,
    }
}
