//! `plumb emulate val2`.

use std::io::{self, Write};
use std::path::PathBuf;
use std::process::ExitCode;

use plumb_simulated::emulate::val2::{Dialect, Emulator, EmulatorOptions, Event, Fault};

use super::typed::Typing;
use crate::failure::CommandResult;

/// The VAL-II controller of a PUMA 560 on a pseudo-terminal. Prints the path of the port and works until it is told to end.
///
/// What happens to the controller is typed on standard input, a line each: `power off`, `power on`, `panic`, `envelope 3` (the servo of joint 3
/// loses its arm), `reboot`, `fault drop to-arm 3`, `faults 0.01`, `unplug`, `plug`, `status`, `quit`.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// The socket of the world whose arm it drives.
    #[arg(long, value_name = "SOCKET")]
    world: PathBuf,
    /// Ends when the program that started it ends, however that ends.
    #[arg(long, hide = true)]
    ends_with_parent: bool,
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
    /// Make a link to the port here, and take it away at the end.
    #[arg(long, value_name = "PATH")]
    link: Option<PathBuf>,
    /// Damage a byte: drop, double, garble or late:MS, then to-arm or from-arm, then which byte from 1. May be repeated.
    #[arg(long, value_name = "KIND WAY N")]
    fault: Vec<Fault>,
    /// Damage every byte with this probability.
    #[arg(long, default_value_t = 0.0, value_name = "PROBABILITY", value_parser = super::probability)]
    fault_rate: f64,
    /// What chance is drawn from.
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

/// Works as the controller until SIGTERM, SIGINT or `quit`.
pub(super) fn run(arguments: &Arguments) -> CommandResult {
    // Before any thread is there, so that the signals come to this one and nowhere else.
    let mut typing = Typing::listen(arguments.ends_with_parent)?;
    let mut emulator = Emulator::start(EmulatorOptions {
        world: arguments.world.clone(),
        dialect: arguments.dialect,
        baud: (!arguments.as_fast_as_possible).then_some(arguments.baud),
        keeps_up: arguments.keeps_up,
        link: arguments.link.clone(),
        seed: arguments.seed,
        faults: arguments.fault.clone(),
        fault_probability: arguments.fault_rate,
    })?;
    announce(arguments, &emulator)?;
    while emulator.is_working() {
        let Some(lines) = typing.next()? else { break };
        for line in lines {
            match line.trim() {
                "" => {}
                "quit" => return end(emulator),
                "status" => print_status(&emulator)?,
                line => match line.parse::<Event>() {
                    Ok(event) => emulator.tell(event),
                    Err(error) => eprintln!("{error}"),
                },
            }
        }
    }
    end(emulator)
}

/// The port's path alone on the first line, for scripts; all else goes to standard error.
fn announce(arguments: &Arguments, emulator: &Emulator) -> io::Result<()> {
    let port = emulator.standing().port.unwrap_or_default();
    let mut output = io::stdout();
    writeln!(output, "{}", port.display())?;
    output.flush()?;
    let rate = match arguments.as_fast_as_possible {
        true => "as fast as it can".to_owned(),
        false => format!("{} baud", arguments.baud),
    };
    eprintln!(
        "VAL-II on {} ({rate}), driving the arm of the world at {}",
        port.display(),
        arguments.world.display()
    );
    Ok(())
}

fn print_status(emulator: &Emulator) -> io::Result<()> {
    let standing = emulator.standing();
    let port = standing.port.map_or("unplugged".to_owned(), |port| port.display().to_string());
    let moves = if standing.moving { "moving" } else { "at rest" };
    let mut output = io::stdout();
    writeln!(output, "{port} {moves}, {} characters lost", standing.lost)?;
    output.flush()
}

fn end(emulator: Emulator) -> CommandResult {
    emulator.stop()?;
    Ok(ExitCode::SUCCESS)
}
