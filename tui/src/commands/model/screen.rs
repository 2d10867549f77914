//! `plumb model screen`: the lab on the Model screen.

use std::process::ExitCode;

use thiserror::Error;

use super::arguments::ScreenArguments;
use crate::failure::CommandResult;
use crate::screens;

/// Why the screen does not open.
#[derive(Debug, Error)]
enum ScreenError {
    /// A screen prints nothing.
    #[error("a screen prints no JSON; `plumb model diagnose --json` does")]
    Json,
}

/// Shows the screen until the operator leaves.
pub(super) fn run(arguments: &ScreenArguments) -> CommandResult {
    if arguments.pair.json {
        return Err(ScreenError::Json.into());
    }
    screens::explore(arguments.pair.open()?, arguments.pair.data_name())?;
    Ok(ExitCode::SUCCESS)
}
