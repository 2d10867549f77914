//! What waits, as it is printed.

use std::error::Error;
use std::process::ExitCode;

use plumb_record::{QueueEntry, Record, RunState, record_option};
use serde_json::Value;

use super::arguments::List;
use crate::commands::answer::is_alive;
use crate::commands::run::prepare::absolute;
use crate::failure::CommandResult;
use crate::print_line::print_line;
use crate::record_directory::record_directory;

/// Prints one queue, or all.
pub(super) fn print(list: &List) -> CommandResult {
    let record = Record::open(&record_directory(list.directory.record.as_ref())?)?;
    let cell_file = list.cell.as_ref().map(|cell| absolute(cell));
    if !list.json {
        print_queue(&record, cell_file.as_deref())?;
        return Ok(ExitCode::SUCCESS);
    }
    for entry in record.queue(cell_file.as_deref())? {
        print_line!("{}", serde_json::to_string(&entry)?)?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Prints queues for people.
pub(super) fn print_queue(record: &Record, cell_file: Option<&str>) -> Result<(), Box<dyn Error>> {
    let entries = record.queue(cell_file)?;
    if entries.is_empty() {
        let option = record_option(record.directory());
        print_line!("nothing waits; `plumb queue add CELL{option}` queues a run")?;
        return Ok(());
    }
    for queue in entries.chunk_by(|one, other| one.cell_file == other.cell_file) {
        let Some(first) = queue.first() else { continue };
        print_line!("{}, {}", first.cell, first.cell_file)?;
        for entry in queue {
            print_line!("  {:>4}  {:24} {}", entry.id, state(record, entry)?, what(entry))?;
        }
    }
    Ok(())
}

/// How an entry is.
fn state(record: &Record, entry: &QueueEntry) -> Result<String, Box<dyn Error>> {
    let (Some(run), Some(state)) = (entry.run, entry.state) else { return Ok("waits".to_owned()) };
    Ok(match state {
        RunState::Running if is_alive(&record.run(run)?) => format!("run {run} goes on"),
        RunState::Running => format!("run {run} was killed"),
        RunState::Ended(end) => format!("run {run}: {}", end.name().replace('_', " ")),
    })
}

/// What an entry runs.
pub(super) fn what(entry: &QueueEntry) -> String {
    let mut words = entry.procedure.clone();
    for (name, value) in entry.parameters.as_object().into_iter().flatten() {
        let value = value.as_f64().map_or_else(|| Value::to_string(value), |value| value.to_string());
        words.push_str(&format!(" {name}={value}"));
    }
    if let Some(answers) = &entry.answers {
        words.push_str(&format!(", answers {answers}"));
    }
    format!("{words} ({})", entry.author)
}
