//! What befalls the simulated world, and the serial line to a controller.

use nix::sys::signal::Signal;
use plumb_cell::device::CellResources;

use crate::lab::{Lab, command_of, kill, processes_of, wait_gone};
use crate::moments::{assert_sound, end_of, message, moving_in, resume, signal};
use crate::{Happened, Row};

pub(crate) const ROWS: &[&Row] = &[
    &Row {
        name: "world_frozen",
        done: "the simulated world stopped (SIGSTOP) in mid-move, and let go on after the run's end",
        promise: "the run ends with 2 within 20 s; resumed, it passes without an operator",
        happens: world_frozen,
    },
    &Row {
        name: "world_killed",
        done: "the simulated world killed in mid-move",
        promise: "the run ends with 2 within 5 s; the record is sound, and --resume says that the world began anew, and passes with the true zeros, or with 4 where the arm is elsewhere",
        happens: world_killed,
    },
    &Row {
        name: "controller_killed",
        done: "the emulated controller behind the serial line killed in mid-move",
        promise: "the run ends with 2 and says what to check at the line; the record is sound",
        happens: controller_killed,
    },
];

/// The process of a lab's world.
fn world_of(lab: &Lab, cell: &str) -> u32 {
    of_cell(lab, cell, " world ")
}

fn of_cell(lab: &Lab, cell: &str, what: &str) -> u32 {
    let resources = CellResources::of_cell(&lab.path(cell)).unwrap();
    let all = processes_of(&resources.world_socket().display().to_string());
    all.into_iter().find(|process| command_of(*process).contains(what)).expect("it runs")
}

fn world_frozen() -> Happened {
    let lab = Lab::new();
    let running = moving_in(&lab, "waist.lower");
    let world = world_of(&lab, "cell.yaml");
    signal(world, Signal::SIGSTOP);
    let (last, code, took) = end_of(running);
    signal(world, Signal::SIGCONT);
    assert_eq!(code, Some(2), "{last}");
    assert!(took < 20.0, "it took {took} s");
    resume(&lab);
    Happened::Kept(format!("after {took:.1} s: {}", message(&last)))
}

fn world_killed() -> Happened {
    let lab = Lab::new();
    let running = moving_in(&lab, "waist.lower");
    let world = world_of(&lab, "cell.yaml");
    kill(world);
    wait_gone(world);
    let (last, code, took) = end_of(running);
    assert_eq!(code, Some(2), "{last}");
    assert!(took < 5.0, "it took {took} s");
    let resumed = lab.plumb(&["run", "--resume", "1", "--headless", "--pace", "fast"]);
    match resumed.code() {
        0 => lab.assert_zeros_found("1"),
        code => assert_eq!(code, 4, "{}", resumed.all()),
    }
    assert!(resumed.all().contains("began anew"), "{}", resumed.all());
    assert_sound(&lab);
    Happened::Kept(format!(
        "after {took:.1} s: {}; then: {}",
        message(&last),
        crate::line_with(&resumed.all(), "began anew")
    ))
}

fn controller_killed() -> Happened {
    let lab = Lab::new();
    let mut running = lab.start(&["run", "cell-serial.yaml", "--pace", "real"]);
    running.until_moving_in("waist.lower");
    kill(of_cell(&lab, "cell-serial.yaml", "emulate"));
    let (last, code, took) = end_of(running);
    assert_eq!(code, Some(2), "{last}");
    assert_sound(&lab);
    Happened::Kept(format!("after {took:.1} s: {}", message(&last)))
}
