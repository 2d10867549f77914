//! Why there is no benchmark.

use std::io;
use std::path::PathBuf;

use plumb::commands::trial::TrialError;
use plumb_diagnosis::laboratory::LaboratoryError;
use plumb_simulated::physics::campaign::GenerateError;

/// Why there is no benchmark.
#[derive(Debug, thiserror::Error)]
pub(crate) enum BenchmarkError {
    /// The campaign that the options describe.
    #[error(transparent)]
    Trial(#[from] TrialError),
    /// A case cannot be simulated.
    #[error(transparent)]
    Generate(#[from] GenerateError),
    /// The diagnosis refuses a case that it should take.
    #[error("the diagnosis refuses the case of seed {seed}: {source}")]
    Lab {
        /// The case.
        seed: u64,
        /// Why.
        source: Box<LaboratoryError>,
    },
    /// `--cell` names none.
    #[error("there is no cell `{name}`; known are {known}")]
    UnknownCell {
        /// What was asked.
        name: String,
        /// What there is.
        known: String,
    },
    /// Standard output is gone.
    #[error("cannot write to standard output")]
    Output(#[source] io::Error),
    /// A real table of `--halves` is not named as it should be.
    #[error("--set {0}: write MODEL:TABLE")]
    Set(String),
    /// A real table of `--halves` cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// The diagnosis refuses half of a table.
    #[error("{}: half of it cannot be diagnosed: {source}", path.display())]
    Table {
        /// The table.
        path: PathBuf,
        /// Why.
        source: Box<LaboratoryError>,
    },
    /// The picture cannot be drawn.
    #[error("cannot draw the diagram: {0}")]
    Picture(String),
    /// The figures cannot be written.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
}
