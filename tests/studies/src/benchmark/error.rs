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
    /// The figures cannot be written.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
}
