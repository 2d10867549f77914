//! Kills unattended runs of the TeachMover cell at random moments, first the program, then the host of a device, and prints what came of it:
//!
//! ```text
//! cargo bench --workspace --profile dev --bench kill_campaign -- 200
//! ```
//!
//! The number is how many of each; 200 if left out. Ends with 1 when anything was wrong.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    dead_code,
    reason = "shared with the tests of whole runs"
)]

#[path = "run/campaign.rs"]
mod campaign;
#[path = "run/lab.rs"]
mod lab;

use std::process::ExitCode;

use campaign::{Victim, campaign};

fn main() -> ExitCode {
    let kills = std::env::args().skip(1).find_map(|argument| argument.parse().ok()).unwrap_or(200);
    let mut all_right = true;
    for (victim, name) in [(Victim::Orchestrator, "the program"), (Victim::Host, "a device's host")] {
        let figures = campaign(victim, kills, 2026, |done| eprint!("\r{done} of {kills} "));
        eprintln!();
        println!("{name} killed with -9:\n{figures}");
        all_right &= figures.wrong.is_empty();
    }
    if all_right { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
