//! `plumb emulate feetech`.

use std::path::PathBuf;

use plumb_simulated::emulate::feetech::{Emulator, EmulatorOptions, Status};

use super::line::{LineArguments, announce, port_in_words, work};
use super::typed::Typing;
use crate::failure::CommandResult;

/// The bus of an arm of Feetech STS servos, such as an SO-101, on a pseudo-terminal. Prints the path of the port and works until it is asked to end.
///
/// What befalls the servos is typed on standard input, a line each: `overload 3` (servo 3 lets go), `celsius 3 75`, `volts 3.2`, `silent 4` (its
/// plug is out), `answers 4`, `sag 2 12` (load keeps servo 2 twelve steps short of its goals), `lose 2` and `cut 2` (the next two answers), `power off`,
/// `power on`, `fault garble from-arm 3`, `faults 0.01`, `unplug`, `plug`, `status`, `quit`.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// The socket of the world whose arm they drive. Left out, they turn nothing.
    #[arg(long, value_name = "SOCKET")]
    world: Option<PathBuf>,
    /// How many servos there are, numbered from 1; those beyond the arm's joints turn nothing.
    #[arg(long, default_value_t = 6, value_parser = clap::value_parser!(u8).range(1..=16))]
    servos: u8,
    /// A servo whose horn sits the other way round, by its number. May be repeated.
    #[arg(long, value_name = "ID")]
    reversed: Vec<u8>,
    /// Bring back what the host sends, as adapters without a switch of direction do.
    #[arg(long)]
    echo: bool,
    /// The rate whose timing is kept, byte for byte.
    #[arg(long, default_value_t = 1_000_000, value_parser = clap::value_parser!(u32).range(38_400..=1_000_000))]
    baud: u32,
    /// Let bytes, and shafts that turn nothing, take no time.
    #[arg(long, conflicts_with = "baud")]
    as_fast_as_possible: bool,
    #[command(flatten)]
    line: LineArguments,
}

/// Works as the servos until SIGTERM, SIGINT or `quit`.
pub(super) fn run(arguments: &Arguments) -> CommandResult {
    // Before any thread is there, so that the signals come to this one and nowhere else.
    let typing = Typing::listen(arguments.line.ends_with_parent)?;
    let baud = (!arguments.as_fast_as_possible).then_some(arguments.baud);
    let emulator = Emulator::start(EmulatorOptions {
        world: arguments.world.clone(),
        servos: arguments.servos,
        reversed: arguments.reversed.clone(),
        echo: arguments.echo,
        line: arguments.line.at(baud),
    })?;
    let drives = match &arguments.world {
        Some(socket) => format!("the arm of the world at {}", socket.display()),
        None => "shafts with nothing on them".to_owned(),
    };
    let title = format!("{} Feetech servos", arguments.servos);
    announce(&title, emulator.status().port.as_deref(), baud, &drives)?;
    work(typing, emulator, status)
}

fn status(status: Status) -> String {
    let numbers = |values: Vec<i32>| values.iter().map(i32::to_string).collect::<Vec<_>>().join(",");
    let holds = status.holds.iter().map(|holds| if *holds { "1" } else { "0" }).collect::<Vec<_>>().join(",");
    let moves = if status.moving { "moving" } else { "at rest" };
    format!(
        "{} encoders {} offsets {} torque {holds} {moves}",
        port_in_words(status.port),
        numbers(status.encoders),
        numbers(status.offsets)
    )
}
