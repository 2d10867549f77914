//! What befalls the hosts of devices, and the program above them.

use std::time::{Duration, Instant};

use nix::sys::signal::Signal;

use crate::lab::{Lab, command_of, hosts_of, kill, wait_gone};
use crate::moments::{assert_sound, end_of, message, moving_in, resume, signal, until};
use crate::run_hosts::{Watched, long_move};
use crate::{Happened, Row};

pub(crate) const ROWS: &[&Row] = &[
    &Row {
        name: "host_killed",
        done: "the robot's host killed in mid-move",
        promise: "the run ends with 2 and names the device; resumed, it passes and asks nothing twice",
        happens: host_killed,
    },
    &Row {
        name: "host_frozen",
        done: "the robot's host stopped (SIGSTOP) in mid-move",
        promise: "the run ends with 2 within 20 s and names the device; resumed, it passes",
        happens: host_frozen,
    },
    &Row {
        name: "sensor_dies_in_search",
        done: "the sensor's host killed in mid-search",
        promise: "the arm is at rest within 0.5 s of the sensor's end; resumed, the run passes",
        happens: sensor_dies_in_search,
    },
    &Row {
        name: "orchestrator_killed",
        done: "the program killed in mid-move",
        promise: "every host is gone within 4 s, the record is sound, and the resumed run passes",
        happens: orchestrator_killed,
    },
    &Row {
        name: "terminal_closed",
        done: "the terminal of an unattended run closed (SIGHUP) in mid-move",
        promise: "the run ends as aborted and says by which signal; every host is gone within 10 s, the record is sound",
        happens: terminal_closed,
    },
    &Row {
        name: "orchestrator_frozen",
        done: "the program stopped (SIGSTOP) in a move of a minute, and let go on when the arm stood",
        promise: "the arm is at rest within 4 s, without a program; the run then ends with 4 and its reason, and nothing moves",
        happens: orchestrator_frozen,
    },
    &Row {
        name: "host_frozen_at_start",
        done: "the sensor's host stopped (SIGSTOP) 20 ms after it was started",
        promise: "the run ends with 2 within 30 s and names the device",
        happens: host_frozen_at_start,
    },
    &Row {
        name: "sensor_frozen_in_search",
        done: "the sensor's host stopped (SIGSTOP) in mid-search",
        promise: "the run ends with 2 within 15 s and names the device; resumed, it passes",
        happens: sensor_frozen_in_search,
    },
    &Row {
        name: "two_orchestrators",
        done: "a second program on a cell that runs",
        promise: "it is refused with 2 and says which process runs the cell, which goes on",
        happens: two_orchestrators,
    },
];

fn host_killed() -> Happened {
    let lab = Lab::new();
    let running = moving_in(&lab, "waist.lower");
    kill(running.host_of("libplumb_simulated"));
    let (last, code, took) = end_of(running);
    assert_eq!(code, Some(2), "{last}");
    assert!(message(&last).contains("arm is lost"), "{last}");
    resume(&lab);
    Happened::Kept(format!("after {took:.1} s: {}", message(&last)))
}

fn host_frozen() -> Happened {
    let lab = Lab::new();
    let running = moving_in(&lab, "waist.lower");
    let arm = running.host_of("libplumb_simulated");
    signal(arm, Signal::SIGSTOP);
    let (last, code, took) = end_of(running);
    assert_eq!(code, Some(2), "{last}");
    assert!(took < 20.0, "it took {took} s");
    assert!(message(&last).contains("arm"), "{last}");
    wait_gone(arm);
    resume(&lab);
    Happened::Kept(format!("after {took:.1} s: {}", message(&last)))
}

/// How long after its sensor's end an arm may still move: the orchestrator hears of the end at once, and a stop takes less than a tenth of that.
const STILL_WITHIN: Duration = Duration::from_millis(500);

fn sensor_dies_in_search() -> Happened {
    let lab = Lab::new();
    let mut running = moving_in(&lab, "waist.find_a");
    kill(running.host_of("libplumb_ir_proximity"));
    let killed = Instant::now();
    // What is said of the arm's joints comes with the stream; the last that says it moves is the last motion.
    let mut moved = killed;
    while let Some(event) = running.event() {
        if event["event"] == "joints" && event["moving"] == true {
            moved = Instant::now();
        }
    }
    let still = moved.duration_since(killed);
    assert!(still < STILL_WITHIN, "the arm moved for another {still:?}");
    let (_, code) = running.end();
    assert_eq!(code, Some(2));
    resume(&lab);
    Happened::Kept(format!("the arm was last seen moving {} ms later", still.as_millis()))
}

fn orchestrator_killed() -> Happened {
    let lab = Lab::new();
    let running = moving_in(&lab, "waist.lower");
    let took = ended_by(running, Signal::SIGKILL, 4.0);
    assert_sound(&lab);
    resume(&lab);
    Happened::Kept(format!("the hosts were gone {took:.1} s later"))
}

fn orchestrator_frozen() -> Happened {
    let lab = Lab::new();
    long_move(&lab);
    let mut cell = Watched::moving_in(&lab, "far");
    cell.running.signal(Signal::SIGSTOP);
    let took = cell.time_to_rest().as_secs_f64();
    assert!(took < 4.0, "the arm stood after {took} s");
    let stopped = cell.joints();
    cell.running.signal(Signal::SIGCONT);
    let (last, code, _) = end_of(cell.running);
    assert_eq!(code, Some(4), "{last}");
    assert_eq!(cell.world.look().unwrap().attitudes.to_vec(), stopped);
    Happened::Kept(format!("the arm stood after {took:.1} s; {}", message(&last)))
}

fn host_frozen_at_start() -> Happened {
    let lab = Lab::new();
    let running = lab.start(&["run", "cell.yaml", "--pace", "real"]);
    let sensor = || running.hosts().into_iter().find(|host| command_of(*host).contains("host eye of "));
    until("the sensor's host", || sensor().is_some());
    std::thread::sleep(Duration::from_millis(20));
    signal(sensor().unwrap(), Signal::SIGSTOP);
    let (last, code, took) = end_of(running);
    assert_eq!(code, Some(2), "{last}");
    assert!(took < 30.0, "it took {took} s");
    assert!(message(&last).contains("eye"), "{last}");
    Happened::Kept(format!("after {took:.1} s: {}", message(&last)))
}

fn sensor_frozen_in_search() -> Happened {
    let lab = Lab::new();
    let running = moving_in(&lab, "waist.find_a");
    signal(running.host_of("libplumb_ir_proximity"), Signal::SIGSTOP);
    let (last, code, took) = end_of(running);
    assert_eq!(code, Some(2), "{last}");
    assert!(took < 15.0, "it took {took} s");
    assert!(message(&last).contains("eye"), "{last}");
    resume(&lab);
    Happened::Kept(format!("after {took:.1} s: {}", message(&last)))
}

fn terminal_closed() -> Happened {
    let lab = Lab::new();
    let running = moving_in(&lab, "waist.lower");
    let took = ended_by(running, Signal::SIGHUP, 10.0);
    assert_sound(&lab);
    let run = lab.shown("1")["run"].clone();
    assert_eq!(run["state"], "aborted", "{run}");
    let reason = run["message"].as_str().unwrap_or_default();
    assert!(reason.contains("SIGHUP"), "{run}");
    Happened::Kept(format!("the hosts were gone {took:.1} s later; {reason}"))
}

/// Ends the program by a signal and waits for its hosts; how long that took, s.
fn ended_by(running: crate::lab::Running, by: Signal, within_s: f64) -> f64 {
    let hosts = hosts_of(running.process());
    assert_eq!(hosts.len(), 2, "{hosts:?}");
    let begin = Instant::now();
    running.signal(by);
    running.end();
    hosts.into_iter().for_each(wait_gone);
    let took = begin.elapsed().as_secs_f64();
    assert!(took < within_s, "it took {took} s");
    took
}

fn two_orchestrators() -> Happened {
    let lab = Lab::new();
    let mut running = moving_in(&lab, "waist.lower");
    let second = lab.plumb(&["run", "cell.yaml"]);
    assert_eq!(second.code(), 2, "{}", second.all());
    assert!(second.err().contains(&running.process().to_string()), "{}", second.err());
    running.until(|event| event["event"] == "step_finished" && event["step"] == "waist.lower");
    running.signal(Signal::SIGTERM);
    assert_eq!(running.end().1, Some(3));
    until("the hosts' end", || !lab.plumb(&["doctor", "cell.yaml"]).out().contains("is run by"));
    Happened::Kept(crate::line_with(&second.err(), "already run"))
}
