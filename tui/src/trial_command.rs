//! `plumb trial`: blind trials. An arm is simulated with something hidden; the user gets its measurements, works with the lab, and opens the seal.

mod arguments;
mod benchmark;
mod cell;
mod measure;
mod rehearsal;
mod reveal;
mod score;
mod wish;

use std::fs;
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Subcommand;
use plumb_document::{FileKind, read_text};
use plumb_model::laboratory::LaboratoryError;
use plumb_simulated::physics::campaign::seal::{self, OpenError, Sealed};
use plumb_simulated::physics::campaign::{self, Case, GenerateError, Truth};
use plumb_simulated::physics::description::DescriptionError;
use thiserror::Error;

use crate::failure::CommandResult;
use arguments::CampaignArguments;
use benchmark::BenchmarkArguments;
use measure::MeasureArguments;
use rehearsal::RehearsalArguments;
use reveal::RevealArguments;

const TABLE: &str = "table.csv";
const MODEL: &str = "model.yaml";
const SEALED: &str = "answer.sealed";
const ANSWERS: &str = "answers.json";

/// What to do with trials.
#[derive(Debug, Subcommand)]
pub(crate) enum TrialCommand {
    /// Simulate a measurement campaign on an arm that hides something, and seal the answer.
    New(NewArguments),
    /// Simulate many campaigns, one directory each.
    Batch(BatchArguments),
    /// Measure further poses on the arm of a trial, such as those the lab asks for.
    Measure(MeasureArguments),
    /// Open the seal, and score a diagnosis against it.
    Reveal(RevealArguments),
    /// Work through trials in a cell unattended, each from its first run to the last: what was found, and how far the true error fell.
    Rehearse(RehearsalArguments),
    /// Hide, diagnose and compare many times: how often is the truth found, and by whom.
    Benchmark(BenchmarkArguments),
}

/// Options of `plumb trial new`.
#[derive(Debug, clap::Args)]
pub(crate) struct NewArguments {
    #[command(flatten)]
    campaign: CampaignArguments,
    /// Build a whole simulated cell instead of a campaign's table: `teachmover`, `puma` or `light-stripe`. What is hidden is found with the cell's own sensors and instruments, by runs.
    #[arg(long, value_name = "CELL")]
    cell: Option<String>,
    /// What to hide in the cell, such as `none`, `backlash` or `backlash(elbow)`; by lot when not given, and so is its place. A name that is not known is
    /// answered with those that are.
    #[arg(long, value_name = "FAULT", requires = "cell")]
    fault: Option<String>,
    /// Seed of everything: the same seed and options give the same trial.
    #[arg(long)]
    seed: u64,
    /// Directory to write table.csv, model.yaml and answer.sealed to, or the cell; made if need be.
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
}

/// Options of `plumb trial batch`.
#[derive(Debug, clap::Args)]
pub(crate) struct BatchArguments {
    #[command(flatten)]
    campaign: CampaignArguments,
    /// Seed of the first trial; each further one has the next number.
    #[arg(long)]
    seed: u64,
    /// How many trials.
    #[arg(long)]
    count: u64,
    /// Also write answers.json, in the open.
    #[arg(long)]
    open: bool,
    /// Directory in which each trial gets its own, named by its seed.
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
}

/// Why a trial command failed.
#[derive(Debug, Error)]
pub(crate) enum TrialError {
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
    /// `--effect` cannot be read.
    #[error(transparent)]
    Wish(#[from] wish::WishError),
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
    /// The lab refuses a case that it should take.
    #[error("the lab refuses the case of seed {seed}: {source}")]
    Lab {
        /// The case.
        seed: u64,
        /// Why.
        source: Box<LaboratoryError>,
    },
    /// Standard output is gone.
    #[error("cannot write to standard output")]
    Say(#[source] io::Error),
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
    /// A place of `--fault` at which it cannot be.
    #[error("`{fault}` cannot be hidden at `{place}`; it can be at {known}")]
    UnknownPlace {
        /// What was to be hidden.
        fault: String,
        /// Where.
        place: String,
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
    /// A trial stands there already.
    #[error("{0} stands there already: a trial is not overwritten; give another directory")]
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
    /// A diagnosis that is none.
    #[error("{path}: not a diagnosis as `plumb model diagnose --json` writes it: {source}")]
    Diagnosis {
        /// The file.
        path: PathBuf,
        /// Why.
        source: serde_json::Error,
    },
}

/// What a trial command says, and whether what it judged was right.
struct Outcome {
    said: String,
    right: bool,
    /// Something could not be done, though the rest was.
    failed: bool,
}

impl Outcome {
    fn done(said: String) -> Self {
        Self { said, right: true, failed: false }
    }
}

/// Exit code of a diagnosis that was wrong.
const WRONG: u8 = 1;

/// Exit code where a trial could not be gone through.
const FAILED: u8 = 2;

/// Runs a trial command. Exit code 0, 1 when a diagnosis was scored and is wrong, 2 when a trial could not be gone through.
pub(crate) fn run(command: &TrialCommand) -> CommandResult {
    let outcome = match command {
        TrialCommand::New(arguments) => new(arguments),
        TrialCommand::Batch(arguments) => batch(arguments),
        TrialCommand::Measure(arguments) => measure::run(arguments),
        TrialCommand::Reveal(arguments) => reveal::run(arguments),
        TrialCommand::Rehearse(arguments) => rehearsal::run(arguments),
        TrialCommand::Benchmark(arguments) => benchmark::run(arguments),
    }?;
    io::stdout().write_all(outcome.said.as_bytes())?;
    Ok(match outcome {
        Outcome { failed: true, .. } => ExitCode::from(FAILED),
        Outcome { right: true, .. } => ExitCode::SUCCESS,
        Outcome { .. } => ExitCode::from(WRONG),
    })
}

fn new(arguments: &NewArguments) -> Result<Outcome, TrialError> {
    if let Some(cell) = &arguments.cell {
        return cell::new(cell, arguments.fault.as_deref(), arguments.seed, &arguments.output);
    }
    let specification = arguments.campaign.specification(arguments.seed)?;
    let case = campaign::generate(&specification, arguments.seed)?;
    write_case(&case, &arguments.output)?;
    let directory = arguments.output.display();
    Ok(Outcome::done(format!(
        "{} readings of an arm `{}` stand in {directory}.\n  plumb model diagnose {directory}/{MODEL} --data {directory}/{TABLE}\n  \
         plumb trial reveal {directory}\n",
        case.readings.len(),
        specification.arm.name
    )))
}

fn batch(arguments: &BatchArguments) -> Result<Outcome, TrialError> {
    let mut answers = serde_json::Map::new();
    for number in 0..arguments.count {
        let seed = arguments.seed.wrapping_add(number);
        let case = campaign::generate(&arguments.campaign.specification(seed)?, seed)?;
        let name = format!("case-{seed}");
        write_case(&case, &arguments.output.join(&name))?;
        answers.insert(name, answer(&case.truth));
    }
    if arguments.open {
        let text = serde_json::Value::Object(answers);
        write(&arguments.output.join(ANSWERS), &format!("{text:#}\n"))?;
    }
    Ok(Outcome::done(format!("{} trials stand in {}.\n", arguments.count, arguments.output.display())))
}

/// The truth as answers.json holds it.
fn answer(truth: &Truth) -> serde_json::Value {
    serde_json::to_value(truth).unwrap_or_default()
}

fn write_case(case: &Case, directory: &Path) -> Result<(), TrialError> {
    fs::create_dir_all(directory)
        .map_err(|source| TrialError::Write { path: directory.to_owned(), source })?;
    let files = [(TABLE, case.table_csv()), (MODEL, case.model_yaml()), (SEALED, seal::seal(case))];
    if let Some((name, _)) = files.iter().find(|(name, _)| directory.join(name).exists()) {
        return Err(TrialError::Exists(directory.join(name)));
    }
    files.iter().try_for_each(|(name, text)| write(&directory.join(name), text))
}

fn open(path: &Path) -> Result<Sealed, TrialError> {
    seal::open(&read(path)?).map_err(|source| TrialError::Open { path: path.to_owned(), source })
}

fn read(path: &Path) -> Result<String, TrialError> {
    read_text(path, FileKind::TRIAL)
        .map_err(|source| TrialError::Read { path: path.to_owned(), source: source.into() })
}

fn write(path: &Path, text: &str) -> Result<(), TrialError> {
    fs::write(path, text).map_err(|source| TrialError::Write { path: path.to_owned(), source })
}
