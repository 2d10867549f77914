//! `plumb trial`: blind trials. An arm is simulated with something hidden; the user gets its measurements, works with the lab, and opens the seal.

pub mod arguments;
mod cell;
pub mod effect_request;
mod error;
mod files;
mod inject;
pub mod injection;
mod measure;
mod outcome;
mod rehearsal;
mod reveal;
pub mod score;
mod shown;

use std::io::{self, Write as _};
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Subcommand;
use plumb_simulated::physics::campaign;

use crate::failure::CommandResult;
use arguments::CampaignArguments;
pub use error::TrialError;
use files::{ANSWERS, MODEL, TABLE, answer, write, write_case};
use inject::InjectArguments;
use measure::MeasureArguments;
use outcome::Outcome;
use rehearsal::RehearsalArguments;
use reveal::RevealArguments;

/// What to do with trials.
#[derive(Debug, Subcommand)]
pub(crate) enum TrialCommand {
    /// Simulate a measurement campaign on an arm that hides something, and seal the answer.
    New(NewArguments),
    /// Simulate many campaigns, one directory each.
    Batch(BatchArguments),
    /// Measure further poses on the arm of a trial, such as those the lab asks for.
    Measure(MeasureArguments),
    /// Hide an effect in measurements of your own, and say whether the lab would find it, and from which size on.
    Inject(InjectArguments),
    /// Open the seal, and score a diagnosis against it.
    Reveal(RevealArguments),
    /// Work through trials in a cell unattended, each from its first run to the last: what was found, and how far the true error fell.
    Rehearse(RehearsalArguments),
}

/// Options of `plumb trial new`.
#[derive(Debug, clap::Args)]
pub(crate) struct NewArguments {
    #[command(flatten)]
    campaign: CampaignArguments,
    /// Build a whole simulated cell instead of a campaign's table: `teachmover`, `puma`, `light-stripe`, `ur5`, `scara`, or a folder of your own with the cell of an arm that files describe. What is hidden is found with the cell's own sensors and instruments, by runs.
    #[arg(long, value_name = "CELL")]
    cell: Option<String>,
    /// What to hide in the cell, such as `none`, `backlash` or `backlash(elbow)`; at random when not given, and so is its place. A name that is not known is
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
        TrialCommand::Inject(arguments) => inject::run(arguments),
        TrialCommand::Reveal(arguments) => reveal::run(arguments),
        TrialCommand::Rehearse(arguments) => rehearsal::run(arguments),
    }?;
    io::stdout().write_all(outcome.message.as_bytes())?;
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
        "{} readings of an arm `{}` are in {directory}.\n  plumb model diagnose {directory}/{MODEL} --data {directory}/{TABLE}\n  \
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
    Ok(Outcome::done(format!("{} trials are in {}.\n", arguments.count, arguments.output.display())))
}
