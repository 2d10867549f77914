//! `plumb completions`: what a shell needs to complete commands, options and names.

use std::io;
use std::process::ExitCode;

use clap::builder::PossibleValuesParser;

use crate::completion::{shells, write_script};
use crate::failure::CommandResult;

/// Print what a shell reads to complete commands, options, files and the names of effects and cells. A package installs it already.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// For which shell.
    #[arg(value_parser = PossibleValuesParser::new(shells()))]
    shell: String,
}

/// Prints it.
pub(crate) fn run(arguments: &Arguments) -> CommandResult {
    write_script(&arguments.shell, &mut io::stdout().lock())?;
    Ok(ExitCode::SUCCESS)
}
