//! `plumb history`: the runs in the record.

use std::path::PathBuf;
use std::process::ExitCode;

use plumb_record::{Record, RunEnd, RunState, RunSummary, default_directory};

use crate::failure::CommandResult;
use crate::screens;

/// List the runs in the record, the newest first.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Where the record lies.
    #[arg(long, value_name = "DIR")]
    record: Option<PathBuf>,
    /// At most so many.
    #[arg(short = 'n', long, default_value_t = 20)]
    number: u32,
    /// As JSON, one run a line.
    #[arg(long)]
    json: bool,
    /// On a screen: runs with a filter, one in full, corrections over time.
    #[arg(long, conflicts_with = "json")]
    screen: bool,
}

/// Prints the list.
pub(crate) fn run(arguments: &Arguments) -> CommandResult {
    let directory = record_directory(arguments.record.as_ref())?;
    if arguments.screen {
        screens::browse(directory)?;
        return Ok(ExitCode::SUCCESS);
    }
    let runs = Record::open(&directory)?.history(arguments.number)?;
    if arguments.json {
        for run in &runs {
            println!("{}", serde_json::to_string(run)?);
        }
        return Ok(ExitCode::SUCCESS);
    }
    if runs.is_empty() {
        println!("no runs in {}", directory.display());
        return Ok(ExitCode::SUCCESS);
    }
    println!(
        "{:>5}  {:<20}  {:<14}  {:<20}  {:<30}  by",
        "run", "started (UTC)", "ended", "cell", "procedure"
    );
    for run in &runs {
        let started = run.started.get(..19).unwrap_or(&run.started).replace('T', " ");
        let ended = state_in_words(run);
        println!(
            "{:>5}  {started:<20}  {ended:<14}  {:<20}  {:<30}  {}",
            run.run.0, run.cell, run.procedure, run.operator
        );
    }
    Ok(ExitCode::SUCCESS)
}

/// The directory given, or the default.
pub(crate) fn record_directory(given: Option<&PathBuf>) -> Result<PathBuf, plumb_record::RecordError> {
    match given {
        Some(directory) => Ok(directory.clone()),
        None => default_directory(),
    }
}

/// How a run stands, for people.
pub(crate) fn state_in_words(run: &RunSummary) -> &'static str {
    match run.state {
        RunState::Running => "not ended",
        RunState::Ended(RunEnd::NeedsOperator) => "needs operator",
        RunState::Ended(end) => end.name(),
    }
}
