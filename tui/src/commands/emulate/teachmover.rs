//! `plumb emulate teachmover`.

use std::path::PathBuf;

use plumb_simulated::emulate::teachmover::{BareMotors, Emulator, Event, Motors, MotorsInWorld, Status};

use super::line::{LineArguments, announce, port_in_words, work};
use super::typed::Typing;
use crate::failure::CommandResult;

/// The controller of a Microbot TeachMover on a pseudo-terminal. Prints the path of the port and works until it is asked to end.
///
/// What happens to the arm is typed on standard input, a line each: `key stop` (or another key of the pendant), `stop-after 5` (STOP when the next
/// move has made 5 half-steps), `unplug-after 5`, `input 3 on`, `between 12.5` (something 12.5 mm wide between the fingers), `drive base -100` (under
/// hand control), `read off` (it does not know @READ any more), `fault drop to-arm 3`, `faults 0.01`, `unplug`, `plug`, `status`, `quit`.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// The socket of the world whose arm it drives. Left out, it drives motors on a bench.
    #[arg(long, value_name = "SOCKET")]
    world: Option<PathBuf>,
    /// The rate whose timing is kept, byte for byte.
    #[arg(long, default_value_t = 9600, value_parser = baud)]
    baud: u32,
    /// Let bytes, and motions on a bench, take no time.
    #[arg(long, conflicts_with = "baud")]
    as_fast_as_possible: bool,
    /// How far the fingers of an arm on a bench are open, mm.
    #[arg(long, default_value_t = 40.0, conflicts_with = "world")]
    opening_mm: f64,
    /// As a controller that does not know @READ: it answers 0 to it.
    #[arg(long)]
    without_read: bool,
    #[command(flatten)]
    line: LineArguments,
}

/// Works as the controller until SIGTERM, SIGINT or `quit`.
pub(super) fn run(arguments: &Arguments) -> CommandResult {
    // Before any thread is there, so that the signals come to this one and nowhere else.
    let typing = Typing::listen(arguments.line.ends_with_parent)?;
    let baud = (!arguments.as_fast_as_possible).then_some(arguments.baud);
    let (motors, drives): (Box<dyn Motors>, String) = match &arguments.world {
        Some(socket) => (
            Box::new(MotorsInWorld::connect(socket)?),
            format!("the arm of the world at {}", socket.display()),
        ),
        None => (
            Box::new(BareMotors::new(arguments.as_fast_as_possible, arguments.opening_mm)),
            "motors on a bench".to_owned(),
        ),
    };
    let mut emulator = Emulator::start(arguments.line.at(baud), motors)?;
    if arguments.without_read {
        emulator.inject(Event::Read(false));
    }
    announce("TeachMover controller", emulator.status().port.as_deref(), baud, &drives)?;
    work(typing, emulator, status)
}

fn status(status: Status) -> String {
    let registers: Vec<String> = status.registers.iter().map(i32::to_string).collect();
    let busy = if status.busy { "busy" } else { "waiting" };
    format!("{} registers {} {busy}", port_in_words(status.port), registers.join(","))
}

fn baud(text: &str) -> Result<u32, String> {
    const RATES: [u32; 8] = [110, 150, 300, 600, 1200, 2400, 4800, 9600];
    let rate = text.parse().ok().filter(|rate| RATES.contains(rate));
    rate.ok_or_else(|| {
        "the controller's switches offer 110, 150, 300, 600, 1200, 2400, 4800 and 9600 baud".to_owned()
    })
}
