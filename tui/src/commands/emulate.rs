//! `plumb emulate`: the controller of an arm as a program on a pseudo-terminal or on the network, so that its real driver can be tried without the arm.

mod dobot;
mod feetech;
mod line;
mod teachmover;
pub(super) mod typed;
mod universal_robots;
mod val2;

use clap::Subcommand;

use crate::failure::CommandResult;

/// Which controller.
#[derive(Subcommand)]
pub(crate) enum EmulateCommand {
    Dobot(dobot::Arguments),
    Feetech(feetech::Arguments),
    Teachmover(teachmover::Arguments),
    UniversalRobots(universal_robots::Arguments),
    Val2(val2::Arguments),
}

/// Works as a controller until it is asked to end.
pub(crate) fn run(command: &EmulateCommand) -> CommandResult {
    match command {
        EmulateCommand::Dobot(arguments) => dobot::run(arguments),
        EmulateCommand::Feetech(arguments) => feetech::run(arguments),
        EmulateCommand::Teachmover(arguments) => teachmover::run(arguments),
        EmulateCommand::UniversalRobots(arguments) => universal_robots::run(arguments),
        EmulateCommand::Val2(arguments) => val2::run(arguments),
    }
}
