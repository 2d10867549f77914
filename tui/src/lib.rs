//! The `plumb` program: reads the command line, hands it to a command, and turns the result into an exit code.
//!
//! Every command is a module with its own `Arguments` (clap) and `run(Arguments) -> CommandResult`. A command prints what
//! it has to say on standard output and gives its exit code; an error comes back here, is printed once, and ends the
//! program with 2.

#![warn(clippy::print_stdout, reason = "`say!` gives an error where `println!` panics")]

use std::process::ExitCode;

use clap::{Parser, Subcommand};

pub mod commands;
pub mod failure;
pub mod interrupt;
pub mod progress;
mod record_directory;
mod say;
mod screens;
pub mod signals;

use commands::{
    answer, certificate, check, doctor, emulate, history, host, model, note, plugins, record, run, schema,
    show, stripe, study, trial, watch, world,
};
use failure::CommandResult;

/// Brings lab robots true: runs workcells and their calibration procedures, and shows where the model of a machine fails.
#[derive(Parser)]
#[command(version, about)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Compare a model with measurements, see what it lacks, add it, watch the error fall.
    #[command(subcommand)]
    Model(model::ModelCommand),
    /// The controller of an arm on a pseudo-terminal, to try its driver without the arm.
    #[command(subcommand)]
    Emulate(emulate::EmulateCommand),
    Answer(answer::Arguments),
    Certificate(certificate::Arguments),
    Check(check::Arguments),
    Doctor(doctor::Arguments),
    History(history::Arguments),
    Note(note::Arguments),
    /// Look after the record: copy it, check it, list corrections and bring earlier ones back.
    #[command(subcommand)]
    Record(record::RecordCommand),
    Run(run::Arguments),
    Schema(schema::Arguments),
    Show(show::Arguments),
    /// What the stripes of a light stripe sensor say of the arm that carries it.
    #[command(subcommand)]
    Stripe(stripe::StripeCommand),
    Study(study::StudyArguments),
    /// Blind trials: measurements of an arm that hides something, and the answer under seal.
    #[command(subcommand)]
    Trial(trial::TrialCommand),
    /// The plugins that can be found, and whether they can be used.
    #[command(subcommand)]
    Plugins(plugins::PluginsCommand),
    #[command(hide = true)]
    Host(host::Arguments),
    #[command(hide = true)]
    World(world::Arguments),
    Watch(watch::Arguments),
}

/// Runs the program with the arguments of its process.
pub fn program() -> ExitCode {
    signals::let_through();
    let result: CommandResult = match Arguments::parse().command {
        Command::Model(command) => model::run(&command),
        Command::Emulate(command) => emulate::run(&command),
        Command::Answer(arguments) => answer::run(&arguments),
        Command::Certificate(arguments) => certificate::run(&arguments),
        Command::Check(arguments) => check::run(&arguments),
        Command::Doctor(arguments) => doctor::run(&arguments),
        Command::History(arguments) => history::run(&arguments),
        Command::Note(arguments) => note::run(&arguments),
        Command::Record(command) => record::run(&command),
        Command::Schema(arguments) => schema::run(&arguments),
        Command::Run(arguments) => run::run(&arguments),
        Command::Show(arguments) => show::run(&arguments),
        Command::Stripe(command) => stripe::run(&command),
        Command::Study(arguments) => study::run(&arguments),
        Command::Trial(command) => trial::run(&command),
        Command::Plugins(command) => plugins::run(&command),
        Command::Host(_) => host::run(),
        Command::World(arguments) => world::run(&arguments),
        Command::Watch(arguments) => watch::run(&arguments),
    };
    failure::exit_code(result)
}
