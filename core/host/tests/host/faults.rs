//! What a plugin that goes wrong takes with it: its host and nothing else.

use std::time::Duration;

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use plumb_host::{DeviceError, HostEvent};
use plumb_plugin::{JointState, LogLevel, PluginError, Value};

use crate::test_folder::{LONG, TestFolder, stream, until, waist_to};

#[test]
fn a_panic_is_an_error_that_says_where() {
    let folder = TestFolder::new();
    let host = folder.robot_with("panic", "move");
    let robot = host.robot().unwrap();
    robot.activate().unwrap();
    let error = robot.move_joints(&waist_to(0.1), LONG).unwrap_err();
    assert!(matches!(error.plugin_error(), Some(PluginError::Panicked(_))), "{error:?}");
    let message = error.to_string();
    assert!(message.starts_with("arm: the plugin panicked at "), "{message}");
    assert!(message.contains("misbehaving_robot/lib.rs:"), "{message}");
    assert!(message.ends_with("the robot lost its head"), "{message}");
    // Its device may be half changed: nothing more is asked of it.
    let message = robot.read_joints().unwrap_err().to_string();
    assert!(message.ends_with("the device must be started anew"), "{message}");
    assert!(host.end().is_none());
}

#[test]
fn an_abort_ends_the_host_and_is_named() {
    assert_died_by("abort", "SIGABRT");
}

#[test]
fn a_crash_ends_the_host_and_is_named() {
    assert_died_by("segfault", "SIGSEGV");
}

fn assert_died_by(fault: &str, signal: &str) {
    let folder = TestFolder::new();
    let host = folder.robot_with(fault, "move");
    let robot = host.robot().unwrap();
    robot.activate().unwrap();
    let error = robot.move_joints(&waist_to(0.1), LONG).unwrap_err();
    let DeviceError::HostDied { device, reason, .. } = &error else { panic!("{error:?}") };
    assert_eq!(device, "arm");
    assert_eq!(reason.signal.as_deref(), Some(signal));
    assert!(error.to_string().starts_with(&format!("the host of arm was ended by {signal}")), "{error}");
    // And so says every later call, at once.
    assert_eq!(robot.read_joints().unwrap_err().to_string(), error.to_string());
}

#[test]
fn a_plugin_that_exits_is_named_with_its_code() {
    let folder = TestFolder::new();
    let host = folder.robot_with("exit", "move");
    let robot = host.robot().unwrap();
    robot.activate().unwrap();
    let error = robot.move_joints(&waist_to(0.1), LONG).unwrap_err();
    assert_eq!(error.to_string(), "the host of arm ended with code 3");
}

#[test]
fn a_call_past_its_time_is_an_error_and_then_the_hosts_end() {
    let folder = TestFolder::new();
    let mut arguments =
        folder.arguments("arm", "misbehaving_robot", serde_json::json!({"fault": "hang", "in": "move"}));
    arguments.watchdog_grace_ms = 50;
    let host = folder.spawn(&arguments).unwrap();
    let robot = host.robot().unwrap();
    robot.activate().unwrap();
    let error = robot.move_joints(&waist_to(0.1), Duration::from_millis(50)).unwrap_err();
    assert_eq!(error.to_string(), "arm did not answer 'move joints' within 50ms");
    let reason = host.wait_for_end(LONG).expect("the watchdog ends the host");
    assert_eq!(reason.to_string(), "ended itself: its plugin hung in a call");
}

#[test]
fn a_killed_host_is_replaced_at_once_and_the_old_client_says_why() {
    let folder = TestFolder::new();
    let mut receiver = folder.bus().subscriber("arm", &stream("misbehaving_robot", "joints")).unwrap();
    for round in 0..3 {
        let host = folder.robot(Value::Null);
        let robot = host.robot().unwrap();
        robot.activate().unwrap();
        std::thread::scope(|scope| {
            let moving = scope.spawn(|| robot.move_joints(&waist_to(90.0), LONG));
            until("a moving state", || {
                std::iter::from_fn(|| receiver.receive::<JointState>().unwrap()).find(JointState::is_moving)
            });
            kill(Pid::from_raw(host.process().cast_signed()), Signal::SIGKILL).unwrap();
            let error = moving.join().unwrap().unwrap_err();
            assert_eq!(error.to_string(), "the host of arm was ended by SIGKILL", "round {round}");
        });
        // What had been sent before is taken in, so that the next round begins with the new sender.
        while receiver.receive::<JointState>().unwrap().is_some() {}
    }
}

#[test]
fn messages_an_orchestrator_was_too_slow_for_are_reported() {
    let folder = TestFolder::new();
    let mut receiver = folder.bus().subscriber("arm", &stream("misbehaving_robot", "joints")).unwrap();
    let host = folder.robot_with("flood", "read");
    host.robot().unwrap().read_joints().unwrap();
    assert!(receiver.receive::<JointState>().unwrap().is_some());
    host.robot().unwrap().read_joints().unwrap();
    let message = receiver.receive::<JointState>().unwrap_err().to_string();
    assert!(
        message.ends_with("messages of stream arm/joints were lost: it was not read fast enough"),
        "{message}"
    );
}

#[test]
fn messages_a_sensor_was_too_slow_for_are_an_error_of_its_next_reading() {
    let folder = TestFolder::new();
    let arm = folder.robot_with("flood", "read");
    let eye = folder.watcher();
    let (robot, sensor) = (arm.robot().unwrap(), eye.sensor().unwrap());
    until("a loss", || {
        robot.read_joints().unwrap();
        match sensor.read(0, LONG) {
            Ok(_) => None,
            Err(error) => {
                let lost = matches!(error.plugin_error(), Some(PluginError::InputLost(_)));
                assert!(lost, "{error:?}");
                Some(())
            }
        }
    });
    // Reported once; what comes after is seen.
    robot.read_joints().unwrap();
    until("a reading", || sensor.read(0, LONG).ok());
}

#[test]
fn a_refusal_is_reported_in_the_plugins_words() {
    let folder = TestFolder::new();
    let host = folder.robot_with("refuse", "activate");
    let error = host.robot().unwrap().activate().unwrap_err();
    assert_eq!(error.to_string(), "arm: the robot does not want to");
}

#[test]
fn lines_that_cannot_be_read_at_rest_are_reported_once() {
    let folder = TestFolder::new();
    let config = serde_json::json!({"fault": "refuse", "in": "inputs"});
    let (host, events) = folder.spawn_listening(&folder.arguments("arm", "misbehaving_robot", config));
    for _ in 0..3 {
        host.robot().unwrap().read_joints().unwrap();
    }
    host.finish(LONG);
    let is_input_warning = |event: &HostEvent| matches!(event, HostEvent::Log { level: LogLevel::Warn, text } if text.contains("its input lines cannot be read at rest: the robot does not want to"));
    assert_eq!(events.iter().filter(is_input_warning).count(), 1);
}
