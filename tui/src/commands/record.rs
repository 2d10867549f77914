//! `plumb record`: looking after the record itself.

mod corrections;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Subcommand;
use clap_complete::ArgValueCandidates;
use plumb_document::counted;
use plumb_record::Record;

use crate::completion;
use crate::failure::CommandResult;
use crate::print_line::print_line;
use crate::record_directory::record_directory;
pub(crate) use corrections::roll_back;

/// What to do with the record.
#[derive(Subcommand)]
pub(crate) enum RecordCommand {
    /// Copy the record into a new file, whole although runs go on meanwhile. To go back to it, put it in place of `plumb.sqlite3`.
    Backup(Backup),
    /// Check that the record is sound.
    Check(Check),
    /// List the corrections of a cell: revision by revision, and what is in force now.
    Zeros(Zeros),
    /// Bring back the corrections as they were at an earlier revision. A new revision puts them in force; nothing is overwritten.
    Rollback(Rollback),
}

/// Of which cell.
#[derive(clap::Args)]
pub(crate) struct Zeros {
    /// The cell's name, as `plumb history` shows it.
    #[arg(add = ArgValueCandidates::new(completion::recorded_cells))]
    cell: String,
    /// As JSON, one revision a line.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    directory: RecordDirectory,
}

/// To which revision.
#[derive(clap::Args)]
pub(crate) struct Rollback {
    /// The cell's name, as `plumb history` shows it.
    #[arg(add = ArgValueCandidates::new(completion::recorded_cells))]
    cell: String,
    /// The revision that is to be in force again, as `plumb record zeros` numbers them; 0 for what was before the first.
    revision: i64,
    /// Which device, where the cell has several and the revision is 0.
    #[arg(long, value_name = "NAME")]
    device: Option<String>,
    #[command(flatten)]
    directory: RecordDirectory,
}

/// Where to.
#[derive(clap::Args)]
pub(crate) struct Backup {
    /// The new file.
    to: PathBuf,
    #[command(flatten)]
    directory: RecordDirectory,
}

/// Which.
#[derive(clap::Args)]
pub(crate) struct Check {
    #[command(flatten)]
    directory: RecordDirectory,
}

/// Where the record lies.
#[derive(clap::Args)]
struct RecordDirectory {
    /// Where the record lies [default: `plumb` in $XDG_STATE_HOME, which is ~/.local/state where that is not set].
    #[arg(long, value_name = "DIR")]
    record: Option<PathBuf>,
}

/// Exit code of a record that is damaged.
const DAMAGED: u8 = 1;

/// Does it.
pub(crate) fn run(command: &RecordCommand) -> CommandResult {
    let given = match command {
        RecordCommand::Backup(backup) => &backup.directory,
        RecordCommand::Check(check) => &check.directory,
        RecordCommand::Zeros(zeros) => &zeros.directory,
        RecordCommand::Rollback(rollback) => &rollback.directory,
    };
    let directory = record_directory(given.record.as_ref())?;
    let mut record = match Record::open(&directory) {
        // So damaged that it cannot even be opened: what a check is there to say.
        Err(error) if error.is_damage() && matches!(command, RecordCommand::Check(_)) => {
            print_line!("{error}")?;
            return Ok(ExitCode::from(DAMAGED));
        }
        opened => opened?,
    };
    match command {
        RecordCommand::Zeros(zeros) => corrections::list(&record, zeros),
        RecordCommand::Rollback(rollback) => corrections::bring_back(&mut record, rollback),
        RecordCommand::Backup(backup) => {
            record.back_up(&backup.to)?;
            let size = std::fs::metadata(&backup.to)?.len();
            print_line!(
                "{}: {}, {} kB",
                backup.to.display(),
                counted(record.number_of_runs()?, "run", "runs"),
                size.div_ceil(1000)
            )?;
            Ok(ExitCode::SUCCESS)
        }
        RecordCommand::Check(_) => {
            let damage = record.damage()?;
            if damage.is_empty() {
                let runs = counted(record.number_of_runs()?, "run", "runs");
                print_line!("{}: sound; {runs}", directory.display())?;
                return Ok(ExitCode::SUCCESS);
            }
            for line in &damage {
                print_line!("{line}")?;
            }
            Ok(ExitCode::from(DAMAGED))
        }
    }
}
