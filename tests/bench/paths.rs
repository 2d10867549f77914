//! The same initialization of a worn arm over both ways to it: the simulated robot, and the serial driver with an emulated controller.
//!
//! Each seed leaves the arm elsewhere and draws other noise; both ways meet the same worlds.

use std::error::Error;
use std::fs;
use std::process::{Command, Stdio};
use std::time::Instant;

use plumb_simulated::client::WorldClient;
use plumb_simulated::protocol::WorldCommand;
use serde_json::Value;

use crate::parts::Cells;
use crate::statistics::mean_and_spread;
use crate::{LONG, Measured};

const WAYS: [(&str, &str); 2] = [("simulated", "cell.yaml"), ("serial", "cell-serial.yaml")];

const JOINTS: [&str; 3] = ["waist", "shoulder", "elbow"];

/// How far from where the operator meant to leave it the arm may be.
const LEFT_WITHIN: &str = "    start_within: {waist_deg: 2, shoulder_deg: 1.5, elbow_deg: 3}\n";

/// What one way found: the errors of the zeros by joint, deg, and the runs that found none.
#[derive(Default)]
struct Found {
    errors_deg: [Vec<f64>; 3],
    failures: Vec<String>,
}

pub(crate) fn measure(seeds: usize) -> Measured {
    let cells = Cells::new()?;
    cells.edit("world-worn.yaml", "    zero_error:", &format!("{LEFT_WITHIN}    zero_error:"))?;
    for (_, cell) in WAYS {
        cells.edit(cell, "world-ideal.yaml", "world-worn.yaml")?;
    }
    let worn = fs::read_to_string(cells.path("world-worn.yaml"))?;
    let mut found = [Found::default(), Found::default()];
    for seed in 1..=seeds {
        fs::write(cells.path("world-worn.yaml"), worn.replace("seed: 1\n", &format!("seed: {seed}\n")))?;
        let truth = true_zeros(&cells)?;
        for (found, (_, cell)) in found.iter_mut().zip(WAYS) {
            match zeros(&cells, cell)? {
                Ok(zeros) => {
                    for ((errors, zero), truth) in found.errors_deg.iter_mut().zip(zeros).zip(truth) {
                        errors.push(zero - truth);
                    }
                }
                Err(why) => found.failures.push(format!("seed {seed}: {why}")),
            }
        }
    }
    print(seeds, &found);
    Ok(())
}

/// By how much the truth is beyond what the controller believes, where the operator left the arm.
fn true_zeros(cells: &Cells) -> Result<[f64; 3], Box<dyn Error>> {
    let socket = cells.path("look.socket");
    let mut command: Command =
        cells.plumb(&["world", "--file", "world-worn.yaml", "--pace", "fast", "--socket"]);
    let mut world = command.arg(&socket).stdin(Stdio::null()).spawn()?;
    let began = Instant::now();
    let mut client = loop {
        match WorldClient::connect(&socket, "bench") {
            Ok(client) => break client,
            Err(error) if began.elapsed() > LONG => return Err(error.into()),
            Err(_) => std::thread::sleep(std::time::Duration::from_millis(2)),
        }
    };
    let there = client.look()?;
    let (truth, believed) = (there.attitudes, there.counted);
    client.call(WorldCommand::Shutdown {}, || false, |_| ())?;
    world.wait()?;
    let mut zeros = [0.0; 3];
    for ((zero, truth), believed) in zeros.iter_mut().zip(truth).zip(believed) {
        *zero = (truth - believed).to_degrees();
    }
    Ok(zeros)
}

/// The zeros that a run put in force, deg; or why it put none.
fn zeros(cells: &Cells, cell: &str) -> Result<Result<[f64; 3], String>, Box<dyn Error>> {
    // A record of its own: every run begins with an arm that nobody has initialized.
    let record = tempfile::tempdir()?;
    let mut command = cells.plumb(&["run", cell, "initialize", "--json", "--record"]);
    let output = command.arg(record.path()).stdin(Stdio::null()).output()?;
    let (mut zeros, mut last) = ([f64::NAN; 3], String::new());
    for line in String::from_utf8(output.stdout)?.lines() {
        let event: Value = serde_json::from_str(line)?;
        if event["event"] == "correction_applied" {
            let index = JOINTS.iter().position(|joint| event["correction"]["place"] == *joint);
            if let Some(zero) = index.and_then(|index| zeros.get_mut(index)) {
                *zero = event["correction"]["new"].as_f64().unwrap_or(f64::NAN);
            }
        }
        last = event["message"].as_str().unwrap_or_default().to_owned();
    }
    Ok(if output.status.success() { Ok(zeros) } else { Err(last) })
}

fn print(seeds: usize, found: &[Found; 2]) {
    let [simulated, serial] = found;
    println!(
        "error of the zeros found, deg: mean +- spread of single runs; in the last column the difference of the means in standard errors"
    );
    println!("{:<10}{:>24}{:>24}{:>24}", "", "simulated", "serial", "difference");
    for (joint, (ours, theirs)) in JOINTS.iter().zip(simulated.errors_deg.iter().zip(&serial.errors_deg)) {
        let ((mean, spread), (other_mean, other_spread)) = (mean_and_spread(ours), mean_and_spread(theirs));
        let error = (spread.powi(2) / ours.len() as f64 + other_spread.powi(2) / theirs.len() as f64).sqrt();
        println!(
            "{joint:<10}{:>24}{:>24}{:>24}",
            format!("{mean:+.4} +- {spread:.4}"),
            format!("{other_mean:+.4} +- {other_spread:.4}"),
            format!("{:+.4} ({:.1})", other_mean - mean, (other_mean - mean).abs() / error),
        );
    }
    for ((way, _), found) in WAYS.iter().zip(found) {
        println!("{way}: {} of {seeds} runs found zeros", seeds - found.failures.len());
        found.failures.iter().take(5).for_each(|why| println!("  {why}"));
    }
}
