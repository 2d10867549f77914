//! Hours of work at the fast pace, while memory, handles and shared memory of the program and its hosts are looked at:
//!
//! ```text
//! cargo bench -p plumb --profile dev --bench soak -- 10
//! ```
//!
//! The number is how many hours of the simulated arm's own time; 10 if left out. The arm looks for the edge of its target again and again: moves,
//! searches, readings, rows of the record. Each run is one process of as many turns as a plan may have. Flat means, of every process:
//!
//! - memory: the median of the last quarter of a run is at most [`MOST_GROWTH`] above that of its second quarter (the first fills caches),
//! - handles and threads: the median of the last quarter is not above that of the second (one more is open for a moment now and then),
//! - shared memory of the cell: likewise, byte for byte.
//!
//! Ends with 1 when anything grew.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    dead_code,
    reason = "shared with the tests of whole runs"
)]

#[path = "run/lab.rs"]
mod lab;

use std::collections::BTreeMap;
use std::fs;
use std::process::ExitCode;
use std::time::{Duration, Instant};

use lab::{Lab, Running, hosts_of};
use plumb_cell::device::CellResources;
use plumb_simulated::client::WorldClient;
use plumb_simulated::protocol::WorldCommand;

/// Turns of a run: each is two steps, its beginning and its end, and a plan has at most 20,000.
const TURNS: usize = 4900;

/// kB. Less is what an allocator keeps or gives back by chance; of a leak of 100 bytes a turn in half a run this is the half.
const MOST_GROWTH: u64 = 500;

/// Looks a run, about.
const LOOKS: usize = 200;

const PROCEDURE: &str = "\
procedure: soak
finds_zeros: [arm]
steps:
  - id: lower
    do: {search: {robot: arm, joint: shoulder, travel_deg: -40, until: {sensor: eye, is: on}, fast: {chunk_deg: 1, speed: 1}, slow: {chunk_deg: 0.25, speed: 0.2}, back_off_deg: 2}}
    time_limit_s: 300
  - {id: press, do: {move: {robot: arm, by_deg: {shoulder: -0.6}, speed: 0.2}}}
  - id: turns
    do:
      repeat:
        times: TURNS
        steps:
          - id: find
            do: {search: {robot: arm, joint: waist, travel_deg: -30, until: {sensor: eye, is: off}, finds: {on: line_a}, fast: {chunk_deg: 1, speed: 0.6}, slow: {chunk_deg: 0.25, speed: 0.2}, back_off_deg: 2}}
            time_limit_s: 300
          - {id: back, do: {move: {robot: arm, by_deg: {waist: 8}}}}
";

/// What one process holds: memory kB, handles, threads.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Holds {
    memory: u64,
    handles: u64,
    threads: u64,
}

/// One look at everything.
struct Look {
    processes: BTreeMap<String, Holds>,
    shared: u64,
}

fn main() -> ExitCode {
    let hours: f64 = std::env::args().skip(1).find_map(|text| text.parse().ok()).unwrap_or(10.0);
    let lab = Lab::new();
    lab.write("procedures/soak.yaml", &PROCEDURE.replace("TURNS", &TURNS.to_string()));
    lab.edit("cell.yaml", "procedures: [", "procedures: [procedures/soak.yaml, ");
    let (mut simulated, mut runs, mut flat) = (Duration::ZERO, 0, true);
    let begin = Instant::now();
    while simulated.as_secs_f64() < hours * 3600.0 {
        let (time, looks) = run(&lab);
        simulated += time;
        runs += 1;
        println!(
            "run {runs}: {:.2} h of the arm's time, {:.2} h so far in {:.0} s, {} looks",
            time.as_secs_f64() / 3600.0,
            simulated.as_secs_f64() / 3600.0,
            begin.elapsed().as_secs_f64(),
            looks.len()
        );
        flat &= is_flat(&looks);
    }
    println!("{}", if flat { "flat" } else { "NOT FLAT" });
    if flat { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// One run; the arm's time it took, and what was held on the way.
fn run(lab: &Lab) -> (Duration, Vec<Look>) {
    let mut running = lab.start(&["run", "cell.yaml", "soak", "--pace", "fast", "--answers", "answers.yaml"]);
    let mut looks = Vec::new();
    // The world's clock does not begin at 0.
    let (mut turns, mut begun, mut time) = (0_usize, None, Duration::ZERO);
    while let Some(event) = running.event() {
        if event["event"] == "step_finished"
            && event["step"].as_str().is_some_and(|step| step.ends_with(".back"))
        {
            turns += 1;
            if turns.is_multiple_of(TURNS / LOOKS) {
                looks.push(look(lab, &running));
                if let Some(now) = world_time(lab) {
                    time = now.saturating_sub(*begun.get_or_insert(now));
                }
            }
        }
    }
    let (last, code) = running.end();
    assert_eq!(code, Some(0), "the run: {last}");
    (time, looks)
}

fn world_time(lab: &Lab) -> Option<Duration> {
    let socket = CellResources::of_cell(&lab.path("cell.yaml")).unwrap().world_socket();
    let reading = WorldClient::connect(&socket, "soak").ok()?.read(WorldCommand::Read {}).ok()?;
    Some(Duration::from_nanos(reading.time_ns))
}

fn look(lab: &Lab, running: &Running) -> Look {
    let program = running.process();
    let mut processes = BTreeMap::new();
    let mut hosts = hosts_of(program);
    hosts.sort_unstable();
    processes.extend(holds(program).map(|holds| ("the program".to_owned(), holds)));
    for (index, host) in hosts.into_iter().enumerate() {
        processes.extend(holds(host).map(|holds| (format!("host {}", index + 1), holds)));
    }
    Look { processes, shared: shared_memory(lab) }
}

fn holds(process: u32) -> Option<Holds> {
    let status = fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let number = |key: &str| {
        let line = status.lines().find_map(|line| line.strip_prefix(key))?;
        line.split_whitespace().next()?.parse::<u64>().ok()
    };
    let handles = fs::read_dir(format!("/proc/{process}/fd")).ok()?.count() as u64;
    Some(Holds { memory: number("VmRSS:")?, handles, threads: number("Threads:")? })
}

/// Bytes of the cell's files in shared memory.
fn shared_memory(lab: &Lab) -> u64 {
    let resources = CellResources::of_cell(&lab.path("cell.yaml")).unwrap();
    let name = resources.domain().root().file_name().unwrap().to_str().unwrap().to_owned();
    let number = name.strip_prefix("plumb-cell-").unwrap().to_owned();
    let entries = fs::read_dir("/dev/shm").unwrap().flatten();
    let own = entries.filter(|entry| entry.file_name().to_string_lossy().contains(&number));
    own.filter_map(|entry| entry.metadata().ok())
        .filter(|known| known.is_file())
        .map(|known| known.len())
        .sum()
}

/// Compares the last quarter of the looks with the second, and prints a line for each process.
fn is_flat(looks: &[Look]) -> bool {
    let quarter = looks.len() / 4;
    let (second, last) = (&looks[quarter..2 * quarter], &looks[looks.len() - quarter..]);
    let mut flat = true;
    let names: Vec<&String> = looks.first().map(|look| look.processes.keys().collect()).unwrap_or_default();
    for name in names {
        let of = |looks: &[Look], what: fn(&Holds) -> u64| {
            let mut all: Vec<u64> =
                looks.iter().filter_map(|look| look.processes.get(name)).map(what).collect();
            all.sort_unstable();
            all
        };
        let median =
            |looks: &[Look], what: fn(&Holds) -> u64| of(looks, what).get(quarter / 2).copied().unwrap_or(0);
        let both = |what: fn(&Holds) -> u64| (median(second, what), median(last, what));
        let (before, after) = both(|holds| holds.memory);
        let handles = both(|holds| holds.handles);
        let threads = both(|holds| holds.threads);
        let good = after <= before + MOST_GROWTH && handles.1 <= handles.0 && threads.1 <= threads.0;
        println!(
            "  {name}: memory {before} -> {after} kB, handles {} -> {}, threads {} -> {}{}",
            handles.0,
            handles.1,
            threads.0,
            threads.1,
            if good { "" } else { "  GREW" }
        );
        flat &= good;
    }
    let most = |looks: &[Look]| looks.iter().map(|look| look.shared).max().unwrap_or(0);
    let (before, after) = (most(second), most(last));
    println!("  shared memory {before} -> {after} bytes{}", if after <= before { "" } else { "  GREW" });
    flat && after <= before
}
