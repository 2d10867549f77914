//! `plumb study`: the initialization of Yang & Siegel for an arm of the user's own.

mod design;
mod read_study;
pub mod study_file;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, Subcommand};

use crate::failure::CommandResult;
pub(crate) use read_study::study_schema;
use study_file::{StudyFile, StudyFileError};

/// Design the initialization of Yang & Siegel 1987 for an arm.
#[derive(Args)]
pub(crate) struct StudyArguments {
    #[command(subcommand)]
    study: Study,
    /// Write each figure there as SVG and CSV.
    #[arg(short, long, value_name = "DIR", global = true)]
    output: Option<PathBuf>,
}

/// What is studied.
#[derive(Subcommand)]
enum Study {
    /// Where to put the target, how high to let the sensor fire and how far to turn back, for any arm with the paper's joints (section 4.3): the best values, how
    /// far each may be from there, and the paper's figures for this arm.
    Design(design::Arguments),
}

/// Reads a study's file as far as can be known without running it.
///
/// # Errors
/// Its first mistake.
pub(crate) fn check(file: &std::path::Path) -> Result<(), StudyFileError> {
    let name = file.file_stem().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
    StudyFile::read(file, &name).map(drop)
}

/// Makes the study.
///
/// # Errors
/// The arm is not one the method is for, or the figures cannot be written.
pub(crate) fn run(arguments: &StudyArguments) -> CommandResult {
    let Study::Design(design) = &arguments.study;
    design::run(design, arguments.output.as_deref())?;
    Ok(ExitCode::SUCCESS)
}
