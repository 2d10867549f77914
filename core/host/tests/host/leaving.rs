//! What is left when hosts and orchestrators end.

use std::fs;
use std::io::{BufRead, BufReader};
use std::os::unix::fs::PermissionsExt as _;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::channel;
use std::thread;

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use plumb_bus::Bus;
use plumb_host::{HostArguments, HostEvent, HostProcess};
use plumb_plugin::{DeviceState, LogLevel, Value};

use crate::test_folder::{LONG, TestFolder, command, example_file, until, waist_to};

#[test]
fn nothing_is_left_in_shared_memory() {
    let mut folder = TestFolder::new();
    let arm = folder.robot(Value::Null);
    let eye = folder.watcher();
    let robot = arm.robot().unwrap();
    robot.activate().unwrap();
    robot.move_joints(&waist_to(0.01), LONG).unwrap();
    assert!(!folder.domain.shared_memory().is_empty());
    drop(robot);
    assert!(arm.finish(LONG).is_orderly());
    assert!(eye.finish(LONG).is_orderly());
    folder.bus = None;
    folder.domain.remove().unwrap();
    assert!(folder.domain.shared_memory().is_empty());
    assert_eq!(fs::read_dir(folder.directory.path()).unwrap().count(), 0);
}

#[test]
fn nothing_is_left_in_shared_memory_after_kills() {
    let mut folder = TestFolder::new();
    let host = folder.robot_with("segfault", "move");
    let robot = host.robot().unwrap();
    robot.activate().unwrap();
    assert!(robot.move_joints(&waist_to(0.1), LONG).is_err());
    drop((robot, host));
    folder.bus = None;
    folder.domain.remove().unwrap();
    assert!(folder.domain.shared_memory().is_empty());
}

#[test]
fn a_device_is_put_away_in_good_order() {
    let folder = TestFolder::new();
    let diary = folder.directory.path().join("diary");
    let host = folder.robot(serde_json::json!({ "diary": diary }));
    host.robot().unwrap().activate().unwrap();
    assert!(host.finish(LONG).is_orderly());
    assert_eq!(fs::read_to_string(&diary).unwrap(), "ended\n");
}

/// What is said of an end that was not in good order, of a robot that cannot be deactivated.
fn said_of_an_end(is_active: bool) -> Vec<String> {
    let folder = TestFolder::new();
    let config = serde_json::json!({"fault": "refuse", "in": "deactivate"});
    let (host, events) = folder.spawn_listening(&folder.arguments("arm", "misbehaving_robot", config));
    let robot = host.robot().unwrap();
    if is_active {
        robot.activate().unwrap();
        let error = robot.deactivate().unwrap_err();
        assert_eq!(error.to_string(), "arm: the robot does not want to");
        assert_eq!(robot.state().unwrap(), DeviceState::Active);
    }
    drop(robot);
    assert!(host.finish(LONG).is_orderly());
    let of_the_end = |event| match event {
        HostEvent::Log { level: LogLevel::Warn, text } if text.contains("end in good order") => Some(text),
        _ => None,
    };
    events.iter().filter_map(of_the_end).collect()
}

#[test]
fn an_active_robot_is_deactivated_before_it_is_put_away_and_an_inactive_one_is_not() {
    let message = "the device did not end in good order: the robot does not want to";
    assert_eq!(said_of_an_end(true), [message]);
    assert_eq!(said_of_an_end(false), [] as [&str; 0]);
}

#[test]
fn what_a_plugin_started_ends_with_its_host() {
    let folder = TestFolder::new();
    let diary = folder.directory.path().join("diary");
    let host = folder.robot(serde_json::json!({"diary": diary, "fault": "litter", "in": "read"}));
    host.robot().unwrap().read_joints().unwrap();
    let text = fs::read_to_string(&diary).unwrap();
    let child: i32 = text.trim().parse().expect("the plugin notes its child's process number");
    assert!(kill(Pid::from_raw(child), None).is_ok());
    assert!(host.finish(LONG).is_orderly());
    until("the child's end", || is_gone(child).then_some(()));
}

/// Whether a process has ended; one that nobody has reaped yet counts.
pub(crate) fn is_gone(process: i32) -> bool {
    fs::read_to_string(format!("/proc/{process}/stat"))
        .map_or(true, |stat| stat.rsplit(')').next().is_some_and(|rest| rest.trim_start().starts_with('Z')))
}

/// An orchestrator that has set its robot moving, and the process number of the robot's host.
pub(crate) fn orchestrate(arguments: &HostArguments) -> (Child, i32) {
    let mut orchestrator = Command::new(example_file("host_process"))
        .args(["orchestrate", &serde_json::to_string(arguments).unwrap()])
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut line = String::new();
    BufReader::new(orchestrator.stdout.take().unwrap()).read_line(&mut line).unwrap();
    let host: i32 = line.trim().parse().expect("the orchestrator prints its host's process number");
    (orchestrator, host)
}

#[test]
fn a_host_that_the_system_asks_to_end_stops_its_robot_and_says_who_asked() {
    let folder = TestFolder::new();
    let diary = folder.directory.path().join("diary");
    let arguments = folder.arguments("arm", "misbehaving_robot", serde_json::json!({ "diary": diary }));
    let (host, events) = folder.spawn_listening(&arguments);
    kill(Pid::from_raw(host.process().cast_signed()), Signal::SIGTERM).unwrap();
    let reason = host.wait_for_end(LONG).expect("it ends by itself");
    assert!(reason.to_string().starts_with("ended itself: it was asked to end"), "{reason}");
    assert_eq!(fs::read_to_string(&diary).unwrap(), "stopped\nended\n");
    drop(host);
    let asked = format!("by SIGTERM from process {} (", std::process::id());
    let says_who =
        |event| matches!(event, HostEvent::Log { level: LogLevel::Error, text } if text.contains(&asked));
    assert!(events.iter().any(says_who));
}

#[test]
fn a_robot_is_stopped_when_its_orchestrator_is_killed() {
    let folder = TestFolder::new();
    let diary = folder.directory.path().join("diary");
    let arguments = folder.arguments("arm", "misbehaving_robot", serde_json::json!({ "diary": diary }));
    let (mut orchestrator, host) = orchestrate(&arguments);
    orchestrator.kill().unwrap();
    orchestrator.wait().unwrap();
    until("the host's end", || is_gone(host).then_some(()));
    assert_eq!(fs::read_to_string(&diary).unwrap(), "stopped\nended\n");
}

#[test]
fn orchestrators_killed_at_any_moment_leave_a_cell_that_works() {
    let mut folder = TestFolder::new();
    let arguments = folder.arguments("arm", "misbehaving_robot", Value::Null);
    let text = serde_json::to_string(&arguments).unwrap();
    folder.bus = None;
    // From before the first piece of shared memory is made until the robot moves.
    for pieces in 0..20 {
        let before = folder.domain.shared_memory();
        let mut orchestrator = Command::new(example_file("host_process"))
            .args(["orchestrate", &text])
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let (sender, moves) = channel();
        let mut output = BufReader::new(orchestrator.stdout.take().unwrap());
        let reader = thread::spawn(move || {
            let mut line = String::new();
            output.read_line(&mut line).unwrap();
            let _ = sender.send(());
        });
        until("the moment", || {
            let made =
                folder.domain.shared_memory().into_iter().filter(|piece| !before.contains(piece)).count();
            (made >= pieces || moves.try_recv().is_ok()).then_some(())
        });
        orchestrator.kill().unwrap();
        let output = orchestrator.wait_with_output().unwrap();
        assert_eq!(String::from_utf8_lossy(&output.stderr), "", "killed at {pieces} pieces");
        reader.join().unwrap();
    }
    let bus = Bus::open(&folder.domain, "test").unwrap();
    let host = HostProcess::spawn(&bus, &arguments, command()).unwrap();
    let robot = host.robot().unwrap();
    robot.activate().unwrap();
    robot.move_joints(&waist_to(0.01), LONG).unwrap();
    drop((robot, host, bus));
    until("the end of the last host left alone", || folder.domain.remove().ok());
    assert!(folder.domain.shared_memory().is_empty());
}

/// A process killed between making a piece of shared memory and giving it its size.
#[test]
fn what_was_killed_before_it_had_a_size_holds_nobody_up() {
    let mut folder = TestFolder::new();
    let arguments = folder.arguments("arm", "misbehaving_robot", Value::Null);
    folder.bus = None;
    let (mut orchestrator, host) = orchestrate(&arguments);
    kill(Pid::from_raw(host), Signal::SIGKILL).unwrap();
    orchestrator.kill().unwrap();
    orchestrator.wait().unwrap();
    until("the host's end", || is_gone(host).then_some(()));
    let is_connection = |piece: &PathBuf| piece.extension().is_some_and(|kind| kind == "connection");
    let connections: Vec<_> = folder.domain.shared_memory().into_iter().filter(is_connection).collect();
    assert!(!connections.is_empty(), "{:?}", folder.domain.shared_memory());
    for piece in connections {
        fs::File::create(&piece).unwrap();
        fs::set_permissions(&piece, fs::Permissions::from_mode(0o200)).unwrap();
    }
    let (sender, moved) = channel();
    let domain = folder.domain.clone();
    thread::spawn(move || {
        let bus = Bus::open(&domain, "test").unwrap();
        let host = HostProcess::spawn(&bus, &arguments, command()).unwrap();
        let robot = host.robot().unwrap();
        robot.activate().unwrap();
        robot.move_joints(&waist_to(0.01), LONG).unwrap();
        drop((robot, host, bus));
        sender.send(()).unwrap();
    });
    moved.recv_timeout(LONG).expect("a robot that moves");
    until("the end of the last host", || folder.domain.remove().ok());
}
