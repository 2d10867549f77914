//! What `plumb trial rehearse` takes.

use std::path::PathBuf;

/// Options of `plumb trial rehearse`.
#[derive(Debug, clap::Args)]
pub(crate) struct RehearsalArguments {
    /// Which cell: `teachmover`, `puma` or `light-stripe`.
    #[arg(long, value_name = "CELL")]
    pub(super) cell: String,
    /// What to hide, such as `backlash` or `backlash(elbow)`; everything the cell can have, one after the other, when not given.
    #[arg(long, value_name = "FAULT")]
    pub(super) fault: Vec<String>,
    /// The first trial's seed.
    #[arg(long, value_name = "S", default_value_t = 1)]
    pub(super) seed: u64,
    /// How many seeds of each.
    #[arg(short = 'n', long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..=1000))]
    pub(super) seeds: u64,
    /// Print JSON, an object a trial.
    #[arg(long)]
    pub(super) json: bool,
    /// Keep the trials' directories there.
    #[arg(short, long, value_name = "DIR")]
    pub(super) output: Option<PathBuf>,
}
