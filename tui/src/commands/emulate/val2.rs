//! `plumb emulate val2`.

use std::path::PathBuf;

use plumb_simulated::emulate::val2::{Dialect, Emulator, EmulatorOptions, Status};

use super::line::{LineArguments, announce, port_in_words, work};
use super::typed::Typing;
use crate::failure::CommandResult;

/// The VAL-II controller of a PUMA 560 on a pseudo-terminal. Prints the path of the port and works until it is asked to end.
///
/// What happens to the controller is typed on standard input, a line each: `power off`, `power on`, `panic`, `envelope 3` (the servo of joint 3
/// loses its arm), `reboot`, `program` (a program runs, which ABORT ends when it was answered that one is sure), `fault drop to-arm 3`, `faults 0.01`, `unplug`, `plug`, `status`, `quit`.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// The socket of the world whose arm it drives.
    #[arg(long, value_name = "SOCKET")]
    world: PathBuf,
    /// How its monitor speaks: mark2, mark1 or late.
    #[arg(long, default_value = "mark2")]
    dialect: Dialect,
    /// The rate whose timing is kept, character for character.
    #[arg(long, default_value_t = 9600, value_parser = clap::value_parser!(u32).range(110..=115_200))]
    baud: u32,
    /// Let characters take no time.
    #[arg(long, conflicts_with = "baud")]
    as_fast_as_possible: bool,
    /// Keep up with the line, so that whole lines can be sent at once. Otherwise one character is held while another is echoed.
    #[arg(long)]
    keeps_up: bool,
    #[command(flatten)]
    line: LineArguments,
}

/// Works as the controller until SIGTERM, SIGINT or `quit`.
pub(super) fn run(arguments: &Arguments) -> CommandResult {
    // Before any thread is there, so that the signals come to this one and nowhere else.
    let typing = Typing::listen(arguments.line.ends_with_parent)?;
    let baud = (!arguments.as_fast_as_possible).then_some(arguments.baud);
    let emulator = Emulator::start(EmulatorOptions {
        world: arguments.world.clone(),
        dialect: arguments.dialect,
        keeps_up: arguments.keeps_up,
        line: arguments.line.at(baud),
    })?;
    let drives = format!("the arm of the world at {}", arguments.world.display());
    announce("VAL-II", emulator.status().port.as_deref(), baud, &drives)?;
    work(typing, emulator, status)
}

fn status(status: Status) -> String {
    let moves = if status.moving { "moving" } else { "at rest" };
    format!("{} {moves}, {} characters lost", port_in_words(status.port), status.lost)
}
