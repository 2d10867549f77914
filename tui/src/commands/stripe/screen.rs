//! `plumb stripe screen`

use std::process::ExitCode;

use super::lab::Chosen;
use crate::failure::CommandResult;
use crate::screens;

/// Options of `screen`.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    #[command(flatten)]
    chosen: Chosen,
}

/// Shows the screen until the operator leaves.
pub(super) fn run(arguments: &Arguments) -> CommandResult {
    let lab = arguments.chosen.open()?;
    let (cell, scans) = (arguments.chosen.cell.display(), arguments.chosen.scans.display());
    let files =
        format!("{cell}, {scans} ({} scans, {} stripes)", lab.scans.names.len(), lab.scans.views.len());
    screens::explore_stripes(lab, &files)?;
    Ok(ExitCode::SUCCESS)
}
