//! `plumb note`: something to be remembered with a run.

use std::path::PathBuf;
use std::process::ExitCode;

use plumb_record::{Record, RunId};

use crate::commands::run::prepare::operator;
use crate::failure::CommandResult;
use crate::print_line::print_line;
use crate::record_directory::record_directory;

/// Add a note to a run, during it or years after. Notes are only added, never changed.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// The run's number, as `plumb history` gives it.
    run: i64,
    /// What is to be remembered.
    #[arg(required = true)]
    text: Vec<String>,
    /// Where the record lies [default: `plumb` in $XDG_STATE_HOME, which is ~/.local/state where that is not set].
    #[arg(long, value_name = "DIR")]
    record: Option<PathBuf>,
    /// Who writes it; your login name if left out.
    #[arg(long, value_name = "NAME")]
    operator: Option<String>,
}

/// Adds it.
pub(crate) fn run(arguments: &Arguments) -> CommandResult {
    let mut record = Record::open(&record_directory(arguments.record.as_ref())?)?;
    let author = operator(arguments.operator.as_ref());
    record.add_note(RunId(arguments.run), &author, &arguments.text.join(" "))?;
    print_line!("noted with run {}", arguments.run)?;
    Ok(ExitCode::SUCCESS)
}
