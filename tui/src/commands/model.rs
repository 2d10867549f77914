//! `plumb model`: compare a model with measurements, see what it lacks, add it, watch the error fall.

pub(crate) mod arguments;
mod board;
mod compare;
pub(crate) mod diagnose;
mod effects;
mod export;
mod history;
pub(crate) mod next;
mod profile;
mod report;
mod revise;
mod screen;
mod template;
pub(crate) mod text;

use std::io::{self, Write as _};
use std::path::Path;
use std::process::ExitCode;

use clap::Subcommand;
use serde::Serialize;

use crate::failure::CommandResult;
use arguments::{
    AcceptArguments, AddArguments, ChangeArguments, CompareArguments, DiagnoseArguments, EffectsArguments,
    ExportArguments, FamilyArguments, GrowArguments, NextArguments, ReportArguments, ScreenArguments,
    TemplateArguments,
};

/// What to do with a model.
#[derive(Debug, Subcommand)]
pub(crate) enum ModelCommand {
    /// Fit the model and show how far it misses, where, and how far above the noise.
    Compare(CompareArguments),
    /// Say which effect the model lacks, if any.
    Diagnose(DiagnoseArguments),
    /// Add an effect (`joint_compliance(shoulder)`, `joint_zero(*)`, `geometry(*)`): writes the next revision of the model file.
    Add(AddArguments),
    /// Take an effect out: writes the next revision.
    Remove(ChangeArguments),
    /// Take over what the table says of everything that is free, and add nothing: writes the next revision, by which a cell then commands.
    Accept(AcceptArguments),
    /// Diagnose and add until nothing more can be named; shows the error fall.
    Grow(GrowArguments),
    /// List the revisions of a model file.
    History(FamilyArguments),
    /// Take the last change back: what was before it becomes the next revision.
    Undo(FamilyArguments),
    /// Poses to measure next: where the effects in question differ most, within limits and clear of what is kept out.
    Next(NextArguments),
    /// List the physical effects that a model can be given, or describe one: what to measure to see it, its parameters and their units.
    Effects(EffectsArguments),
    /// Write an empty model file and an empty table for a robot, to fill in.
    Template(TemplateArguments),
    /// Write all of it as one page that needs no other file: the story, the plots, the candidates, the fall of the error.
    Report(ReportArguments),
    /// Write the calibrated arm for other programs: a URDF, the calibration of a UR's ROS driver, or a table of Denavit-Hartenberg rows.
    Export(ExportArguments),
    /// Turn corners of a board in pictures, as any program found them, into the poses of the board that a camera on the hand sees; prints the table.
    Board(board::BoardArguments),
    /// Thin profiles of a laser line sensor out, point by point as it exports them, to a few points a row; prints the table.
    Profile(profile::ProfileArguments),
    /// Look at all this on the screen, with a preview of every candidate before it is added.
    Screen(ScreenArguments),
}

/// Runs one of the commands.
pub(crate) fn run(command: &ModelCommand) -> CommandResult {
    let printed = match command {
        ModelCommand::Screen(arguments) => return screen::run(arguments),
        ModelCommand::Compare(arguments) => compare::run(arguments)?,
        ModelCommand::Diagnose(arguments) => diagnose::run(arguments)?,
        ModelCommand::Add(arguments) => revise::add(arguments)?,
        ModelCommand::Remove(arguments) => revise::remove(arguments)?,
        ModelCommand::Accept(arguments) => revise::accept(arguments)?,
        ModelCommand::Grow(arguments) => revise::grow(arguments)?,
        ModelCommand::Next(arguments) => next::run(arguments)?,
        ModelCommand::Effects(arguments) => effects::run(arguments)?,
        ModelCommand::Export(arguments) => export::run(arguments)?,
        ModelCommand::Board(arguments) => board::run(arguments)?,
        ModelCommand::Profile(arguments) => profile::run(arguments)?,
        ModelCommand::Template(arguments) => template::run(arguments)?,
        ModelCommand::Report(arguments) => report::run(arguments)?,
        ModelCommand::History(arguments) => history::list(arguments)?,
        ModelCommand::Undo(arguments) => history::undo(arguments)?,
    };
    let mut out = io::stdout().lock();
    out.write_all(printed.as_bytes())?;
    out.flush()?;
    Ok(ExitCode::SUCCESS)
}

/// What to say of a file that could not be written.
fn not_written(path: &Path, error: &io::Error) -> String {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty() && !folder.is_dir());
    match (error.kind(), folder) {
        (io::ErrorKind::NotFound, Some(folder)) => {
            format!("{}: there is no folder {} to write to", path.display(), folder.display())
        }
        (io::ErrorKind::AlreadyExists, _) => {
            format!("{}: there is such a file already; name another folder with -o", path.display())
        }
        _ => format!("{}: {error}", path.display()),
    }
}

/// A value as indented JSON with a line end.
fn json(value: &impl Serialize) -> Result<String, serde_json::Error> {
    serde_json::to_string_pretty(value).map(|text| text + "\n")
}
