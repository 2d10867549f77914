//! Waiting for the moment of a fault, and what is the same in many rows.

use std::time::{Duration, Instant};

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use serde_json::Value;

use crate::lab::{CommandOutput, Lab, PATIENCE, Running};

pub(crate) fn signal(process: u32, signal: Signal) {
    kill(Pid::from_raw(process.cast_signed()), signal).unwrap();
}

pub(crate) fn until(what: &str, mut so: impl FnMut() -> bool) {
    let begin = Instant::now();
    while !so() {
        assert!(begin.elapsed() < PATIENCE, "{what} did not come");
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// A run of the TeachMover's cell at its real pace that moves in this step.
pub(crate) fn moving_in(lab: &Lab, step: &str) -> Running {
    let mut running = lab.start(&["run", "cell.yaml", "--pace", "real"]);
    running.until_moving_in(step);
    running
}

/// The end of a run that is stuck, and how long it took from now, s.
pub(crate) fn end_of(running: Running) -> (Value, Option<i32>, f64) {
    let begin = Instant::now();
    let (last, code) = running.end();
    (last, code, begin.elapsed().as_secs_f64())
}

/// The message of a last event.
pub(crate) fn message(last: &Value) -> String {
    last["message"].as_str().unwrap_or_default().to_owned()
}

/// Resumes run 1 at the fast pace, and wants it to pass with the true zeros.
pub(crate) fn resume(lab: &Lab) -> CommandOutput {
    let resumed = lab.plumb(&["run", "--resume", "1", "--headless", "--pace", "fast"]);
    assert_eq!(resumed.code(), 0, "--resume: {}", resumed.all());
    lab.assert_zeros_found("1");
    assert_sound(lab);
    resumed
}

pub(crate) fn assert_sound(lab: &Lab) {
    let check = lab.plumb(&["record", "check"]);
    assert_eq!(check.code(), 0, "the record: {}", check.all());
}
