//! `plumb emulate teachmover`.

use std::io::{self, Write};
use std::path::PathBuf;
use std::process::ExitCode;

use plumb_simulated::emulate::teachmover::{
    BareMotors, Emulator, EmulatorOptions, Event, Fault, Motors, MotorsInWorld,
};

use super::typed::Typing;
use crate::failure::CommandResult;

/// The controller of a Microbot TeachMover on a pseudo-terminal. Prints the path of the port and works until it is told to end.
///
/// What happens to the arm is typed on standard input, a line each: `key stop` (or another key of the pendant), `stop-after 5` (STOP when the next
/// move has made 5 half-steps), `input 3 on`, `between 12.5` (something 12.5 mm wide between the fingers), `drive base -100` (under
/// hand control), `fault drop to-arm 3`, `faults 0.01`, `unplug`, `plug`, `status`, `quit`.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// The socket of the world whose arm it drives. Left out, it drives motors on a bench.
    #[arg(long, value_name = "SOCKET")]
    world: Option<PathBuf>,
    /// Ends when the program that started it ends, however that ends.
    #[arg(long, hide = true)]
    ends_with_parent: bool,
    /// The rate whose timing is kept, byte for byte.
    #[arg(long, default_value_t = 9600, value_parser = baud)]
    baud: u32,
    /// Let bytes, and motions on a bench, take no time.
    #[arg(long, conflicts_with = "baud")]
    as_fast_as_possible: bool,
    /// Make a link to the port here, and take it away at the end.
    #[arg(long, value_name = "PATH")]
    link: Option<PathBuf>,
    /// How far the fingers of an arm on a bench are open, mm.
    #[arg(long, default_value_t = 40.0, conflicts_with = "world")]
    opening_mm: f64,
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

/// What was typed.
enum Typed {
    Happens(Event),
    Status,
    Quit,
    Nothing,
}

/// Works as the controller until SIGTERM, SIGINT or `quit`.
pub(super) fn run(arguments: &Arguments) -> CommandResult {
    // Before any thread is there, so that the signals come to this one and nowhere else.
    let mut typing = Typing::listen(arguments.ends_with_parent)?;
    let mut emulator = Emulator::start(options(arguments), motors(arguments)?)?;
    announce(arguments, &emulator)?;
    while emulator.is_working() {
        let Some(lines) = typing.next()? else { break };
        for line in lines {
            match parse(&line) {
                Ok(Typed::Happens(event)) => emulator.tell(event),
                Ok(Typed::Status) => print_status(&emulator)?,
                Ok(Typed::Quit) => return end(emulator),
                Ok(Typed::Nothing) => {}
                Err(error) => eprintln!("{error}"),
            }
        }
    }
    end(emulator)
}

fn options(arguments: &Arguments) -> EmulatorOptions {
    EmulatorOptions {
        baud: (!arguments.as_fast_as_possible).then_some(arguments.baud),
        link: arguments.link.clone(),
        seed: arguments.seed,
        faults: arguments.fault.clone(),
        fault_probability: arguments.fault_rate,
    }
}

fn motors(arguments: &Arguments) -> Result<Box<dyn Motors>, Box<dyn std::error::Error>> {
    Ok(match &arguments.world {
        Some(socket) => Box::new(MotorsInWorld::connect(socket)?),
        None => Box::new(BareMotors::new(arguments.as_fast_as_possible, arguments.opening_mm)),
    })
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
    let arm = match &arguments.world {
        Some(socket) => format!("the arm of the world at {}", socket.display()),
        None => "motors on a bench".to_owned(),
    };
    eprintln!("TeachMover controller on {} ({rate}), driving {arm}", port.display());
    Ok(())
}

fn parse(line: &str) -> Result<Typed, Box<dyn std::error::Error>> {
    Ok(match line.trim() {
        "" => Typed::Nothing,
        "status" => Typed::Status,
        "quit" => Typed::Quit,
        line => Typed::Happens(line.parse()?),
    })
}

fn print_status(emulator: &Emulator) -> io::Result<()> {
    let standing = emulator.standing();
    let registers: Vec<String> = standing.registers.iter().map(i32::to_string).collect();
    let port = standing.port.map_or("unplugged".to_owned(), |port| port.display().to_string());
    let busy = if standing.busy { "busy" } else { "waiting" };
    let mut output = io::stdout();
    writeln!(output, "{port} registers {} {busy}", registers.join(","))?;
    output.flush()
}

fn end(emulator: Emulator) -> CommandResult {
    emulator.stop()?;
    Ok(ExitCode::SUCCESS)
}

fn baud(text: &str) -> Result<u32, String> {
    const RATES: [u32; 8] = [110, 150, 300, 600, 1200, 2400, 4800, 9600];
    let rate = text.parse().ok().filter(|rate| RATES.contains(rate));
    rate.ok_or_else(|| {
        "the controller's switches offer 110, 150, 300, 600, 1200, 2400, 4800 and 9600 baud".to_owned()
    })
}
