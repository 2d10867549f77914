//! The `plumb` program: reads the command line, hands it to a command, and turns the result into an exit code.
//!
//! Every command is a module with its own `Arguments` (clap) and `run(Arguments) -> CommandResult`. A command prints what
//! it has to say on standard output and gives its exit code; an error comes back here, is printed once, and ends the
//! program with 2.

#![warn(clippy::print_stdout, reason = "`say!` gives an error where `println!` panics")]

use std::process::ExitCode;

use clap::{Parser, Subcommand};

mod answer_command;
mod certificate_command;
mod check_command;
mod cloud_file;
mod doctor_command;
mod emulate_command;
mod failure;
mod history_command;
mod host_command;
mod interrupt;
mod model_command;
mod note_command;
mod plugins_command;
mod progress;
mod record_command;
mod run_command;
mod say;
mod schema_command;
mod screens;
mod show_command;
mod signals;
mod stripe_command;
mod study_command;
mod trial_command;
mod watch_command;
mod world_command;

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
    Model(model_command::ModelCommand),
    /// The controller of an arm on a pseudo-terminal, to try its driver without the arm.
    #[command(subcommand)]
    Emulate(emulate_command::EmulateCommand),
    Answer(answer_command::Arguments),
    Certificate(certificate_command::Arguments),
    Check(check_command::Arguments),
    Doctor(doctor_command::Arguments),
    History(history_command::Arguments),
    Note(note_command::Arguments),
    /// Look after the record: copy it, check it, list corrections and bring earlier ones back.
    #[command(subcommand)]
    Record(record_command::RecordCommand),
    Run(run_command::Arguments),
    Schema(schema_command::Arguments),
    Show(show_command::Arguments),
    /// What the stripes of a light stripe sensor say of the arm that carries it.
    #[command(subcommand)]
    Stripe(stripe_command::StripeCommand),
    Study(study_command::StudyArguments),
    /// Blind trials: measurements of an arm that hides something, and the answer under seal.
    #[command(subcommand)]
    Trial(trial_command::TrialCommand),
    /// The plugins that can be found, and whether they can be used.
    #[command(subcommand)]
    Plugins(plugins_command::PluginsCommand),
    #[command(hide = true)]
    Host(host_command::Arguments),
    #[command(hide = true)]
    World(world_command::Arguments),
    Watch(watch_command::Arguments),
}

fn main() -> ExitCode {
    signals::let_through();
    let result: CommandResult = match Arguments::parse().command {
        Command::Model(command) => model_command::run(&command),
        Command::Emulate(command) => emulate_command::run(&command),
        Command::Answer(arguments) => answer_command::run(&arguments),
        Command::Certificate(arguments) => certificate_command::run(&arguments),
        Command::Check(arguments) => check_command::run(&arguments),
        Command::Doctor(arguments) => doctor_command::run(&arguments),
        Command::History(arguments) => history_command::run(&arguments),
        Command::Note(arguments) => note_command::run(&arguments),
        Command::Record(command) => record_command::run(&command),
        Command::Schema(arguments) => schema_command::run(&arguments),
        Command::Run(arguments) => run_command::run(&arguments),
        Command::Show(arguments) => show_command::run(&arguments),
        Command::Stripe(command) => stripe_command::run(&command),
        Command::Study(arguments) => study_command::run(&arguments),
        Command::Trial(command) => trial_command::run(&command),
        Command::Plugins(command) => plugins_command::run(&command),
        Command::Host(_) => host_command::run(),
        Command::World(arguments) => world_command::run(&arguments),
        Command::Watch(arguments) => watch_command::run(&arguments),
    };
    failure::exit_code(result)
}
