//! Processes that are frozen by a signal: a host at any moment of its start and in mid-move, and the orchestrator in mid-move.

use std::fs;
use std::thread;
use std::time::{Duration, Instant};

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use plumb_host::{DeviceError, HostProcess, SpawnError};
use plumb_plugin::Value;

use crate::leaving::{is_gone, orchestrate};
use crate::test_folder::{LONG, TestFolder, command, until, waist_to};

/// The times that `core/README.md` states, with what a busy machine adds.
const READY_WITHIN: Duration = Duration::from_secs(3);
const HOST_SILENT: Duration = Duration::from_secs(5);
const ENDING: Duration = Duration::from_secs(6);
const BUSY_MACHINE: Duration = Duration::from_secs(4);

fn signal(process: i32, signal: Signal) {
    kill(Pid::from_raw(process), signal).unwrap();
}

/// The process that serves a device, by its command line, as soon as there is one.
fn host_of(device: &str) -> i32 {
    until("the host's process", || {
        let numbers =
            fs::read_dir("/proc").unwrap().filter_map(|entry| entry.ok()?.file_name().to_str()?.parse().ok());
        numbers.into_iter().find(|number: &i32| {
            let line = fs::read(format!("/proc/{number}/cmdline")).unwrap_or_default();
            line.split(|byte| *byte == 0).any(|word| word == device.as_bytes())
        })
    })
}

/// Starts a host, freezes it some time after its process is there, and asks for its device to be ready; what came of it.
fn frozen_after(moment: Duration, device: &str) -> Result<(), String> {
    let folder = TestFolder::new();
    let arguments = folder.arguments(device, "misbehaving_robot", Value::Null);
    thread::scope(|scope| {
        let freezing = scope.spawn(|| {
            let host = host_of(device);
            thread::sleep(moment);
            signal(host, Signal::SIGSTOP);
        });
        let begin = Instant::now();
        let spawned = HostProcess::spawn(folder.bus(), &arguments, command().ready_within(READY_WITHIN));
        let limit = READY_WITHIN.max(HOST_SILENT) + ENDING + BUSY_MACHINE;
        assert!(begin.elapsed() < limit, "{device}: the start took {:?}", begin.elapsed());
        freezing.join().unwrap();
        let host = match spawned {
            Err(error @ (SpawnError::TimedOut { .. } | SpawnError::Died { .. })) => {
                assert!(error.is_frozen(), "{error}");
                return Err(error.to_string());
            }
            Err(error) => panic!("{device}: {error}"),
            Ok(host) => host,
        };
        // It was ready before it was frozen: the next thing it is asked fails in time.
        let begin = Instant::now();
        let error = host.robot().unwrap().activate().unwrap_err();
        assert!(begin.elapsed() < HOST_SILENT + BUSY_MACHINE, "{device}: it took {:?}", begin.elapsed());
        assert!(matches!(error, DeviceError::HostDied { .. }), "{error:?}");
        Err(error.to_string())
    })
}

#[test]
fn a_host_frozen_at_any_moment_of_its_start_ends_in_time_and_is_named() {
    thread::scope(|scope| {
        let moments = [0, 2, 5, 10, 20, 40, 80, 160].map(|moment| {
            scope.spawn(move || {
                let device = format!("frozen{moment}_{}", std::process::id());
                (device.clone(), frozen_after(Duration::from_millis(moment), &device))
            })
        });
        for moment in moments {
            let (device, result) = moment.join().unwrap();
            let message = result.unwrap_err();
            assert!(message.contains(&device), "{message}");
        }
    });
}

#[test]
fn a_host_frozen_in_mid_move_is_ended_and_the_move_fails_with_the_reason() {
    let folder = TestFolder::new();
    let host = folder.robot(Value::Null);
    let robot = host.robot().unwrap();
    robot.activate().unwrap();
    thread::scope(|scope| {
        let moving = scope.spawn(|| robot.move_joints(&waist_to(90.0), Duration::from_secs(600)));
        thread::sleep(Duration::from_millis(100));
        signal(host.process().cast_signed(), Signal::SIGSTOP);
        let begin = Instant::now();
        let message = moving.join().unwrap().unwrap_err().to_string();
        assert!(begin.elapsed() < HOST_SILENT + BUSY_MACHINE, "it took {:?}", begin.elapsed());
        assert!(
            message.starts_with("the host of arm was killed: its process did not run for 5s"),
            "{message}"
        );
    });
}

#[test]
fn a_robot_is_stopped_when_its_orchestrator_is_frozen() {
    let folder = TestFolder::new();
    let diary = folder.directory.path().join("diary");
    let arguments = folder.arguments("arm", "misbehaving_robot", serde_json::json!({ "diary": diary }));
    let (mut orchestrator, host) = orchestrate(&arguments);
    // The move has begun when the host's number is printed, or does so a moment later.
    thread::sleep(Duration::from_millis(300));
    let frozen = orchestrator.id().cast_signed();
    signal(frozen, Signal::SIGSTOP);
    let begin = Instant::now();
    until("the stop", || fs::read_to_string(&diary).is_ok_and(|text| text == "stopped\n").then_some(()));
    assert!(
        begin.elapsed() >= Duration::from_millis(1500),
        "a short pause is no reason: {:?}",
        begin.elapsed()
    );
    assert!(begin.elapsed() < Duration::from_secs(2) + BUSY_MACHINE, "it took {:?}", begin.elapsed());
    // The device is not put away: who goes on finds it where it was stopped.
    assert!(!is_gone(host));
    signal(frozen, Signal::SIGCONT);
    orchestrator.kill().unwrap();
    orchestrator.wait().unwrap();
    until("the host's end", || is_gone(host).then_some(()));
}

#[test]
fn an_orchestrator_in_a_debugger_may_be_held_as_long_as_it_takes() {
    let folder = TestFolder::new();
    let diary = folder.directory.path().join("diary");
    let mut arguments = folder.arguments("arm", "misbehaving_robot", serde_json::json!({ "diary": diary }));
    arguments.under_debugger = true;
    let (mut orchestrator, host) = orchestrate(&arguments);
    thread::sleep(Duration::from_millis(300));
    let held = orchestrator.id().cast_signed();
    signal(held, Signal::SIGSTOP);
    thread::sleep(Duration::from_secs(4));
    assert!(!diary.exists(), "the robot goes on: {:?}", fs::read_to_string(&diary));
    orchestrator.kill().unwrap();
    orchestrator.wait().unwrap();
    until("the host's end", || is_gone(host).then_some(()));
}

#[test]
fn a_short_pause_of_the_orchestrator_stops_nothing() {
    let folder = TestFolder::new();
    let host = folder.robot(Value::Null);
    let robot = host.robot().unwrap();
    robot.activate().unwrap();
    // Longer than the orchestrator may be silent, which it is not.
    let end = robot.move_joints(&waist_to(4.0), LONG).unwrap();
    assert_eq!(end.joints.get(0), Some(4.0));
}
