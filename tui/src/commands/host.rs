//! `plumb host`: the process around one plugin. Started by plumb itself, never by hand.

use std::process::ExitCode;

use crate::failure::CommandResult;

/// What a host is started with: for who lists processes. What it is to do comes from the program that started it.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// `DEVICE of CELL`.
    #[arg(hide = true)]
    _names: Vec<String>,
}

/// Serves the device whose description comes from the program that started this one.
pub(crate) fn run() -> CommandResult {
    let code: ExitCode = plumb_host::serve(plumb_cell::workcell::guard);
    Ok(code)
}
