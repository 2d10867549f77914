//! `plumb check`: everything that can be known about a file before anything is connected.

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use plumb_cell::device::check_plugins;
use plumb_cell::expression::Calculator;
use plumb_cell::workcell::load_workcell;
use plumb_cell::yaml::FileProblems;
use plumb_cell::{FileKind, check_file, kind_of_file};
use plumb_model::table::Table;

use crate::failure::CommandResult;
use crate::run_command::prepare::plugins_of;
use crate::study_command;

/// Check cell, procedure, answers, model, world and study files, tables of measurements (CSV), and everything they name. Nothing is connected and
/// nothing moves.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// The files.
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Look for plugins here too.
    #[arg(long, value_name = "DIR")]
    plugins: Vec<PathBuf>,
}

/// Prints every mistake of every file; exit code 2 when there are any.
pub(crate) fn run(arguments: &Arguments) -> CommandResult {
    let calculator = Calculator::new();
    let mut all_good = true;
    for file in &arguments.files {
        match check(file, arguments, &calculator) {
            Ok((what, notes)) => {
                let mut out = std::io::stdout();
                writeln!(out, "{}: {what} is in order", file.display())?;
                notes.iter().try_for_each(|note| writeln!(out, "  {note}"))?;
            }
            Err(problems) => {
                all_good = false;
                eprintln!("{problems}");
            }
        }
    }
    Ok(if all_good { ExitCode::SUCCESS } else { ExitCode::from(2) })
}

/// What a file is, with notes; or its mistakes as text.
fn check(
    file: &Path,
    arguments: &Arguments,
    calculator: &Calculator,
) -> Result<(String, Vec<String>), String> {
    if file.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("csv")) {
        let table = Table::read(file).map_err(|error| error.to_string())?;
        return Ok((format!("table of {} rows", table.len()), Vec::new()));
    }
    let kind = kind_of_file(file).map_err(|problems| problems.to_string())?;
    if kind == FileKind::World {
        plumb_simulated::world_file::read(file).map_err(|error| error.to_string())?;
    }
    if kind == FileKind::Study {
        study_command::check(file).map_err(|error| error.to_string())?;
    }
    let checked = check_file(file, kind, calculator).map_err(|problems| in_words(&problems))?;
    if kind == FileKind::Workcell {
        let workcell = load_workcell(file, calculator).map_err(|problems| in_words(&problems))?;
        check_plugins(&workcell, &plugins_of(&workcell, &arguments.plugins))
            .map_err(|problems| problems.to_string())?;
        if let Some(world) = &workcell.world {
            plumb_simulated::world_file::read(&world.file).map_err(|error| error.to_string())?;
        }
    }
    Ok((checked.what, checked.notes))
}

fn in_words(problems: &[FileProblems]) -> String {
    problems.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")
}
