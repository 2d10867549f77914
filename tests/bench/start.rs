//! From `plumb run` to the first motion, and where the time goes. The motion is seen where it happens, in the world: a controller that says nothing
//! while it moves would otherwise be called slow.

use std::error::Error;
use std::io::{BufRead as _, BufReader};
use std::path::PathBuf;
use std::process::Stdio;
use std::time::{Duration, Instant};

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use plumb_simulated::client::WorldClient;
use plumb_simulated::protocol::WorldCommand;
use serde_json::Value;

use crate::parts::Cells;
use crate::statistics::{ms, quantile};
use crate::{LONG, Measured};

/// Events that are waited for on the way: what each means, and its name in the stream.
const EVENTS: [(&str, &str); 3] = [
    ("the run is in the record", "run_started"),
    ("every device is ready", "planned"),
    ("the first step begins", "step_started"),
];

/// The event after which nothing but the run moves the arm.
const DEVICES_READY: &str = "planned";

/// Folder, cell and procedure: the simulated driver, and both serial drivers.
const STARTS: [(&str, &str, &str); 3] = [
    ("teachmover", "cell.yaml", "initialize"),
    ("teachmover", "cell-serial.yaml", "initialize"),
    ("puma", "cell-serial.yaml", "calibrate"),
];

pub(crate) fn measure(count: usize) -> Measured {
    for (folder, cell, procedure) in STARTS {
        let cells = Cells::of(folder)?;
        let mut times: Vec<Vec<Duration>> = vec![Vec::new(); EVENTS.len() + 1];
        for _ in 0..count {
            for (times, time) in times.iter_mut().zip(first_motion(&cells, cell, procedure)?) {
                times.push(time);
            }
        }
        println!("{:<34}{:>12}{:>12}{:>12}", format!("{folder}/{cell}"), "median", "95 %", "worst");
        let names = EVENTS.iter().map(|(name, _)| *name).chain(["the first motion"]);
        for (name, times) in names.zip(&mut times) {
            let [median, most, worst] = [0.5, 0.95, 1.0].map(|fraction| ms(quantile(times, fraction)));
            println!("  {name:<32}{median:>9.0} ms{most:>9.0} ms{worst:>9.0} ms");
        }
    }
    println!("aim: 500 ms");
    Ok(())
}

/// When each event and the first motion came, from the start of the program; the run is interrupted then.
fn first_motion(cells: &Cells, cell: &str, procedure: &str) -> Result<Vec<Duration>, Box<dyn Error>> {
    let began = Instant::now();
    let mut command = cells.plumb(&["run", cell, procedure, "--json", "--pace", "real"]);
    let mut run = command.stdin(Stdio::null()).stdout(Stdio::piped()).spawn()?;
    let process = Pid::from_raw(i32::try_from(run.id())?);
    let output = run.stdout.take().ok_or("no output")?;
    let mut reached = [None; EVENTS.len()];
    let mut watcher = None;
    // To its end, which the interruption brings: a full pipe would hold the program up.
    for line in BufReader::new(output).lines() {
        let (event, now) = (serde_json::from_str::<Value>(&line?)?, began.elapsed());
        for (reached, (_, name)) in reached.iter_mut().zip(EVENTS) {
            if reached.is_none() && event["event"] == name {
                *reached = Some(now);
            }
        }
        if watcher.is_none() && event["event"] == DEVICES_READY {
            let socket = cells.world_socket(cell)?;
            watcher = Some(std::thread::spawn(move || {
                let moved = until_moved(socket).map_err(|error| error.to_string());
                let elapsed = began.elapsed();
                kill(process, Signal::SIGINT).map_err(|error| error.to_string())?;
                moved.map(|()| elapsed)
            }));
        }
    }
    run.wait()?;
    let watcher = watcher.ok_or("the devices did not become ready")?;
    let moved = watcher.join().map_err(|_| "the watcher panicked")??;
    let reached: Option<Vec<Duration>> = reached.into_iter().chain([Some(moved)]).collect();
    reached.ok_or_else(|| "the run ended before its first step".into())
}

/// Waits until a motor of the world has made a step.
fn until_moved(socket: PathBuf) -> Result<(), Box<dyn Error>> {
    let began = Instant::now();
    let mut world = WorldClient::connect(&socket, "bench")?;
    let before = world.read(WorldCommand::Read {})?.half_steps;
    while world.read(WorldCommand::Read {})?.half_steps == before {
        if began.elapsed() > LONG {
            return Err("the arm does not move".into());
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    Ok(())
}
