//! `plumb man`: the manual pages, from the same table as the help.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use crate::failure::CommandResult;
use crate::print_line::print_line;

/// Write manual pages, one for each command. A package installs them already.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// The folder to write them to; made if need be.
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
}

/// A page that cannot be written.
#[derive(Debug, thiserror::Error)]
#[error("the manual pages cannot be written to {}: {source}", folder.display())]
struct ManError {
    folder: PathBuf,
    source: io::Error,
}

/// Writes them for the whole command line, and says how many.
pub(crate) fn run(arguments: &Arguments, command: clap::Command) -> CommandResult {
    let written = write(&arguments.output, command)
        .map_err(|source| ManError { folder: arguments.output.clone(), source })?;
    print_line!("{written} pages in {}", arguments.output.display())?;
    Ok(ExitCode::SUCCESS)
}

fn write(folder: &Path, command: clap::Command) -> io::Result<usize> {
    fs::create_dir_all(folder)?;
    // The page of `help` repeats the others.
    let mut command = command.disable_help_subcommand(true);
    command.build();
    let mut count = 0;
    write_pages(&command, folder, &mut count)?;
    Ok(count)
}

fn write_pages(command: &clap::Command, folder: &Path, count: &mut usize) -> io::Result<()> {
    for one in command.get_subcommands().filter(|one| !one.is_hide_set()) {
        write_pages(one, folder, count)?;
    }
    let page = clap_mangen::Man::new(command.clone()).manual("plumb");
    page.generate_to(folder)?;
    *count += 1;
    Ok(())
}
