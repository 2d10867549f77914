//! The figures of the driver's page of the manual, made at the terminal of the emulated controller:
//!
//! ```text
//! cargo bench -p plumb-puma --profile dev --bench terminal -- poses 16             time per pose, and where it goes
//! cargo bench -p plumb-puma --profile dev --bench terminal -- stops 90             stops, from the wish to the wire, and how far the arm still goes
//! cargo bench -p plumb-puma --profile dev --bench terminal -- conversations 10000  conversations over bad lines; ends with 1 if anything was wrong; a second number is the first seed
//! ```

#![allow(clippy::unwrap_used, clippy::panic, dead_code, reason = "shared with the tests")]

mod terminal;

use std::io::Write as _;
use std::process::ExitCode;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use terminal::{conversations, poses, stops};

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|argument| argument != "--bench").collect();
    let number_at = |index: usize, default: u64| {
        arguments.get(index).and_then(|argument| argument.parse().ok()).unwrap_or(default)
    };
    let number = |default: u64| number_at(1, default);
    match arguments.first().map(String::as_str) {
        Some("poses") => time_poses(number(16)),
        Some("stops") => make_stops(number(90)),
        Some("conversations") => return hold_conversations(number(10_000), number_at(2, 1)),
        _ => {
            eprintln!("say which figures: poses, stops or conversations, and a number");
            return ExitCode::from(2);
        }
    }
    ExitCode::SUCCESS
}

fn time_poses(count: u64) {
    println!(
        "| typing, controller | commands | characters out, in | line | controller | motion | driver | a pose without motion | the line's own | times |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    for row in poses::timed(u32::try_from(count).unwrap_or(16)) {
        println!("{row}");
    }
}

fn make_stops(count: u64) {
    let stops = stops::made(usize::try_from(count).unwrap_or(90));
    let mut after: Vec<Duration> = stops.iter().map(|stop| stop.after).collect();
    after.sort();
    let within = after.iter().filter(|after| after.as_millis() <= 100).count();
    let at = |fraction: f64| after[((after.len() - 1) as f64 * fraction) as usize].as_secs_f64() * 1e3;
    println!(
        "{} stops; the control C on the far end of the wire after: median {:.0} ms, 95 % {:.0} ms, most {:.0} ms; {within} within 100 ms",
        after.len(),
        at(0.5),
        at(0.95),
        at(1.0)
    );
    for speed in stops::SPEEDS {
        let went: Vec<f64> =
            stops.iter().filter(|stop| stop.speed == speed).map(|stop| stop.went_deg).collect();
        let least = went.iter().copied().fold(f64::INFINITY, f64::min);
        let most = went.iter().copied().fold(0.0, f64::max);
        println!(
            "at {:.0} % of full speed the waist still went {least:.1} to {most:.1} degrees",
            speed * 100.0
        );
    }
}

fn hold_conversations(count: u64, first: u64) -> ExitCode {
    let (begun, done) = (Instant::now(), AtomicU64::new(0));
    let held = conversations::hold(first..=first + count - 1, 12, || {
        let done = done.fetch_add(1, Ordering::Relaxed) + 1;
        if done.is_multiple_of(100) {
            eprint!("\r{done} of {count} ");
            let _ = std::io::stderr().flush();
        }
    });
    eprintln!();
    println!(
        "{} conversations, {} poses, in {:.0} s: {} errors reported, each recovered from; wrong: {}",
        held.conversations,
        held.poses,
        begun.elapsed().as_secs_f64(),
        held.errors,
        held.wrong.len()
    );
    held.wrong.iter().for_each(|wrong| println!("  {wrong}"));
    if held.wrong.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
