//! `plumb emulate teachmover`.

use std::io::{self, Read, Write};
use std::os::fd::AsFd;
use std::path::PathBuf;
use std::process::ExitCode;

use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use nix::sys::signal::{SigSet, Signal};
use nix::sys::signalfd::{SfdFlags, SignalFd};
use plumb_simulated::emulate::teachmover::{
    BareMotors, Emulator, EmulatorOptions, Event, Fault, Motors, MotorsInWorld,
};

use crate::failure::CommandResult;

/// How often the controller is asked whether it still works, ms.
const LOOK: u16 = 200;

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
    #[arg(long, default_value_t = 0.0, value_name = "PROBABILITY", value_parser = probability)]
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
    if arguments.ends_with_parent {
        nix::sys::prctl::set_pdeathsig(Signal::SIGTERM)?;
    }
    // Before any thread is there, so that the signals come here and nowhere else.
    let mut signals = SigSet::empty();
    signals.add(Signal::SIGTERM);
    signals.add(Signal::SIGINT);
    signals.thread_block()?;
    let signals = SignalFd::with_flags(&signals, SfdFlags::SFD_CLOEXEC)?;
    let mut emulator = Emulator::start(options(arguments), motors(arguments)?)?;
    announce(arguments, &emulator)?;
    let mut input = Some(io::stdin());
    let mut typed = Vec::new();
    while emulator.is_working() {
        let ready = wait(&signals, input.as_ref())?;
        if ready.signal {
            break;
        }
        if ready.input && !read_some(&mut typed)? {
            // Whoever started it has nothing more to type; it works on.
            input = None;
        }
        for line in whole_lines(&mut typed) {
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

struct Ready {
    signal: bool,
    input: bool,
}

fn wait(signals: &SignalFd, input: Option<&io::Stdin>) -> Result<Ready, nix::Error> {
    let mut polled = vec![PollFd::new(signals.as_fd(), PollFlags::POLLIN)];
    if let Some(input) = input {
        polled.push(PollFd::new(input.as_fd(), PollFlags::POLLIN));
    }
    match poll(&mut polled, PollTimeout::from(LOOK)) {
        Ok(_) | Err(nix::Error::EINTR) => {}
        Err(error) => return Err(error),
    }
    let ready = |place: usize| polled.get(place).and_then(PollFd::any).unwrap_or(false);
    Ok(Ready { signal: ready(0), input: ready(1) })
}

/// Adds what was typed; `false` at the end of the input.
fn read_some(typed: &mut Vec<u8>) -> io::Result<bool> {
    let mut bytes = [0; 1024];
    // Not through a buffer: what it held back would not be waited for.
    let count = io::stdin().lock().read(&mut bytes)?;
    typed.extend_from_slice(bytes.get(..count).unwrap_or_default());
    Ok(count > 0)
}

fn whole_lines(typed: &mut Vec<u8>) -> Vec<String> {
    let Some(end) = typed.iter().rposition(|byte| *byte == b'\n') else { return Vec::new() };
    let lines: Vec<u8> = typed.drain(..=end).collect();
    String::from_utf8_lossy(&lines).lines().map(str::to_owned).collect()
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

fn probability(text: &str) -> Result<f64, String> {
    let probability = text.parse().ok().filter(|probability| (0.0..=1.0).contains(probability));
    probability.ok_or_else(|| "give a probability from 0 to 1".to_owned())
}
