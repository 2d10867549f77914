//! Many simulated cells at work for long on one machine, each with its shipper, while shippers, pages and the database are killed with -9 and the network
//! is cut at random; then the time of a run beside a shipper over that without one:
//!
//! ```text
//! cargo bench --workspace --profile dev --bench cells_soak -- 20 3600 300
//! ```
//!
//! The numbers are cells, seconds, and pairs of runs; 20, 3600 and 300 if left out. It wants PostgreSQL, openssl, and root for the network. Ends with 1 when a row
//! was lost or doubled, or when the database was more than two seconds behind where nothing was broken.

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
#[path = "run/lab.rs"]
mod lab;
#[path = "central/network.rs"]
mod network;
#[path = "central/server.rs"]
mod server;
#[path = "central/soak.rs"]
mod soak;

use std::process::ExitCode;
use std::time::Duration;

use both_sides::both_sides;
use soak::{MOST_LAG_S, Plan, cycle_ratio, soak};

fn main() -> ExitCode {
    let mut numbers = std::env::args().skip(1).filter_map(|argument| argument.parse::<usize>().ok());
    let mut next = |usual: usize| numbers.next().unwrap_or(usual);
    let (cells, seconds, pairs) = (next(20), next(3600), next(300));
    let time = Duration::from_secs(seconds as u64);
    let plan = Plan { cells, time, between_failures: Duration::from_secs(10), seed: 2026 };
    let Some(figures) = soak(plan) else { return ExitCode::FAILURE };
    println!("{figures}");
    if pairs > 0
        && let Some(ratio) = cycle_ratio(pairs)
    {
        println!("{ratio}");
    }
    let sound = figures.wrong.is_empty() && figures.most_lag_s() < MOST_LAG_S;
    if sound { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
