//! `plumb show`: what the record holds of one run.

mod measurements;
mod numbers;
mod tables;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap_complete::ArgValueCandidates;
use plumb_record::{Record, RecordError, RunFilter, RunId, RunSummary, record_option};
use serde_json::json;

pub(crate) use tables::{answer_in_words, by_size, correlations};

use crate::completion;
use crate::failure::CommandResult;
use crate::print_line::print_line;
use crate::record_directory::record_directory;
use plumb_report::run_words::{skipped_in_words, state_in_words};

/// Show what the record holds of a run: its steps, answers, trigger poses, computed values and corrections.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Its number, as `plumb history` gives it; the newest if left out. With --table, several, whose rows are in one table then.
    run: Vec<i64>,
    /// The newest run of this cell, by the cell's name.
    #[arg(long, value_name = "NAME", conflicts_with = "run", add = ArgValueCandidates::new(completion::recorded_cells))]
    cell: Option<String>,
    /// The newest run of this procedure, by its name.
    #[arg(long, value_name = "NAME", conflicts_with = "run")]
    procedure: Option<String>,
    /// Where the record lies [default: `plumb` in $XDG_STATE_HOME, which is ~/.local/state where that is not set].
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

/// The record holds no such run.
#[derive(Debug, thiserror::Error)]
#[error("no {such}runs{of} in {record}: {help}")]
struct NoRuns {
    such: &'static str,
    of: String,
    record: String,
    help: String,
}

fn no_runs(arguments: &Arguments, directory: &Path) -> NoRuns {
    let of = |what: &str, name: &Option<String>| name.as_ref().map(|name| format!(" of {what} {name}"));
    let parts = [of("procedure", &arguments.procedure), of("cell", &arguments.cell)];
    let of: String = parts.into_iter().flatten().collect();
    let (any, option) = (of.is_empty(), record_option(directory));
    NoRuns {
        such: if any { "" } else { "such " },
        of,
        record: directory.display().to_string(),
        help: match any {
            true => format!("`plumb run CELL{option}` makes the first"),
            false => format!("`plumb history{option}` lists those there are"),
        },
    }
}

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
            let requested = RunFilter {
                cell: arguments.cell.clone(),
                procedure: arguments.procedure.clone(),
                limit: 1,
                ..RunFilter::default()
            };
            let newest = record.find_runs(&requested)?.into_iter().next();
            newest.ok_or_else(|| no_runs(arguments, &directory))?
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
        print_line!("{}", serde_json::to_string_pretty(&everything)?)?;
        return Ok(ExitCode::SUCCESS);
    }
    for line in report(&record, &run)? {
        print_line!("{line}")?;
    }
    Ok(ExitCode::SUCCESS)
}

/// All the record holds of a run, as text, one string a line. Headings are at the margin, what they head is indented.
///
/// # Errors
/// The record cannot be read.
pub(crate) fn report(record: &Record, run: &RunSummary) -> Result<Vec<String>, RecordError> {
    let ended = run.ended.as_deref().unwrap_or("-");
    let mut lines = vec![
        format!("run {} of {}: {}", run.run, run.cell, run.title),
        format!(
            "started {}, ended {ended}, by {}: {}{}",
            run.started,
            run.operator,
            state_in_words(run),
            skipped_in_words(run)
        ),
    ];
    lines.extend(run.message.clone());
    let parameters = run.parameters.as_object().into_iter().flatten();
    let parameters: Vec<String> = parameters.map(|(name, value)| format!("{name} = {value}")).collect();
    if !parameters.is_empty() {
        lines.push(format!("parameters: {}", parameters.join(", ")));
    }
    let id = run.run;
    tables::corrections(&mut lines, &record.corrections_of_run(id)?, &record.undone_in_run(id)?);
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
