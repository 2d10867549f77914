//! `plumb emulate dobot`.

use std::path::PathBuf;

use plumb_simulated::emulate::dobot::{Emulator, EmulatorOptions, Status};

use super::line::{LineArguments, announce, port_in_words, work};
use super::typed::Typing;
use crate::failure::CommandResult;

/// The rate of a Magician's USB line.
const BAUD: u32 = 115_200;
/// No angle sensor that works is off by more, deg.
const MOST_OFF_DEG: f64 = 20.0;

/// The controller of a Dobot Magician on a pseudo-terminal. Prints the path of the port and works until it is asked to end.
///
/// What befalls it is typed on standard input, a line each: `alarm 0x52` (an alarm goes on and the arm stops), `block` (the arm runs into something
/// unnoticed), `hold` (its move does not end), `lose 2`, `cut 2` and `corrupt 2` (the next two answers), `power off`, `power on`,
/// `fault garble from-arm 3`, `faults 0.01`, `unplug`, `plug`, `status`, `quit`.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// The socket of the world whose arm it moves: base, rear arm, elbow, wrist, hand. Left out, it moves an arm of air.
    #[arg(long, value_name = "SOCKET")]
    world: Option<PathBuf>,
    /// By how many degrees the angles of base, rear arm, forearm and hand say more than is so.
    #[arg(long, value_name = "DEG,DEG,DEG,DEG", default_value = "0,0,0,0", value_parser = four_angles, allow_hyphen_values = true)]
    sensors_off: [f64; 4],
    /// Let bytes, and an arm of air, take no time.
    #[arg(long)]
    as_fast_as_possible: bool,
    #[command(flatten)]
    line: LineArguments,
}

/// Works as the controller until SIGTERM, SIGINT or `quit`.
pub(super) fn run(arguments: &Arguments) -> CommandResult {
    // Before any thread is there, so that the signals come to this one and nowhere else.
    let typing = Typing::listen(arguments.line.ends_with_parent)?;
    let baud = (!arguments.as_fast_as_possible).then_some(BAUD);
    let emulator = Emulator::start(EmulatorOptions {
        world: arguments.world.clone(),
        sensors_off: arguments.sensors_off,
        line: arguments.line.at(baud),
    })?;
    let drives = match &arguments.world {
        Some(socket) => format!("the arm of the world at {}", socket.display()),
        None => "an arm of air".to_owned(),
    };
    announce("Dobot Magician", emulator.status().port.as_deref(), baud, &drives)?;
    work(typing, emulator, status)
}

fn status(status: Status) -> String {
    let angles = status.angles.map(|angle| format!("{angle:.3}")).join(",");
    let alarms: Vec<String> = status.alarms.iter().map(|code| format!("0x{code:02x}")).collect();
    let alarms = if alarms.is_empty() { "none".to_owned() } else { alarms.join(",") };
    let moves = if status.moving { "moving" } else { "at rest" };
    format!("{} joints {angles} {moves} index {} alarms {alarms}", port_in_words(status.port), status.index)
}

fn four_angles(text: &str) -> Result<[f64; 4], String> {
    let angles: Result<Vec<f64>, _> = text.split(',').map(|angle| angle.trim().parse()).collect();
    let angles = angles.ok().and_then(|angles| <[f64; 4]>::try_from(angles).ok());
    let angles = angles.filter(|angles| angles.iter().all(|angle| angle.abs() <= MOST_OFF_DEG));
    angles.ok_or_else(|| {
        format!("give four angles in degrees, within {MOST_OFF_DEG} either way, such as 0,1.2,-0.8,0")
    })
}
