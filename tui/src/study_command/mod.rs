//! `plumb study`: the paper's own analysis, and what many runs through the real engine show of the method.

mod bench;
mod curves;
mod design;
mod figure;
mod imperfect;
mod paper;
mod repeatability;
mod runs;
mod statistics;
mod study_file;
mod table;
mod truth;

use std::io;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, Subcommand};
use thiserror::Error;

use crate::failure::CommandResult;
use crate::run_command::simulated_world::WorldError;
use study_file::StudyFileError;

/// Table 2-1, figures and single numbers of Yang & Siegel 1987, computed anew; or, with a word more, many runs through the real engine.
#[derive(Args)]
pub(crate) struct StudyArguments {
    #[command(subcommand)]
    study: Option<Study>,
    /// Write each figure there as SVG and CSV.
    #[arg(short, long, value_name = "DIR", global = true)]
    output: Option<PathBuf>,
}

/// What is studied.
#[derive(Subcommand)]
enum Study {
    Repeatability(repeatability::Arguments),
    /// What each imperfection of arm and sensor costs, alone: 100 random starts each.
    Imperfections(Chosen),
    /// The paper's method and its rivals, with the arm's lengths known rightly and wrongly: error, time, steps.
    Methods(Chosen),
    /// The reviewer's doubts, a figure each.
    Doubts(Chosen),
    /// Where to put the target, how high to let the sensor fire and how far to turn back, for any arm with the paper's joints (section 4.3): the best values, how
    /// far each may be from there, and the paper's figures for this arm.
    Design(design::Arguments),
}

/// A study that is described in a file.
#[derive(Args)]
struct Chosen {
    /// The study's file; that of the TeachMover if left out.
    file: Option<PathBuf>,
    #[command(flatten)]
    many: Many,
}

/// How many runs, and drawn from where.
#[derive(Args)]
struct Many {
    /// How many runs each line of the table rests on; as the study's file says if left out.
    #[arg(short = 'n', long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=100_000))]
    runs: Option<u32>,
    /// Draw the starts and everything left to chance from here on.
    #[arg(long, value_name = "S", default_value_t = 1)]
    seed: u64,
    /// Look for plugins here too.
    #[arg(long, value_name = "DIR")]
    plugins: Vec<PathBuf>,
}

/// Why there is no study.
#[derive(Debug, Error)]
pub(crate) enum StudyError {
    /// A file could not be written.
    #[error("cannot write {path}: {cause}; name a folder you may write to with --output")]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system said.
        cause: io::Error,
    },
    /// A figure could not be drawn.
    #[error("cannot draw {figure}: {cause}")]
    Draw {
        /// The figure.
        figure: String,
        /// What the drawing library said.
        cause: String,
    },
    /// An arm for which the method cannot be designed.
    #[error("{0}")]
    Arm(String),
    /// The output, or a file in passing.
    #[error("it cannot be written or read: {0}")]
    Output(#[from] io::Error),
    /// The study's file.
    #[error(transparent)]
    File(#[from] StudyFileError),
    /// The cell is not in order.
    #[error("{0}")]
    Cell(String),
    /// The world does not start.
    #[error(transparent)]
    World(#[from] WorldError),
    /// The world does not answer, or tells nothing.
    #[error("the simulated world: {0}")]
    Truth(#[from] plumb_simulated::client::ClientError),
    /// A run does not start.
    #[error(transparent)]
    Start(#[from] plumb_cell::engine::StartError),
    /// The record.
    #[error(transparent)]
    Record(#[from] plumb_record::RecordError),
    /// The cell's place in shared memory.
    #[error(transparent)]
    Domain(#[from] plumb_bus::DomainError),
    /// The keyboard.
    #[error("interrupted")]
    Interrupted,
}

/// Reads a study's file as far as can be known without running it.
///
/// # Errors
/// Its first mistake.
pub(crate) fn check(file: &std::path::Path) -> Result<(), StudyError> {
    let name = file.file_stem().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
    study_file::StudyFile::read(file, &name)?;
    Ok(())
}

/// Makes the study.
///
/// # Errors
/// [`StudyError`]
pub(crate) fn run(arguments: &StudyArguments) -> CommandResult {
    let folder = arguments.output.as_deref();
    let made = match &arguments.study {
        None => paper::run(folder),
        Some(Study::Repeatability(study)) => repeatability::run(study, folder),
        Some(Study::Imperfections(chosen)) => imperfect::run("imperfections", chosen, folder),
        Some(Study::Methods(chosen)) => imperfect::run("methods", chosen, folder),
        Some(Study::Design(design)) => design::run(design, folder),
        Some(Study::Doubts(chosen)) => imperfect::run("doubts", chosen, folder),
    };
    match made {
        Ok(()) => Ok(ExitCode::SUCCESS),
        Err(StudyError::Interrupted) => {
            eprintln!("plumb: interrupted; what was running has been put away");
            Ok(ExitCode::from(plumb_cell::event::RunOutcome::Aborted.exit_code()))
        }
        Err(error) => Err(error.into()),
    }
}
