//! Why a trial command failed.

use std::io;
use std::path::PathBuf;

use plumb_simulated::physics::campaign::GenerateError;
use plumb_simulated::physics::campaign::seal::OpenError;
use plumb_simulated::physics::description::DescriptionError;
use thiserror::Error;

use super::effect_request::EffectRequestError;
use super::injection::InjectionError;

/// Why a trial command failed.
#[derive(Debug, Error)]
pub enum TrialError {
    /// `--arm` is neither a known arm nor a readable file.
    #[error("there is no arm `{name}`: known are {known}; or give the path of a model file")]
    UnknownArm {
        /// What was asked.
        name: String,
        /// What there is.
        known: String,
    },
    /// The arm's file is bad.
    #[error("{path}: {source}")]
    Description {
        /// The file or arm.
        path: String,
        /// What is wrong.
        source: DescriptionError,
    },
    /// Its tables are of joints that turn.
    #[error(
        "{path}: joint `{joint}` slides, and a trial of --arm is of joints that turn; hide something in a cell of it with --cell, or in measurements of it with `plumb trial inject`"
    )]
    Slides {
        /// The file.
        path: String,
        /// The joint.
        joint: String,
    },
    /// `--effect` cannot be read.
    #[error(transparent)]
    EffectRequest(#[from] EffectRequestError),
    /// A number makes no sense.
    #[error("--{option} {value}: {right}")]
    Option {
        /// The option.
        option: &'static str,
        /// Its value.
        value: String,
        /// What would be right.
        right: &'static str,
    },
    /// The campaign cannot be simulated.
    #[error(transparent)]
    Generate(#[from] GenerateError),
    /// `--cell` names none.
    #[error("there is no cell `{name}`; known are {known}")]
    UnknownCell {
        /// What was asked.
        name: String,
        /// What there is.
        known: String,
    },
    /// `--fault` names nothing that can be hidden.
    #[error("nothing called `{name}` can be hidden in the cell; known are {known}")]
    UnknownFault {
        /// What was asked.
        name: String,
        /// What there is.
        known: String,
    },
    /// A site of `--fault` at which it cannot be.
    #[error("`{fault}` cannot be hidden at `{site}`; it can be at {known}")]
    UnknownSite {
        /// What was to be hidden.
        fault: String,
        /// Where.
        site: String,
        /// Where it can be.
        known: String,
    },
    /// The cell's world cannot be written or read.
    #[error(transparent)]
    World(Box<plumb_simulated::world_file::WorldFileError>),
    /// A world that no trial made.
    #[error(
        "{0}: this world was not made by `plumb trial new --cell`, so nobody has said what is hidden in it"
    )]
    NoTruth(PathBuf),
    /// A cell whose world has no arm that files describe.
    #[error(
        "{0}: something can be hidden in a world with `arm: {{described: ...}}`, its `by: FILE` on a line of its own; see workcells/ur5/world.yaml"
    )]
    NotDescribed(PathBuf),
    /// Nothing that is known shows on this arm in these poses.
    #[error(
        "nothing that can be hidden shows on this arm in the poses of its cell; name an effect with --fault"
    )]
    NothingToHide,
    /// The cell's poses are not those of its arm.
    #[error("{path}: a table of poses of this arm has the columns {columns}, with numbers below them")]
    PoseTable {
        /// The file.
        path: PathBuf,
        /// What it needs.
        columns: String,
    },
    /// A trial is there already.
    #[error("{0} is there already: a trial is not overwritten; give another directory")]
    Exists(PathBuf),
    /// A file cannot be written.
    #[error("cannot write {path}: {source}")]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// A file cannot be read.
    #[error("cannot read {path}: {source}")]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// The seal does not open.
    #[error("{path}: {source}")]
    Open {
        /// The file.
        path: PathBuf,
        /// Why.
        source: OpenError,
    },
    /// Poses that cannot be read.
    #[error("{path}: no poses as `plumb model next --json` writes them: {reason}")]
    Poses {
        /// The file.
        path: PathBuf,
        /// Why.
        reason: String,
    },
    /// The table of the trial is not what the trial wrote.
    #[error(
        "{path}, line {line}: {reason}; measurements of a trial are added to the table as it was written"
    )]
    Table {
        /// The file.
        path: PathBuf,
        /// The line.
        line: usize,
        /// What is wrong.
        reason: String,
    },
    /// A command of a rehearsal failed.
    #[error("plumb {command}: {cause}")]
    Rehearsal {
        /// The command, without the program.
        command: String,
        /// What it said last.
        cause: String,
    },
    /// Nothing can be hidden in these measurements.
    #[error(transparent)]
    Injection(Box<InjectionError>),
    /// A diagnosis that is none.
    #[error("{path}: not a diagnosis as `plumb model diagnose --json` writes it: {source}")]
    Diagnosis {
        /// The file.
        path: PathBuf,
        /// Why.
        source: serde_json::Error,
    },
}

impl From<InjectionError> for TrialError {
    fn from(error: InjectionError) -> Self {
        Self::Injection(Box::new(error))
    }
}
