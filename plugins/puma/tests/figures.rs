//! The figures of the driver's page of the manual, made at the terminal of the emulated controller:
//!
//! ```text
//! cargo bench -p plumb-puma --profile dev --bench terminal -- poses 16             time per pose, and where it goes
//! cargo bench -p plumb-puma --profile dev --bench terminal -- stops 90             stops, from the wish to the wire, and how far the arm still goes
//! cargo bench -p plumb-puma --profile dev --bench terminal -- conversations 10000  conversations over bad lines; ends with 1 if anything was wrong
//! cargo bench -p plumb-puma --profile dev --bench terminal -- parsers 3600         what reads the line, fed with bytes at random, for so many seconds
//! ```

#![allow(clippy::unwrap_used, clippy::panic, dead_code, reason = "shared with the tests")]

mod terminal;

use std::io::Write as _;
use std::process::ExitCode;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use plumb_puma::reply::{Ending, Reply, sign};
use terminal::{conversations, poses, stops};

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|argument| argument != "--bench").collect();
    let number =
        |default: u64| arguments.get(1).and_then(|argument| argument.parse().ok()).unwrap_or(default);
    match arguments.first().map(String::as_str) {
        Some("poses") => time_poses(number(16)),
        Some("stops") => make_stops(number(90)),
        Some("conversations") => return hold_conversations(number(10_000)),
        Some("parsers") => feed_parsers(Duration::from_secs(number(60))),
        _ => {
            eprintln!("say which figures: poses, stops, conversations or parsers, and a number");
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
    let at = |share: f64| after[((after.len() - 1) as f64 * share) as usize].as_secs_f64() * 1e3;
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

fn hold_conversations(count: u64) -> ExitCode {
    let (begun, done) = (Instant::now(), AtomicU64::new(0));
    let held = conversations::hold(1..=count, 12, || {
        let done = done.fetch_add(1, Ordering::Relaxed) + 1;
        if done.is_multiple_of(100) {
            eprint!("\r{done} of {count} ");
            let _ = std::io::stderr().flush();
        }
    });
    eprintln!();
    println!(
        "{} conversations, {} poses, in {:.0} s: {} errors told, each recovered from; wrong: {}",
        held.conversations,
        held.poses,
        begun.elapsed().as_secs_f64(),
        held.errors,
        held.wrong.len()
    );
    held.wrong.iter().for_each(|wrong| println!("  {wrong}"));
    if held.wrong.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// What a controller may say, cut, joined and damaged.
const SAID: [&[u8]; 12] = [
    b"\r\n    X/JT1    Y/JT2    Z/JT3    O/JT4    A/JT5    T/JT6\r\n",
    b"  -90.000  -180.000   180.000  -100.250     0.000  -135.500\r\n",
    b" -90.00-180.00 180.00-100.25   0.00-135.50  12.00\r\n",
    b"Change? ",
    b"CHANGES?",
    b"Change?\r\0\0\n",
    b"Are you sure (Y/N)? ",
    b"*Joint 3 out of range*\r\n.",
    b"[Fatal] Panic command\r\n.",
    b"\r\nVAL-II  1.4B\r\nLoad VAL from floppy (Y/N)? N\r\n.",
    b"* ",
    b". ",
];

/// A small generator (xorshift).
struct Dice(u64);

impl Dice {
    fn below(&mut self, most: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 16) as usize % most.max(1)
    }
}

fn feed_parsers(duration: Duration) {
    let (begun, mut dice, mut fed, mut rows) = (Instant::now(), Dice(0x2026_1985), 0_u64, 0_u64);
    while begun.elapsed() < duration {
        for _ in 0..1000 {
            let mut bytes = Vec::new();
            for _ in 0..dice.below(6) {
                bytes.extend_from_slice(SAID[dice.below(SAID.len())]);
            }
            for _ in 0..dice.below(8) {
                let (place, byte) = (dice.below(bytes.len()), dice.below(256) as u8);
                match dice.below(4) {
                    0 => bytes.truncate(place),
                    1 => bytes.insert(place, byte),
                    2 if !bytes.is_empty() => drop(bytes.remove(place)),
                    _ => bytes.iter_mut().skip(place).take(1).for_each(|kept| *kept = byte),
                }
            }
            let _ = sign(&bytes);
            let reply = Reply::of(&bytes, Ending::Command);
            let read = reply.rows();
            assert!(read.iter().flatten().all(|number| number.is_finite()), "{bytes:?}");
            let _ = (reply.complaint(), reply.is_greeting());
            (fed, rows) = (fed + 1, rows + read.len() as u64);
        }
    }
    println!(
        "{fed} answers in {:.0} s, {rows} rows of numbers among them, nothing open",
        begun.elapsed().as_secs_f64()
    );
}
