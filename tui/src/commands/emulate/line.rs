//! What all emulated controllers have in common: a line, and somebody who types what happens to them.

use std::fmt::Display;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::str::FromStr;

use plumb_simulated::emulate::val2::{Fault, LineOptions};
use plumb_simulated::emulate::{Controls, Emulator};

use super::typed::Typing;
use crate::failure::CommandResult;

/// How the line is, besides its rate.
#[derive(clap::Args)]
pub(super) struct LineArguments {
    /// Ends when the program that started it ends, however that ends.
    #[arg(long, hide = true)]
    pub(super) ends_with_parent: bool,
    /// Make a link to the port here, and take it away at the end.
    #[arg(long, value_name = "PATH")]
    link: Option<PathBuf>,
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

impl LineArguments {
    /// The line at a rate; `None` for one that takes no time.
    pub(super) fn at(&self, baud: Option<u32>) -> LineOptions {
        LineOptions {
            baud,
            link: self.link.clone(),
            seed: self.seed,
            faults: self.fault.clone(),
            fault_probability: self.fault_rate,
        }
    }
}

/// Prints the port's path alone on the first line, for scripts; all else goes to standard error.
pub(super) fn announce(
    controller: &str,
    port: Option<&Path>,
    baud: Option<u32>,
    drives: &str,
) -> io::Result<()> {
    let port = port.unwrap_or(Path::new("")).display();
    let mut output = io::stdout();
    writeln!(output, "{port}")?;
    output.flush()?;
    let rate = baud.map_or("as fast as it can".to_owned(), |baud| format!("{baud} baud"));
    eprintln!("{controller} on {port} ({rate}), driving {drives}");
    Ok(())
}

/// Lets the controller work until SIGTERM, SIGINT or `quit`; `status` is what it says of itself when asked.
pub(super) fn work<C>(
    mut typing: Typing,
    mut emulator: Emulator<C>,
    status: impl Fn(C::Status) -> String,
) -> CommandResult
where
    C: Controls,
    C::Event: FromStr<Err: Display>,
{
    while emulator.is_working() {
        let Some(lines) = typing.next()? else { break };
        for line in lines {
            match line.trim() {
                "" => {}
                "quit" => return end(emulator),
                "status" => {
                    let mut output = io::stdout();
                    writeln!(output, "{}", status(emulator.status()))?;
                    output.flush()?;
                }
                line => match line.parse::<C::Event>() {
                    Ok(event) => emulator.inject(event),
                    Err(error) => eprintln!("{error}"),
                },
            }
        }
    }
    end(emulator)
}

/// The port in the words of `status`.
pub(super) fn port_in_words(port: Option<PathBuf>) -> String {
    port.map_or("unplugged".to_owned(), |port| port.display().to_string())
}

fn end<C: Controls>(emulator: Emulator<C>) -> CommandResult {
    emulator.stop()?;
    Ok(ExitCode::SUCCESS)
}

fn probability(text: &str) -> Result<f64, String> {
    let probability = text.parse().ok().filter(|probability| (0.0..=1.0).contains(probability));
    probability.ok_or_else(|| "give a probability from 0 to 1".to_owned())
}
