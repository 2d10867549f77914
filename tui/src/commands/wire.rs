//! `plumb wire`: what goes over a device's line, recorded and played.

mod record;
mod replay;

use clap::Subcommand;

use crate::failure::CommandResult;

/// What is done with a line.
#[derive(Subcommand)]
pub(crate) enum WireCommand {
    Record(record::Arguments),
    Replay(replay::Arguments),
}

/// Does it.
pub(crate) fn run(command: &WireCommand) -> CommandResult {
    match command {
        WireCommand::Record(arguments) => record::run(arguments),
        WireCommand::Replay(arguments) => replay::run(arguments),
    }
}
