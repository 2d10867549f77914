//! `plumb report`: figures after standards, from measurement tables.

mod arguments;
mod iso230;
mod iso9283;
mod page;
mod words;

use std::io::{self, Write as _};
use std::process::ExitCode;

use clap::Subcommand;

use crate::failure::CommandResult;
use arguments::{Iso230Arguments, Iso9283Arguments};

/// Which standard.
#[derive(Debug, Subcommand)]
pub(crate) enum ReportCommand {
    /// Accuracy, repeatability and reversal error of an axis after ISO 230-2:2014: A, E, M, R, B of targets that were approached several times from each
    /// side (columns `approach_q1` and, if returns have ids, `repeat`).
    Iso230(Iso230Arguments),
    /// Pose accuracy AP, repeatability RP, variation with the way of approach vAP and drift of a robot after ISO 9283:1998, from returns to poses (column
    /// `repeat`).
    Iso9283(Iso9283Arguments),
}

/// Runs one of the commands.
pub(crate) fn run(command: &ReportCommand) -> CommandResult {
    let text = match command {
        ReportCommand::Iso230(arguments) => iso230::run(arguments)?,
        ReportCommand::Iso9283(arguments) => iso9283::run(arguments)?,
    };
    let mut out = io::stdout().lock();
    out.write_all(text.as_bytes())?;
    out.flush()?;
    Ok(ExitCode::SUCCESS)
}
