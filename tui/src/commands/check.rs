//! `plumb check`: everything that can be known about a file before anything is connected.

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use plumb_calibration::table::Table;
use plumb_cell::expression::Calculator;
use plumb_cell::workcell::load_workcell;
use plumb_cell::{cells_that_name, check_file, kind_of_file};
use plumb_diagnosis::stripe::read_scene;
use plumb_document::{DocumentKind, FileProblems};
use plumb_light_stripe::geometry::read_rig;
use plumb_plugin::Manifest;
use plumb_simulated::world_file::{self, WorldFileError};

use crate::commands::cell_check::check_with_world;
use crate::commands::run::prepare::plugins_of;
use crate::commands::study;
use crate::failure::CommandResult;

/// Check cell, procedure, answers, model, world, rig, scene, manifest and study files, tables of measurements (CSV), and everything they name. Nothing is connected and
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
    read_whole(file, kind)?;
    let mut wrong = Vec::new();
    let checked = check_file(file, kind, calculator).map_err(|problems| wrong.extend(problems)).ok();
    // What a cell is made of is looked at whatever is wrong with its answers.
    if kind == DocumentKind::Cell
        && let Ok(workcell) = load_workcell(file, calculator)
    {
        let plugins = plugins_of(&workcell, &arguments.plugins);
        wrong.extend(check_with_world(&workcell, &plugins).err().into_iter().flatten());
        if let Some(world) = workcell.world.as_ref().filter(|_| wrong.is_empty()) {
            read_whole(&world.file, DocumentKind::World)?;
        }
    }
    let Some(checked) = checked.filter(|_| wrong.is_empty()) else { return Err(in_words(&wrong)) };
    if kind == DocumentKind::Procedure {
        check_readings(file, arguments, calculator).map_err(|problems| in_words(&problems))?;
    }
    Ok((checked.what, checked.notes))
}

/// What a procedure names of readings, held against the manifests of the plugins of the cells beside it that name it.
fn check_readings(
    file: &Path,
    arguments: &Arguments,
    calculator: &Calculator,
) -> Result<(), Vec<FileProblems>> {
    let is_this = |other: &Path| matches!((other.canonicalize(), file.canonicalize()), (Ok(one), Ok(two)) if one == two);
    for cell in cells_that_name(file) {
        // A cell with mistakes of its own is named among the notes.
        let Ok(workcell) = load_workcell(&cell, calculator) else { continue };
        let plugins = plugins_of(&workcell, &arguments.plugins);
        let wrong = check_with_world(&workcell, &plugins).err().into_iter().flatten();
        let about_this: Vec<FileProblems> = wrong.filter(|problems| is_this(&problems.file)).collect();
        if !about_this.is_empty() {
            return Err(about_this);
        }
    }
    Ok(())
}

/// Reads a file of a kind that names no others.
fn read_whole(file: &Path, kind: DocumentKind) -> Result<(), String> {
    let in_words = |error: &dyn std::fmt::Display| error.to_string();
    match kind {
        DocumentKind::World => world_file::read(file).map(drop).map_err(|error| world_mistakes(file, error)),
        DocumentKind::Study => study::check(file).map_err(|error| in_words(&error)),
        DocumentKind::Rig => read_rig(file).map(drop).map_err(|error| in_words(&error)),
        DocumentKind::Scene => read_scene(file).map(drop).map_err(|error| in_words(&error)),
        DocumentKind::Manifest => Manifest::read(file).map(drop).map_err(|error| in_words(&error)),
        DocumentKind::Cell | DocumentKind::Procedure | DocumentKind::Answers | DocumentKind::Model => Ok(()),
    }
}

/// All mistakes of a world file, or why it cannot be read.
fn world_mistakes(file: &Path, error: WorldFileError) -> String {
    match error {
        WorldFileError::Wrong(problems) => problems.to_string(),
        other => FileProblems::whole_file(file, other.to_string(), "").to_string(),
    }
}

fn in_words(problems: &[FileProblems]) -> String {
    problems.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")
}
