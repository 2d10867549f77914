//! `plumb stripe next`

use std::io::{self, Write as _};
use std::process::ExitCode;

use plumb_diagnosis::Requested;
use plumb_report::json::next_poses;

use super::lab::Chosen;
use super::lab_error::LabError;
use crate::commands::model::next::{as_table, describe};
use crate::failure::CommandResult;
use crate::progress::watched;

/// Options of `next`.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    #[command(flatten)]
    chosen: Chosen,
    /// How many pictures; two returns come on top.
    #[arg(short = 'n', long, default_value_t = 8, value_parser = clap::value_parser!(u16).range(1..=50))]
    number: u16,
    /// Print JSON.
    #[arg(long)]
    json: bool,
    /// Print the poses as a table (CSV) that a procedure goes through with `repeat: {over: FILE}`.
    #[arg(long, conflicts_with = "json")]
    csv: bool,
}

/// Chooses where pictures would show most, and prints the arm's poses there.
pub(super) fn run(arguments: &Arguments) -> CommandResult {
    let lab = arguments.chosen.open()?;
    let laboratory = watched(|progress| lab.adjusted(progress))
        .and_then(|adjusted| Ok(adjusted.laboratory()?))
        .map_err(LabError::from)?;
    let requested =
        Requested { count: usize::from(arguments.number), keep_out: Vec::new(), payloads: Vec::new() };
    let poses = watched(|progress| laboratory.next_poses(&requested, progress))?;
    let joints = lab.model.chain.joints.iter().map(|joint| joint.name.as_str());
    let text = match (arguments.json, arguments.csv) {
        (true, _) => serde_json::to_string_pretty(&next_poses(&poses)?)? + "\n",
        (_, true) => as_table(&poses, laboratory.table(), laboratory.model()),
        _ => describe(&poses, &joints.collect::<Vec<_>>()),
    };
    io::stdout().lock().write_all(text.as_bytes())?;
    Ok(ExitCode::SUCCESS)
}
