//! The queue of a cell, one run after the other.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

use plumb_cell::device::{CellResources, Occupancy};
use plumb_cell::event::RunOutcome;
use plumb_document::counted;
use plumb_record::{CellLock, QueueEntry, Record, RecordError, RunEnd, RunState, record_option};

use super::arguments::Run;
use super::list::what;
use crate::commands::run::prepare::{Refused, absolute, operator};
use crate::commands::run::{OfQueue, queued};
use crate::failure::CommandResult;
use crate::print_line::print_line;
use crate::record_directory::record_directory;
use crate::signals::{EndingSignals, SignalsInTurn};

/// How often an empty queue, or a cell that somebody else runs, is looked at.
const LOOK: Duration = Duration::from_millis(500);

/// Why the queue is not carried out.
#[derive(Debug, thiserror::Error)]
enum CarryOutError {
    #[error("the queue of this cell is carried out already, by process {0}")]
    Twice(String),
    #[error("there is no cell file {}", .0.display())]
    NoCell(PathBuf),
    /// Not passed on as the system's error: of a command that only prints, a reader that went away is no error.
    #[error("the queue stops, since its standard output cannot be written: {0}")]
    Unread(String),
}

/// What comes next in a queue.
enum Next {
    /// A new run for an entry that waits.
    Begin(QueueEntry),
    /// The run of this number, which was killed or kept.
    GoOn(QueueEntry, i64),
    /// A run that did not pass: a person decides.
    InTheWay(QueueEntry),
    /// Nothing waits.
    Empty,
}

/// One queue, and how it is carried out.
struct Queue<'a> {
    arguments: &'a Run,
    directory: PathBuf,
    cell_file: String,
    record: Record,
    signals: SignalsInTurn,
    /// It was said that somebody else runs the cell.
    shown_in_use: bool,
}

/// Carries the queue out until it is empty, or a run does not pass.
pub(super) fn carry_out(arguments: &Run) -> CommandResult {
    plumb_bus::check_limits()?;
    // Before any thread is started: each would else be ended by them.
    let signals = EndingSignals::take_over()?;
    if !arguments.cell.is_file() {
        return Err(CarryOutError::NoCell(arguments.cell.clone()).into());
    }
    let directory = record_directory(arguments.directory.record.as_ref())?;
    let cell_file = absolute(&arguments.cell);
    let record = Record::open(&directory)?;
    let folder = CellResources::of_cell(Path::new(&cell_file))?;
    // Beside the record, under the cell's own short name: it outlives no run, and what looks for a cell's remains does not find it.
    let name = folder.domain().root().file_name().unwrap_or_default().to_string_lossy().into_owned();
    let lock = CellLock::take_file(&directory.join(format!("{name}-queue.lock")), &cell_file, &cell_file);
    let _lock = lock.map_err(|error| match error {
        RecordError::CellLocked { process, .. } => Box::from(CarryOutError::Twice(process)),
        error => Box::<dyn std::error::Error>::from(error),
    })?;
    let mut queue =
        Queue { arguments, directory, cell_file, record, signals: signals.in_turn(), shown_in_use: false };
    loop {
        if let Some(code) = queue.turn(&folder)? {
            return Ok(code);
        }
    }
}

impl Queue<'_> {
    /// Carries out what comes next; the exit code, when that was the end.
    fn turn(&mut self, resources: &CellResources) -> Result<Option<ExitCode>, Box<dyn std::error::Error>> {
        if self.signals.ask_to_end() {
            return Ok(Some(ExitCode::from(RunOutcome::NeedsOperator.exit_code())));
        }
        let (entry, resume) = match self.next()? {
            Next::Empty if self.arguments.wait => {
                std::thread::sleep(LOOK);
                return Ok(None);
            }
            Next::Empty => {
                self.print_line("the queue is empty")?;
                return Ok(Some(ExitCode::SUCCESS));
            }
            Next::InTheWay(entry) => {
                eprintln!("plumb: {}", in_the_way(&entry, &record_option(&self.directory)));
                return Ok(Some(ExitCode::from(RunOutcome::NeedsOperator.exit_code())));
            }
            Next::Begin(entry) => (entry, None),
            Next::GoOn(entry, run) => (entry, Some(run)),
        };
        // A person who runs the cell by hand is waited for.
        if let Occupancy::InUse(holder) = resources.state() {
            if !self.shown_in_use {
                self.print_line(&format!("process {} runs the cell; waiting for its end", holder.process))?;
                self.shown_in_use = true;
            }
            std::thread::sleep(LOOK);
            return Ok(None);
        }
        self.shown_in_use = false;
        self.print_line(&match resume {
            None => format!("entry {}: {}", entry.id, what(&entry)),
            Some(run) => format!("entry {}: going on with run {run}: {}", entry.id, what(&entry)),
        })?;
        self.carry_out(&entry, resume)
    }

    /// What comes next. What has begun comes before what waits.
    fn next(&self) -> Result<Next, RecordError> {
        for entry in self.record.queue(Some(&self.cell_file))? {
            return Ok(match (entry.run, entry.state) {
                (None, _) => Next::Begin(entry),
                (Some(run), Some(RunState::Running | RunState::Ended(RunEnd::NeedsOperator))) => {
                    Next::GoOn(entry, run.0)
                }
                (Some(_), Some(RunState::Ended(RunEnd::Failed))) if self.arguments.past_failed => continue,
                (Some(_), _) => Next::InTheWay(entry),
            });
        }
        Ok(Next::Empty)
    }

    /// One run; the exit code, when the queue ends with it.
    fn carry_out(
        &self,
        entry: &QueueEntry,
        resume: Option<i64>,
    ) -> Result<Option<ExitCode>, Box<dyn std::error::Error>> {
        match queued::carry_out(&self.run_of(entry, resume).into(), &self.signals) {
            Ok(RunOutcome::Passed) => Ok(None),
            Ok(RunOutcome::Failed) if self.arguments.past_failed => Ok(None),
            Ok(outcome) => {
                let waiting = self.record.queue(Some(&self.cell_file))?;
                let waiting = waiting.iter().filter(|entry| entry.is_waiting()).count();
                // Where it cannot be written, that may be why the run was aborted: its exit code says more.
                let waiting = counted(waiting, "waits", "wait");
                let _unread = self.print_line(&format!("the queue stops at entry {}; {waiting}", entry.id));
                Ok(Some(ExitCode::from(outcome.exit_code())))
            }
            // Taken off, or begun by another program, between the look and the start.
            Err(_) if resume.is_none() && !self.record.queue_entry(entry.id)?.is_waiting() => Ok(None),
            Err(refused) => {
                eprintln!("plumb: the queue stops at entry {}, which cannot start:", entry.id);
                Refused::report(refused).map(Some)
            }
        }
    }

    fn run_of(&self, entry: &QueueEntry, resume: Option<i64>) -> OfQueue {
        let values = entry.parameters.as_object().into_iter().flatten();
        OfQueue {
            cell: PathBuf::from(&entry.cell_file),
            procedure: Some(entry.procedure.clone()),
            set: values.filter_map(|(name, value)| Some((name.clone(), value.as_f64()?))).collect(),
            // A run that goes on knows its own.
            answers: if resume.is_none() { entry.answers.as_ref().map(PathBuf::from) } else { None },
            entry: if resume.is_none() { Some(entry.id) } else { None },
            resume,
            record: self.directory.clone(),
            operator: operator(self.arguments.operator.as_ref()),
            pace: self.arguments.pace,
            plugins: self.arguments.plugins.clone(),
            accept_plugins: self.arguments.accept_plugins,
            json: self.arguments.json,
        }
    }

    /// A line for people; events are printed as JSON alone.
    fn print_line(&self, line: &str) -> Result<(), CarryOutError> {
        if self.arguments.json {
            return Ok(());
        }
        print_line!("{line}").map_err(|cause| CarryOutError::Unread(cause.to_string()))
    }
}

/// What is in the way, and what a person may do.
fn in_the_way(entry: &QueueEntry, option: &str) -> String {
    let run = entry.run.map_or(0, |run| run.0);
    let (how, resume) = match entry.state {
        Some(RunState::Ended(RunEnd::Failed)) => ("failed", None),
        Some(RunState::Ended(RunEnd::Aborted)) => ("was aborted", None),
        _ => ("ended with an error", Some(format!("`plumb run --resume {run}{option}` goes on with it, "))),
    };
    let message = entry.message.as_ref().map(|message| format!(" ({message})")).unwrap_or_default();
    format!(
        "entry {} is in the way: run {run} {how}{message}. {}`plumb queue remove {}{option}` takes it off, and the queue goes on with the next",
        entry.id,
        resume.unwrap_or_default(),
        entry.id
    )
}
