//! `plumb queue`: runs that wait for their cell, carried out one after the other.

mod arguments;
mod carry_out;
mod list;

use std::process::ExitCode;

use plumb_record::{NewQueueEntry, QueueEntry, QueuePosition, Record};
use serde_json::{Map, Value};

pub(crate) use arguments::QueueCommand;
use arguments::{Add, Move, Remove};

use crate::commands::answer::is_alive;
use crate::commands::run::OfQueue;
use crate::commands::run::prepare::{absolute, operator};
use crate::commands::run::queued::check;
use crate::failure::CommandResult;
use crate::print_line::print_line;
use crate::record_directory::record_directory;

/// Why the queue is not changed.
#[derive(Debug, thiserror::Error)]
enum QueueError {
    #[error("the run of entry {entry} goes on: end run {run} first, at its cell")]
    GoesOn { entry: i64, run: i64 },
    #[error("name the entries to take off, as in `plumb queue remove 3 4`; `plumb queue list` numbers them")]
    NoEntries,
}

/// Does it.
pub(crate) fn run(command: &QueueCommand) -> CommandResult {
    match command {
        QueueCommand::Add(add) => queue_up(add),
        QueueCommand::List(list) => list::print(list),
        QueueCommand::Move(to) => reorder(to),
        QueueCommand::Remove(remove) => take_off(remove),
        QueueCommand::Run(run) => carry_out::carry_out(run),
    }
}

/// Everything a run needs is read and planned now, so that what cannot run is refused while somebody is there to mend it.
fn queue_up(add: &Add) -> CommandResult {
    let directory = record_directory(add.directory.record.as_ref())?;
    let author = operator(add.operator.as_ref());
    let run = OfQueue {
        cell: add.cell.clone(),
        procedure: add.procedure.clone(),
        set: add.set.clone(),
        answers: add.answers.clone(),
        entry: None,
        resume: None,
        record: directory.clone(),
        operator: author.clone(),
        pace: None,
        plugins: add.plugins.clone(),
        accept_plugins: false,
        json: false,
    };
    let checked = match check(&run.into()) {
        Ok(checked) => checked,
        Err(refused) => return refused.report(),
    };
    let mut record = Record::open(&directory)?;
    let entry = record.add_to_queue(&NewQueueEntry {
        cell: checked.cell.clone(),
        cell_file: checked.cell_file.clone(),
        procedure: checked.procedure.clone(),
        parameters: parameters(&add.set),
        answers: add.answers.as_ref().map(|file| absolute(file)),
        author,
    })?;
    if add.first {
        record.move_in_queue(entry, QueuePosition::First)?;
    }
    let queue = record.queue(Some(&checked.cell_file))?;
    let before = queue.iter().take_while(|one| one.id != entry).filter(|one| one.is_waiting()).count();
    print_line!(
        "entry {entry}: {} of {}, about {:.0} min; {before} wait before it",
        checked.procedure,
        checked.cell,
        (checked.estimate_s / 60.0).ceil()
    )?;
    Ok(ExitCode::SUCCESS)
}

/// A parameter that is set twice has its last value, as on the command line of `plumb run`.
fn parameters(set: &[(String, f64)]) -> Value {
    let values: Map<String, Value> =
        set.iter().map(|(name, value)| (name.clone(), Value::from(*value))).collect();
    Value::Object(values)
}

fn reorder(to: &Move) -> CommandResult {
    let mut record = Record::open(&record_directory(to.directory.record.as_ref())?)?;
    record.move_in_queue(to.entry, to.to())?;
    let entry = record.queue_entry(to.entry)?;
    list::print_queue(&record, Some(&entry.cell_file))?;
    Ok(ExitCode::SUCCESS)
}

fn take_off(remove: &Remove) -> CommandResult {
    if remove.entries.is_empty() {
        return Err(QueueError::NoEntries.into());
    }
    let mut record = Record::open(&record_directory(remove.directory.record.as_ref())?)?;
    // All or none: a number that was mistyped takes nothing off.
    let entries: Vec<QueueEntry> =
        remove.entries.iter().map(|entry| record.queue_entry(*entry)).collect::<Result<_, _>>()?;
    for entry in &entries {
        refuse_going_on(&record, entry)?;
    }
    for entry in &entries {
        record.remove_from_queue(entry.id)?;
        print_line!("entry {}, {} of {}, is off the queue", entry.id, entry.procedure, entry.cell)?;
    }
    Ok(ExitCode::SUCCESS)
}

/// A run that goes on is not ended from a list.
fn refuse_going_on(record: &Record, entry: &QueueEntry) -> Result<(), Box<dyn std::error::Error>> {
    let Some(run) = entry.run else { return Ok(()) };
    let run = record.run(run)?;
    if run.state == plumb_record::RunState::Running && is_alive(&run) {
        return Err(QueueError::GoesOn { entry: entry.id, run: run.run.0 }.into());
    }
    Ok(())
}
