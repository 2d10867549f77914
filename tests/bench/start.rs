//! From `plumb run` to the first motion, and where the time goes.

use std::io::{BufRead as _, BufReader};
use std::process::Stdio;
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::Measured;
use crate::parts::Cells;
use crate::statistics::{ms, quantile};

/// What is waited for on the way: its name, and whether an event is the first of it, given where the arm stood at the beginning.
type Mark = (&'static str, fn(&Value, &Value) -> bool);

const MARKS: [Mark; 4] = [
    ("the run is in the record", |event, _| event["event"] == "run_started"),
    ("every device is ready", |event, _| event["event"] == "planned"),
    ("the first step begins", |event, _| event["event"] == "step_started"),
    ("the first motion", |event, stood| event["event"] == "joints" && event["joints"] != *stood),
];

/// Folder, cell and procedure: the simulated driver, and both serial drivers.
const STARTS: [(&str, &str, &str); 3] = [
    ("teachmover", "cell.yaml", "initialize"),
    ("teachmover", "cell-serial.yaml", "initialize"),
    ("puma", "cell-serial.yaml", "calibrate"),
];

pub(crate) fn measure(count: usize) -> Measured {
    for (folder, cell, procedure) in STARTS {
        let cells = Cells::of(folder)?;
        let mut times: Vec<Vec<Duration>> = vec![Vec::new(); MARKS.len()];
        for _ in 0..count {
            for (times, time) in times.iter_mut().zip(first_motion(&cells, cell, procedure)?) {
                times.extend(time);
            }
        }
        println!("{:<34}{:>12}{:>12}{:>12}", format!("{folder}/{cell}"), "median", "95 %", "worst");
        for ((name, _), times) in MARKS.iter().zip(&mut times) {
            let [median, most, worst] = [0.5, 0.95, 1.0].map(|share| ms(quantile(times, share)));
            println!("  {name:<32}{median:>9.0} ms{most:>9.0} ms{worst:>9.0} ms");
        }
    }
    println!("aim: 500 ms");
    Ok(())
}

/// When each mark was reached, from the start of the program; the run is aborted then.
fn first_motion(
    cells: &Cells,
    cell: &str,
    procedure: &str,
) -> Result<Vec<Option<Duration>>, Box<dyn std::error::Error>> {
    let mut reached = vec![None; MARKS.len()];
    let began = Instant::now();
    let mut command = cells.plumb(&["run", cell, procedure, "--json", "--pace", "real"]);
    let mut run = command.stdin(Stdio::null()).stdout(Stdio::piped()).spawn()?;
    let output = run.stdout.take().ok_or("no output")?;
    let mut stood = Value::Null;
    for line in BufReader::new(output).lines() {
        let (event, now) = (serde_json::from_str::<Value>(&line?)?, began.elapsed());
        if stood.is_null() && event["event"] == "joints" {
            stood = event["joints"].clone();
        }
        for (reached, (_, is_it)) in reached.iter_mut().zip(MARKS) {
            if reached.is_none() && is_it(&event, &stood) {
                *reached = Some(now);
            }
        }
        if reached.last().is_some_and(Option::is_some) {
            break;
        }
    }
    nix::sys::signal::kill(
        nix::unistd::Pid::from_raw(i32::try_from(run.id())?),
        nix::sys::signal::Signal::SIGINT,
    )?;
    run.wait()?;
    Ok(reached)
}
