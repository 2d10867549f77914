//! `plumb certificate`: what a calibration found and left, as one HTML file.

mod page;

use std::path::PathBuf;
use std::process::ExitCode;

use plumb_record::{Record, RunEnd, RunId, RunState, record_option};

use crate::failure::CommandResult;
use crate::print_line::print_line;
use crate::record_directory::record_directory;
use page::{Certificate, page};
use plumb_report::run_words::state_in_words;

/// Write a certificate of a run, to print. It shows the machine as it was found and as it was left, with uncertainties, instruments, trigger
/// poses, and the hashes of what was loaded. One HTML file that needs nothing else; print it to have it as PDF.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// The run's number, as `plumb history` gives it.
    run: i64,
    /// The HTML file to write.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Where the record lies [default: `plumb` in $XDG_STATE_HOME, which is ~/.local/state where that is not set].
    #[arg(long, value_name = "DIR")]
    record: Option<PathBuf>,
}

/// Why there is no certificate.
#[derive(Debug, thiserror::Error)]
enum CertificateError {
    #[error(
        "run {run} has not passed ({state}): only a run that passed certifies something; `plumb show {run}{option}` shows what it did"
    )]
    NotPassed { run: i64, state: &'static str, option: String },
    #[error(
        "run {0} found no correction: there is nothing to certify; `plumb model report` shows what a fitted model has improved"
    )]
    NothingFound(i64),
    #[error("{} cannot be written", path.display())]
    Write { path: PathBuf, source: std::io::Error },
}

/// Writes it.
pub(crate) fn run(arguments: &Arguments) -> CommandResult {
    let record = Record::open(&record_directory(arguments.record.as_ref())?)?;
    let run = record.run(RunId(arguments.run))?;
    if run.state != RunState::Ended(RunEnd::Passed) {
        let (state, option) = (state_in_words(&run), record_option(record.directory()));
        return Err(CertificateError::NotPassed { run: arguments.run, state, option }.into());
    }
    let id = run.run;
    let mut corrections = record.corrections_of_run(id)?;
    // What the operator went back past is not as left.
    let undone = record.undone_in_run(id)?;
    corrections.retain(|one| undone.iter().all(|(taken_back, _)| *taken_back != one.id));
    if corrections.is_empty() {
        return Err(CertificateError::NothingFound(arguments.run).into());
    }
    let certificate = Certificate {
        corrections,
        instruments: record.instruments(id)?,
        notes: record.notes(id)?,
        triggers: record.triggers(id)?,
        prompts: record.prompts(id)?,
        loaded: record.loaded(id)?,
        run,
    };
    let write = |source| CertificateError::Write { path: arguments.output.clone(), source };
    std::fs::write(&arguments.output, page(&certificate)).map_err(write)?;
    print_line!("{}: certificate of run {}", arguments.output.display(), arguments.run)?;
    Ok(ExitCode::SUCCESS)
}
