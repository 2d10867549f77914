//! `plumb show`: what the record holds of one run.

mod measurements;
mod numbers;
mod tables;

use std::path::PathBuf;
use std::process::ExitCode;

use plumb_record::{Record, RecordError, RunId, RunSummary};
use serde_json::json;

pub(crate) use tables::answer_in_words;

use crate::failure::CommandResult;
use crate::history_command::{record_directory, state_in_words};
use crate::say::say;

/// Show what the record holds of a run: its steps, answers, trigger poses, computed values and corrections.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Its number, as `plumb history` gives it; the newest if left out. With --table, several, whose rows stand in one table then.
    run: Vec<i64>,
    /// Where the record lies.
    #[arg(long, value_name = "DIR")]
    record: Option<PathBuf>,
    /// Everything as one JSON object.
    #[arg(long, group = "form")]
    json: bool,
    /// Every number of the run as CSV: values, trigger poses, answers and corrections, one a line.
    #[arg(long, group = "form")]
    csv: bool,
    /// Trigger poses and rows of measurements as a table (CSV), which `plumb model` reads with the cell's model file.
    #[arg(long, group = "form")]
    table: bool,
    /// With --table: joints by the zeros the run found, rather than by those in force when it began.
    #[arg(long, requires = "table")]
    as_left: bool,
    /// With --table: which robot, where the cell has several.
    #[arg(long, value_name = "ROBOT", requires = "table")]
    robot: Option<String>,
}

/// The record holds no run at all.
#[derive(Debug, thiserror::Error)]
#[error("no runs in {0}: `plumb run CELL` makes the first")]
struct NoRuns(String);

/// Only a table can hold several.
#[derive(Debug, thiserror::Error)]
#[error("one run is shown at a time; several make one table with --table")]
struct SeveralRuns;

/// Prints the run.
pub(crate) fn run(arguments: &Arguments) -> CommandResult {
    let directory = record_directory(arguments.record.as_ref())?;
    let record = Record::open(&directory)?;
    let run = match arguments.run.as_slice() {
        [run, others @ ..] if others.is_empty() || arguments.table => record.run(RunId(*run))?,
        [] => {
            let newest = record.history(1)?.into_iter().next();
            newest.ok_or_else(|| NoRuns(directory.display().to_string()))?
        }
        _ => return Err(SeveralRuns.into()),
    };
    if arguments.csv {
        return numbers::print(&record, &run);
    }
    if arguments.table {
        return measurements::print(&record, &run, arguments);
    }
    if arguments.json {
        let id = run.run;
        let everything = json!({
            "run": run,
            "instruments": record.instruments(id)?,
            "notes": record.notes(id)?,
            "loaded": record.loaded(id)?,
            "plan": record.plan(id)?,
            "steps": record.steps(id)?,
            "prompts": record.prompts(id)?,
            "triggers": record.triggers(id)?,
            "readings": record.readings(id)?,
            "corrections": record.corrections_of_run(id)?,
            "interruptions": record.interruptions(id)?,
            "log": record.log(id)?,
        });
        say!("{}", serde_json::to_string_pretty(&everything)?)?;
        return Ok(ExitCode::SUCCESS);
    }
    for line in report(&record, &run)? {
        say!("{line}")?;
    }
    Ok(ExitCode::SUCCESS)
}

/// All the record holds of a run, as text, one string a line. Headings stand at the margin, what they head is indented.
///
/// # Errors
/// The record cannot be read.
pub(crate) fn report(record: &Record, run: &RunSummary) -> Result<Vec<String>, RecordError> {
    let ended = run.ended.as_deref().unwrap_or("-");
    let mut lines = vec![
        format!("run {} of {}: {}", run.run, run.cell, run.title),
        format!("started {}, ended {ended}, by {}: {}", run.started, run.operator, state_in_words(run)),
    ];
    lines.extend(run.message.clone());
    let parameters = run.parameters.as_object().into_iter().flatten();
    let parameters: Vec<String> = parameters.map(|(name, value)| format!("{name} = {value}")).collect();
    if !parameters.is_empty() {
        lines.push(format!("parameters: {}", parameters.join(", ")));
    }
    let id = run.run;
    tables::corrections(&mut lines, &record.corrections_of_run(id)?);
    tables::steps(&mut lines, &record.steps(id)?);
    tables::answers(&mut lines, &record.prompts(id)?);
    tables::triggers(&mut lines, &record.triggers(id)?);
    tables::readings(&mut lines, &record.readings(id)?);
    tables::interruptions(&mut lines, &record.interruptions(id)?);
    let day = run.started.get(..10).unwrap_or_default();
    tables::instruments(&mut lines, &record.instruments(id)?, day);
    tables::notes(&mut lines, &record.notes(id)?);
    tables::files(&mut lines, &record.loaded(id)?);
    Ok(lines)
}
