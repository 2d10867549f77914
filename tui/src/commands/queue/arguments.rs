//! What `plumb queue` takes.

use std::path::PathBuf;

use clap::Subcommand;
use plumb_record::QueuePosition;

use crate::commands::run::{PaceArgument, parameter};

/// What to do with the queue.
#[derive(Subcommand)]
pub(crate) enum QueueCommand {
    /// Put a run at the end of its cell's queue. Everything it needs is read and planned first: what could not run unattended is refused.
    Add(Add),
    /// Show what waits, and what is in the way.
    List(List),
    /// Move an entry that waits.
    Move(Move),
    /// Take entries off. A run that was begun stays in the record as it is.
    Remove(Remove),
    /// Carry out the queue of a cell, one run after the other, until it is empty or a run does not pass. A run that was killed, or kept for later, is gone on
    /// with first. The exit code is that of the run that did not pass.
    Run(Run),
}

/// Where the record lies.
#[derive(clap::Args)]
pub(super) struct RecordDirectory {
    /// Where the record lies [default: `plumb` in $XDG_STATE_HOME, which is ~/.local/state where that is not set].
    #[arg(long, value_name = "DIR")]
    pub(super) record: Option<PathBuf>,
}

/// What is to be run.
#[derive(clap::Args)]
pub(crate) struct Add {
    /// The cell file.
    pub(super) cell: PathBuf,
    /// Which of the cell's procedures, by name or file; the first if left out.
    pub(super) procedure: Option<String>,
    /// Set a parameter of the procedure; can be given several times.
    #[arg(long, value_name = "NAME=VALUE", value_parser = parameter)]
    pub(super) set: Vec<(String, f64)>,
    /// The file of answers; the cell's own if left out.
    #[arg(long, value_name = "FILE")]
    pub(super) answers: Option<PathBuf>,
    /// Before all others that wait.
    #[arg(long)]
    pub(super) first: bool,
    /// Who puts it there, for the record; your login name if left out.
    #[arg(long, value_name = "NAME")]
    pub(super) operator: Option<String>,
    /// Look for plugins here too.
    #[arg(long, value_name = "DIR")]
    pub(super) plugins: Vec<PathBuf>,
    #[command(flatten)]
    pub(super) directory: RecordDirectory,
}

/// Which queue.
#[derive(clap::Args)]
pub(crate) struct List {
    /// The cell file; all queues if left out.
    pub(super) cell: Option<PathBuf>,
    /// A line of JSON for each entry.
    #[arg(long)]
    pub(super) json: bool,
    #[command(flatten)]
    pub(super) directory: RecordDirectory,
}

/// Which entry, and where to.
#[derive(clap::Args)]
#[command(group = clap::ArgGroup::new("to").required(true))]
pub(crate) struct Move {
    /// Its number, as `plumb queue list` gives it.
    pub(super) entry: i64,
    /// Before all others that wait.
    #[arg(long, group = "to")]
    first: bool,
    /// After all others.
    #[arg(long, group = "to")]
    last: bool,
    /// Before the entry of this number.
    #[arg(long, value_name = "ENTRY", group = "to")]
    before: Option<i64>,
    /// After the entry of this number.
    #[arg(long, value_name = "ENTRY", group = "to")]
    after: Option<i64>,
    #[command(flatten)]
    pub(super) directory: RecordDirectory,
}

impl Move {
    pub(super) fn to(&self) -> QueuePosition {
        match (self.first, self.before, self.after) {
            (true, ..) => QueuePosition::First,
            (_, Some(entry), _) => QueuePosition::Before(entry),
            (_, _, Some(entry)) => QueuePosition::After(entry),
            _ => QueuePosition::Last,
        }
    }
}

/// Which entries.
#[derive(clap::Args)]
pub(crate) struct Remove {
    /// Their numbers, as `plumb queue list` gives them.
    pub(super) entries: Vec<i64>,
    #[command(flatten)]
    pub(super) directory: RecordDirectory,
}

/// Which queue, and how.
#[derive(clap::Args)]
pub(crate) struct Run {
    /// The cell file.
    pub(super) cell: PathBuf,
    /// Go on with the next entry where a check did not hold. After an error, an abort, or a question that nobody answers, the queue stops in any case.
    #[arg(long)]
    pub(super) past_failed: bool,
    /// When the queue is empty, wait for more.
    #[arg(long)]
    pub(super) wait: bool,
    /// Print every event of the runs as a line of JSON.
    #[arg(long)]
    pub(super) json: bool,
    /// How the time of a simulated cell goes; fast if left out.
    #[arg(long, value_enum)]
    pub(super) pace: Option<PaceArgument>,
    /// Who runs it, for the record; your login name if left out.
    #[arg(long, value_name = "NAME")]
    pub(super) operator: Option<String>,
    /// Look for plugins here too.
    #[arg(long, value_name = "DIR")]
    pub(super) plugins: Vec<PathBuf>,
    /// Run plugins whose files have changed since this cell ran with them last.
    #[arg(long)]
    pub(super) accept_plugins: bool,
    #[command(flatten)]
    pub(super) directory: RecordDirectory,
}
