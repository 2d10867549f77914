//! What plumb costs, beside its peers: one command, everything measured in one run.
//!
//! ```console
//! $ cargo bench --workspace --bench figures              # everything, a few minutes
//! $ cargo bench --workspace --bench figures -- stop      # or: request, stream, frames, start, steps, parsers, paths
//! $ cargo bench --workspace --bench figures -- paths 200 # with a count of one's own
//! ```
//!
//! Run it on a machine that has nothing else to do. A single core shared by all processes is itself a condition of the figures, and printed.

#![allow(clippy::print_stdout, reason = "its tables are what it is for")]

mod frames;
mod parsers;
mod parts;
mod paths;
mod request;
mod start;
mod statistics;
mod steps;
mod stop;
mod stop_key;
mod stream;

use std::error::Error;
use std::time::Duration;

/// What a measurement gives back.
type Measured = Result<(), Box<dyn Error>>;

/// A measurement: its name, what it measures, how often unless specified otherwise, and how.
type Row = (&'static str, &'static str, usize, fn(usize) -> Measured);

const MEASUREMENTS: [Row; 8] = [
    ("request", "a request to a plugin and back, beside raw iceoryx2", 4000, request::measure),
    ("stream", "a state stream of 1 kHz, messages", 10_000, stream::measure),
    (
        "frames",
        "from a camera's frame to points on another process's subscriber, frames",
        20_000,
        frames::measure,
    ),
    ("stop", "from a stop to the last half-step at 9600 baud, stops each", 100, stop::measure),
    ("start", "from `plumb run` to the first motion, runs each", 100, start::measure),
    ("steps", "steps of a procedure a second, beside OpenHTF, steps", 500, steps::measure),
    ("parsers", "what reads the controllers' answers, fed with damaged ones, seconds", 60, parsers::measure),
    ("paths", "the same initialization over two ways to a worn arm, seeds", 20, paths::measure),
];

fn main() -> Measured {
    // `cargo bench` adds a flag of its own.
    let arguments: Vec<String> = std::env::args().skip(1).filter(|argument| argument != "--bench").collect();
    if let [role, rest @ ..] = arguments.as_slice()
        && role == request::RAW_SERVER
    {
        return request::serve_raw(rest);
    }
    let expected = arguments.first().map(String::as_str);
    if let Some(name) = expected.filter(|name| MEASUREMENTS.iter().all(|row| row.0 != *name)) {
        let names: Vec<&str> = MEASUREMENTS.iter().map(|row| row.0).collect();
        return Err(format!("there is no measurement `{name}`; there are {}", names.join(", ")).into());
    }
    let count = arguments.get(1).map(|count| count.parse::<usize>()).transpose()?;
    parts::build_steady_robot()?;
    println!("{}", parts::machine());
    for (name, what, usual, measure) in MEASUREMENTS {
        if expected.is_none_or(|expected| expected == name) {
            let count = count.unwrap_or(usual).max(1);
            println!("\n{name}: {what}, {count}");
            measure(count)?;
        }
    }
    Ok(())
}

/// Longer than anything here takes.
const LONG: Duration = Duration::from_secs(120);
