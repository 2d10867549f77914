//! `plumb emulate universal-robots`.

use std::io::{self, Write};
use std::net::IpAddr;
use std::path::PathBuf;
use std::process::ExitCode;

use plumb_simulated::emulate::universal_robots::{Emulator, EmulatorOptions, Event, SERVERS, Series, Status};

use super::typed::Typing;
use crate::failure::CommandResult;

/// The controller of a Universal Robots arm on the network: RTDE, the primary and secondary interface and the dashboard on their own ports, of an address
/// of this computer's own. Prints the address and works until it is asked to end.
///
/// What happens to the controller is typed on standard input, a line each: `protective-stop`, `unlock`, `emergency-stop`, `release`, `fault`,
/// `power off`, `power on`, `local`, `remote`, `stop-program`, `freeze on` (states repeat the last one), `silence on`, `late 800` (states come so
/// many ms late), `cut` (half a state, and the connection ends), `disconnect`, `gone`, `status`, `quit`.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// The socket of the world whose arm it leads.
    #[arg(long, value_name = "SOCKET")]
    world: PathBuf,
    /// Listen at this address; left out, at a free one of 127.64.0.0 to 127.127.255.255.
    #[arg(long, value_name = "IP")]
    address: Option<IpAddr>,
    /// Which generation: cb3, or e.
    #[arg(long, default_value = "e")]
    series: Series,
    /// The highest version of RTDE that it speaks.
    #[arg(long, default_value_t = 2, value_parser = clap::value_parser!(u16).range(1..=2))]
    protocol: u16,
    /// Let motions take no time.
    #[arg(long)]
    as_fast_as_possible: bool,
    /// What chance is drawn from.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Ends when the program that started it ends, however that ends.
    #[arg(long, hide = true)]
    ends_with_parent: bool,
}

/// Works as the controller until SIGTERM, SIGINT or `quit`.
pub(super) fn run(arguments: &Arguments) -> CommandResult {
    // Before any thread is there, so that the signals come to this one and nowhere else.
    let typing = Typing::listen(arguments.ends_with_parent)?;
    let emulator = Emulator::start(&EmulatorOptions {
        world: arguments.world.clone(),
        address: arguments.address,
        series: arguments.series,
        protocol: arguments.protocol,
        fast: arguments.as_fast_as_possible,
        seed: arguments.seed,
    })?;
    let address = emulator.status().address.map_or(String::new(), |address| address.to_string());
    let mut output = io::stdout();
    writeln!(output, "{address}")?;
    output.flush()?;
    let ports = SERVERS.map(|port| port.to_string()).join(", ");
    let world = arguments.world.display();
    eprintln!(
        "Universal Robots controller at {address} (ports {ports}), leading the arm of the world at {world}"
    );
    work(typing, emulator)
}

/// Lets the controller work, and does what is typed.
fn work(mut typing: Typing, mut emulator: Emulator) -> CommandResult {
    while emulator.is_working() {
        let Some(lines) = typing.next()? else { break };
        for line in lines {
            match line.trim() {
                "" => {}
                "quit" => return end(emulator),
                "status" => {
                    let mut output = io::stdout();
                    writeln!(output, "{}", status(&emulator.status()))?;
                    output.flush()?;
                }
                line => match line.parse::<Event>() {
                    Ok(event) => emulator.inject(event),
                    Err(error) => eprintln!("{error}"),
                },
            }
        }
    }
    end(emulator)
}

fn end(emulator: Emulator) -> CommandResult {
    emulator.stop()?;
    Ok(ExitCode::SUCCESS)
}

fn status(status: &Status) -> String {
    let address = status.address.map_or(String::new(), |address| address.to_string());
    let moves = if status.moving { "moving" } else { "at rest" };
    let joints: Vec<String> =
        status.joints.iter().map(|joint| format!("{:.3}", joint.to_degrees())).collect();
    format!("{address} {moves}, {}, {} connected, joints {}", status.modes, status.clients, joints.join(" "))
}
