//! Drivers of another language that are killed, hang, or lose plumb; each an arm in Python as `plumb plugins new` makes it, changed.

use std::time::Instant;

use crate::lab::{kill, wait_gone};
use crate::moments::message;
use crate::run_python::{SLOW, cell, driver_of};
use crate::{Happened, Row};

pub(crate) const ROWS: &[&Row] = &[
    &Row {
        name: "driver_killed",
        done: "the process of a driver in Python killed while its arm moves",
        promise: "the run ends with 2 and says how the driver ended",
        happens: killed,
    },
    &Row {
        name: "driver_hangs",
        done: "a driver in Python that never answers when its joints are read",
        promise: "within 20 s the run ends with 2 and names the call, and the driver's process is gone",
        happens: hangs,
    },
    &Row {
        name: "driver_orphaned",
        done: "plumb killed while an arm moves whose driver is in Python",
        promise: "the driver is commanded to stop, and its process ends",
        happens: orphaned,
    },
];

const NO_PYTHON: &str = "there is no python3";

fn killed() -> Happened {
    let Some(lab) = cell(&SLOW) else { return Happened::PassedOver(NO_PYTHON.to_owned()) };
    let mut running = lab.start(&["run", "cell-py.yaml"]);
    running.until_moving_in("out");
    kill(driver_of(&lab).unwrap());
    let (last, code) = running.end();
    assert_eq!(code, Some(2), "{last}");
    assert!(message(&last).contains("has ended (signal: 9 (SIGKILL))"), "{last}");
    Happened::Kept(message(&last))
}

fn hangs() -> Happened {
    let endless = [("return self.joints\n\n    def move", "while True: pass\n\n    def move")];
    let Some(lab) = cell(&endless) else { return Happened::PassedOver(NO_PYTHON.to_owned()) };
    let begun = Instant::now();
    let run = lab.plumb(&["run", "cell-py.yaml", "--headless"]);
    assert_eq!(run.code(), 2, "{}", run.all());
    assert!(begun.elapsed().as_secs() < 20, "{:?}", begun.elapsed());
    assert_eq!(driver_of(&lab), None, "its process is gone");
    Happened::Kept(crate::line_with(&run.all(), "did not answer 'read joints'"))
}

fn orphaned() -> Happened {
    let Some(lab) = cell(&SLOW) else { return Happened::PassedOver(NO_PYTHON.to_owned()) };
    let mut running = lab.start(&["run", "cell-py.yaml"]);
    running.until_moving_in("out");
    let driver = driver_of(&lab).unwrap();
    let begun = Instant::now();
    kill(running.process());
    wait_gone(driver);
    assert!(lab.path("pyarm/stopped").is_file(), "the driver was commanded to stop");
    Happened::Kept(format!("commanded to stop and gone after {:.1} s", begun.elapsed().as_secs_f64()))
}
