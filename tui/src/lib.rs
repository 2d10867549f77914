//! The `plumb` program: reads the command line, hands it to a command, and turns the result into an exit code.
//!
//! Every command is a module with its own `Arguments` (clap) and `run(Arguments) -> CommandResult`. A command prints what
//! it has to say on standard output and gives its exit code; an error comes back here, is printed once, and ends the
//! program with 2.

#![warn(clippy::print_stdout, reason = "`print_line!` gives an error where `println!` panics")]

use std::process::ExitCode;

mod command_line;
pub mod commands;
mod completion;
pub mod failure;
pub mod interrupt;
mod logging;
mod print_line;
pub mod progress;
mod record_directory;
mod screens;
mod shown_unit;
pub mod signals;
mod step_numbers;
mod unchecked_server;
mod web;

use command_line::Command;
use commands::{
    alert, answer, certificate, check, completions, doctor, emulate, fleet, history, host, init, man, model,
    note, plugins, queue, record, report, run, schema, serve, ship, show, streams, stripe, study, target,
    trial, watch, wire, world,
};
use failure::CommandResult;

pub use command_line::command;

/// Runs the program with the arguments of its process.
pub fn program() -> ExitCode {
    signals::let_through();
    completion::serve(command_line::command);
    let arguments = command_line::parse();
    // A host passes on what it logs to the program that started it.
    if !matches!(arguments.command, Command::Host(_))
        && let Err(error) = logging::start(arguments.log.as_deref())
    {
        return failure::exit_code(Err(error.into()));
    }
    let result: CommandResult = match arguments.command {
        Command::Completions(arguments) => completions::run(&arguments),
        Command::Init(arguments) => init::run(&arguments),
        Command::Man(arguments) => man::run(&arguments, command_line::command()),
        Command::Model(command) => model::run(&command),
        Command::Emulate(command) => emulate::run(&command),
        Command::Wire(command) => wire::run(&command),
        Command::Alert(arguments) => alert::run(&arguments),
        Command::Answer(arguments) => answer::run(&arguments),
        Command::Certificate(arguments) => certificate::run(&arguments),
        Command::Check(arguments) => check::run(&arguments),
        Command::Doctor(arguments) => doctor::run(&arguments),
        Command::Fleet(arguments) => fleet::run(&arguments),
        Command::History(arguments) => history::run(&arguments),
        Command::Note(arguments) => note::run(&arguments),
        Command::Queue(command) => queue::run(&command),
        Command::Record(command) => record::run(&command),
        Command::Report(command) => report::run(&command),
        Command::Schema(arguments) => schema::run(&arguments),
        Command::Run(arguments) => run::run(&arguments),
        Command::Serve(arguments) => serve::run(&arguments),
        Command::Ship(arguments) => ship::run(&arguments),
        Command::Show(arguments) => show::run(&arguments),
        Command::Stripe(command) => stripe::run(&command),
        Command::Study(arguments) => study::run(&arguments),
        Command::Streams(arguments) => streams::run(&arguments),
        Command::Target(arguments) => target::run(&arguments),
        Command::Trial(command) => trial::run(&command),
        Command::Plugins(command) => plugins::run(&command),
        Command::Host(_) => host::run(),
        Command::World(arguments) => world::run(&arguments),
        Command::Watch(arguments) => watch::run(&arguments),
    };
    failure::exit_code(result)
}
