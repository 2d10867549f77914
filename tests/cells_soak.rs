//! Many simulated cells at work for long on one machine, each with its shipper, while shippers, pages and the database are killed with -9 and the network
//! is cut at random; then the time of a run beside a shipper over that without one:
//!
//! ```text
//! cargo bench --workspace --profile dev --bench cells_soak -- --cells 20 --seconds 3600 --every 20 --pairs 600
//! ```
//!
//! Each number may be left out, and is then that one. `--every` is how many seconds after its last run began a cell begins its next; with 0 one run follows the
//! other, and the machine has nothing left for anybody else. `--cells 0` leaves the soak out, `--pairs 0` the comparison. It wants PostgreSQL, openssl, and root
//! for the network. Ends with 1 when a row was lost or doubled, when a run did not pass, or when the database was more than two seconds behind where nothing was
//! broken, or nobody could see whether it was.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    dead_code,
    reason = "shared with the tests of many cells"
)]

#[path = "central/both_sides.rs"]
mod both_sides;
#[path = "central/certificates.rs"]
mod certificates;
#[path = "central/cycle.rs"]
mod cycle;
#[path = "run/lab.rs"]
mod lab;
#[path = "central/network.rs"]
mod network;
#[path = "central/server.rs"]
mod server;
#[path = "central/soak.rs"]
mod soak;
#[path = "central/wait.rs"]
mod wait;

use std::process::ExitCode;
use std::time::Duration;

use both_sides::both_sides;
use cycle::cycle_ratio;
use soak::{Plan, soak};

/// What was asked for.
#[derive(Debug)]
struct Asked {
    cells: u64,
    seconds: u64,
    every: u64,
    pairs: u64,
}

impl Asked {
    fn read(mut words: impl Iterator<Item = String>) -> Result<Self, String> {
        let mut asked = Self { cells: 20, seconds: 3600, every: 20, pairs: 600 };
        while let Some(word) = words.next() {
            let number = match word.as_str() {
                // Cargo's own.
                "--bench" => continue,
                "--cells" => &mut asked.cells,
                "--seconds" => &mut asked.seconds,
                "--every" => &mut asked.every,
                "--pairs" => &mut asked.pairs,
                _ => {
                    return Err(format!(
                        "`{word}` is not known: --cells, --seconds, --every and --pairs are"
                    ));
                }
            };
            let value = words.next().ok_or_else(|| format!("{word} needs a number"))?;
            *number =
                value.parse().map_err(|_| format!("{word} {value}: write a whole number, 0 or more"))?;
        }
        Ok(asked)
    }
}

fn main() -> ExitCode {
    let asked = match Asked::read(std::env::args().skip(1)) {
        Ok(asked) => asked,
        Err(reason) => {
            eprintln!("cells_soak: {reason}");
            return ExitCode::from(2);
        }
    };
    let mut sound = true;
    if asked.cells > 0 {
        let plan = Plan {
            cells: asked.cells as usize,
            time: Duration::from_secs(asked.seconds),
            every: Duration::from_secs(asked.every),
            between_failures: Duration::from_secs(10),
            seed: 2026,
        };
        let Some(figures) = soak(plan) else { return ExitCode::FAILURE };
        println!("{figures}");
        sound = figures.is_sound();
    }
    if asked.pairs > 0
        && let Some(ratio) = cycle_ratio(asked.pairs as usize)
    {
        println!("{ratio}");
    }
    if sound { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
