//! The `plumb` program: reads the command line, hands it to a command, and turns the result into an exit code.

use std::process::ExitCode;

use clap::{Parser, Subcommand};

/// Brings lab robots true: runs workcells and their calibration procedures, and shows where the model of a machine fails.
#[derive(Parser)]
#[command(version, about)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {}

fn main() -> ExitCode {
    match Arguments::parse().command {}
}
