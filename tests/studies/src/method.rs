//! Yang & Siegel's initialization: the paper's own analysis, and what many runs through the real engine show of the method.

mod bench;
pub(crate) mod imperfect;
pub(crate) mod paper;
mod paper_curves;
pub(crate) mod repeatability;
mod runs;
mod statistics;
mod table;
mod truth;

use std::io;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use plumb::commands::run::simulated_world::WorldError;
use plumb::commands::study::study_file::StudyFileError;
use plumb::failure::CommandResult;
use plumb_report::figure::FigureError;
use thiserror::Error;

/// A study that is described in a file.
#[derive(Args)]
pub(crate) struct Chosen {
    /// The study's file; that of the TeachMover if left out.
    file: Option<PathBuf>,
    #[command(flatten)]
    many: Many,
}

/// How many runs, and drawn from where.
#[derive(Args)]
pub(crate) struct Many {
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
    /// A figure.
    #[error(transparent)]
    Figure(#[from] FigureError),
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
    /// The world does not answer, or says nothing.
    #[error("the simulated world: {0}")]
    Truth(#[from] plumb_simulated::client::ClientError),
    /// A run does not start.
    #[error(transparent)]
    Start(#[from] plumb_cell::engine::StartError),
    /// The record.
    #[error(transparent)]
    Record(#[from] plumb_record::RecordError),
    /// The cell's area in shared memory.
    #[error(transparent)]
    Domain(#[from] plumb_bus::DomainError),
    /// The keyboard.
    #[error("interrupted")]
    Interrupted,
}

/// The exit code of a study; an interrupt is none of its errors.
///
/// # Errors
/// [`StudyError`], but for the interrupt.
pub(crate) fn ended(study: Result<(), StudyError>) -> CommandResult {
    match study {
        Ok(()) => Ok(ExitCode::SUCCESS),
        Err(StudyError::Interrupted) => {
            eprintln!("plumb-studies: interrupted; every process it had started has been ended");
            Ok(ExitCode::from(plumb_cell::event::RunOutcome::Aborted.exit_code()))
        }
        Err(error) => Err(error.into()),
    }
}
