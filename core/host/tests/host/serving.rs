//! What a device does when all is well.

use plumb_host::{HostEvent, JointRange};
use plumb_plugin::{
    Description, DeviceState, Health, JointState, JointVector, LogLevel, Motion, PluginError,
    StreamDescription, Value,
};

use tracing_subscriber::registry::LookupSpan as _;

use crate::test_folder::{LONG, TestFolder, stream, until, waist_to};

#[test]
fn a_robot_is_described_activated_moved_and_read() {
    let folder = TestFolder::new();
    let host = folder.robot(Value::Null);
    let Description::Robot(robot) = host.description() else { panic!("a robot was loaded") };
    assert_eq!(robot.joints[0].name, "waist");
    assert_eq!(host.manifest().id, "misbehaving-robot");
    assert_eq!(host.device(), "arm");

    let robot = host.robot().unwrap();
    assert_eq!(robot.state().unwrap(), DeviceState::Inactive);
    assert_eq!(robot.activate().unwrap(), DeviceState::Active);
    let state = robot.move_joints(&waist_to(0.02), LONG).unwrap();
    assert_eq!(state.joints.as_slice(), [0.02, 0.0]);
    assert_eq!(robot.read_joints().unwrap().joints, state.joints);
    assert_eq!(
        robot.describe().unwrap(),
        *match host.description() {
            Description::Robot(robot) => robot,
            Description::Sensor(_) => panic!("a robot was loaded"),
        }
    );
    assert!(host.finish(LONG).is_orderly());
}

#[test]
fn a_robot_does_not_move_before_it_is_active() {
    let folder = TestFolder::new();
    let host = folder.robot(Value::Null);
    let error = host.robot().unwrap().move_joints(&waist_to(0.1), LONG).unwrap_err();
    assert_eq!(error.to_string(), "arm: arm is inactive; activate it before it may move");
}

#[test]
fn a_robot_that_was_deactivated_does_not_move() {
    let folder = TestFolder::new();
    let host = folder.robot(Value::Null);
    let robot = host.robot().unwrap();
    robot.activate().unwrap();
    assert_eq!(robot.deactivate().unwrap(), DeviceState::Inactive);
    assert_eq!(robot.state().unwrap(), DeviceState::Inactive);
    let error = robot.move_joints(&waist_to(0.1), LONG).unwrap_err();
    assert_eq!(error.to_string(), "arm: arm is inactive; activate it before it may move");
}

#[test]
fn the_health_of_a_device_is_reported_with_every_state_it_enters() {
    let folder = TestFolder::new();
    let mut receiver = folder.bus().subscriber("arm", &StreamDescription::of::<Health>("health")).unwrap();
    let host = folder.robot(Value::Null);
    let robot = host.robot().unwrap();
    assert!(robot.move_joints(&waist_to(0.1), LONG).is_err(), "it is not active");
    robot.activate().unwrap();
    robot.deactivate().unwrap();
    let reports: Vec<Health> = std::iter::from_fn(|| receiver.receive().unwrap()).collect();
    let mut states: Vec<u32> = reports.iter().map(|health| health.state).collect();
    states.dedup();
    let expected = [DeviceState::Inactive, DeviceState::Active, DeviceState::Inactive];
    assert_eq!(states, expected.map(DeviceState::code));
    let last = reports.last().unwrap();
    assert_eq!((last.requests, last.failures), (2, 1), "the refused move and the activation came before");
    assert!(last.longest_ns > 0 && last.time_ns > reports[0].time_ns);
}

#[test]
fn the_health_of_a_device_is_reported_again_while_nothing_changes() {
    let folder = TestFolder::new();
    let mut receiver = folder.bus().subscriber("arm", &StreamDescription::of::<Health>("health")).unwrap();
    let _host = folder.robot(Value::Null);
    let first: Health = until("the first report", || receiver.receive().unwrap());
    let second: Health = until("the second report", || receiver.receive().unwrap());
    assert_eq!((first.state, second.state), (DeviceState::Inactive.code(), DeviceState::Inactive.code()));
    assert!(second.time_ns - first.time_ns >= 900_000_000, "about once a second");
}

#[test]
fn a_move_out_of_range_is_refused_by_the_host() {
    let folder = TestFolder::new();
    let mut arguments = folder.arguments("arm", "misbehaving_robot", Value::Null);
    arguments.joint_ranges = vec![JointRange { joint: "waist".to_owned(), lower: -1.0, upper: 1.0 }];
    let host = folder.spawn(&arguments).unwrap();
    let robot = host.robot().unwrap();
    robot.activate().unwrap();
    let error = robot.move_joints(&waist_to(1.1), LONG).unwrap_err();
    assert_eq!(error.to_string(), "arm: waist would go to 63.03 deg; it may go from -57.30 deg to 57.30 deg");
    assert!(matches!(error.plugin_error(), Some(PluginError::OutOfRange(_))));
    assert_eq!(robot.read_joints().unwrap().joints.as_slice(), [0.0, 0.0]);
}

#[test]
fn a_move_into_a_kept_out_region_is_refused_by_the_host() {
    let folder = TestFolder::new();
    let mut arguments = folder.arguments("arm", "misbehaving_robot", Value::Null);
    arguments.guard = serde_json::json!({"keep_below": 10.0});
    let host = folder.spawn(&arguments).unwrap();
    let robot = host.robot().unwrap();
    robot.activate().unwrap();
    let target = JointVector::from_slice(&[0.0, 11.0]).unwrap();
    let error = robot.move_joints(&Motion::absolute(target, 1.0), LONG).unwrap_err();
    assert_eq!(error.to_string(), "arm: the hand would reach into the table (11 mm)");
}

#[test]
fn what_a_robot_cannot_do_is_said_and_does_no_harm() {
    let folder = TestFolder::new();
    let host = folder.robot(Value::Null);
    let robot = host.robot().unwrap();
    let error = robot.write_outputs(1).unwrap_err();
    assert_eq!(error.to_string(), "arm: this device cannot set output lines");
    robot.activate().unwrap();
    robot.set_zero(&JointVector::from_slice(&[0.25, 3.0]).unwrap()).unwrap();
    assert_eq!(robot.read_joints().unwrap().joints.as_slice(), [0.25, 3.0]);
}

#[test]
fn a_sensor_has_seen_the_whole_move_once_it_has_seen_its_end() {
    let folder = TestFolder::new();
    let arm = folder.robot(Value::Null);
    let eye = folder.watcher();
    let (robot, sensor) = (arm.robot().unwrap(), eye.sensor().unwrap());
    robot.activate().unwrap();
    sensor.activate().unwrap();
    sensor.arm().unwrap();
    for target in [0.51, 0.49, 0.51] {
        let end = robot.move_joints(&waist_to(target), LONG).unwrap();
        let reading = sensor.read(end.time_ns, LONG).unwrap();
        assert!(reading.time_ns >= end.time_ns);
        assert_eq!(reading.fired, Some(target > 0.5));
        assert_eq!(reading.edges.len(), 1);
        assert_eq!(reading.edges[0].has_fired(), target > 0.5);
        let waist = reading.edges[0].joints.get(0).unwrap();
        assert!((waist - 0.5).abs() < 0.003, "the edge was at {waist}");
    }
}

#[test]
fn a_sensor_whose_inputs_stay_away_says_so_in_time() {
    let folder = TestFolder::new();
    let _arm = folder.robot(Value::Null);
    let eye = folder.watcher();
    let error = eye.sensor().unwrap().read(u64::MAX, std::time::Duration::from_millis(50)).unwrap_err();
    let message = error.to_string();
    let expected = [
        "eye did not answer 'read' within 50ms",
        "eye: eye has not seen its inputs up to 18446744073.710 s of the cell's clock",
    ];
    assert!(expected.contains(&message.as_str()), "{message}");
}

#[test]
fn a_state_stream_reaches_the_orchestrator_without_loss() {
    let folder = TestFolder::new();
    let joints = stream("misbehaving_robot", "joints");
    let mut receiver = folder.bus().subscriber("arm", &StreamDescription { ..joints }).unwrap();
    let host = folder.robot(Value::Null);
    let robot = host.robot().unwrap();
    robot.activate().unwrap();
    let end = robot.move_joints(&waist_to(0.1), LONG).unwrap();
    let mut last: Option<JointState> = None;
    while let Some(state) = receiver.receive::<JointState>().unwrap() {
        assert!(last.is_none_or(|last| last.sequence + 1 == state.sequence));
        last = Some(state);
    }
    let last = last.unwrap();
    assert_eq!((last.joints, last.is_moving()), (end.joints, false));
    assert!(last.sequence >= 49);
}

#[test]
fn a_large_message_is_built_in_place() {
    let folder = TestFolder::new();
    let frames = stream("misbehaving_robot", "frames");
    let mut receiver = folder.bus().subscriber("arm", &frames).unwrap();
    let host = folder.robot(Value::Null);
    host.robot().unwrap().read_inputs().unwrap();
    let frame = receiver.receive_with(|frame| (frame.len(), frame[16], frame[1_299_999])).unwrap();
    assert_eq!(frame, Some((1_300_000, 7, 7)));
}

#[test]
fn what_a_plugin_logs_and_prints_is_carried() {
    let folder = TestFolder::new();
    let config = serde_json::json!({"fault": "chatter", "in": "read"});
    let (host, events) = folder.spawn_listening(&folder.arguments("arm", "misbehaving_robot", config));
    host.robot().unwrap().read_joints().unwrap();
    host.finish(LONG);
    let events: Vec<HostEvent> = events.iter().collect();
    let output = |text: &str| HostEvent::Output { text: text.to_owned() };
    assert!(events.contains(&output("printed by the plugin")), "{events:?}");
    assert!(events.contains(&output("complained by the plugin")), "{events:?}");
    assert!(
        events.contains(&HostEvent::Log { level: LogLevel::Info, text: "logged by the plugin".to_owned() })
    );
    assert!(events.contains(&HostEvent::Progress { fraction: 0.5, text: "half of it".to_owned() }));
}

#[test]
fn what_a_plugin_logs_carries_the_span_of_the_call_it_served() {
    // The one subscriber of this test program: it keeps spans, and writes nothing.
    let _ = tracing::subscriber::set_global_default(tracing_subscriber::registry());
    let folder = TestFolder::new();
    let config = serde_json::json!({"fault": "chatter", "in": "read"});
    let (events, received) = std::sync::mpsc::channel();
    let command = crate::test_folder::command().on_event(move |_, event| {
        let spans = tracing::Span::current().with_subscriber(|(id, all)| {
            let all = all.downcast_ref::<tracing_subscriber::Registry>().unwrap();
            all.span(id).unwrap().scope().from_root().map(|span| span.name()).collect::<Vec<_>>()
        });
        drop(events.send((event.clone(), spans.unwrap_or_default())));
    });
    let arguments = folder.arguments("arm", "misbehaving_robot", config);
    let host = plumb_host::HostProcess::spawn(folder.bus(), &arguments, command).unwrap();
    tracing::info_span!("step").in_scope(|| host.robot().unwrap().read_joints().unwrap());
    host.finish(LONG);
    let events: Vec<(HostEvent, Vec<&str>)> = received.iter().collect();
    let log = HostEvent::Log { level: LogLevel::Info, text: "logged by the plugin".to_owned() };
    assert!(events.contains(&(log, vec!["step", "call"])), "{events:?}");
}

#[test]
fn two_terminals_may_ask_the_same_robot() {
    let folder = TestFolder::new();
    let host = folder.robot(Value::Null);
    let (one, other) = (host.robot().unwrap(), host.robot().unwrap());
    one.activate().unwrap();
    std::thread::scope(|scope| {
        let moving = scope.spawn(|| one.move_joints(&waist_to(0.1), LONG));
        for _ in 0..20 {
            other.read_joints().unwrap();
        }
        assert!(moving.join().unwrap().is_ok());
    });
    until("the move's end", || (other.read_joints().unwrap().joints.get(0) == Some(0.1)).then_some(()));
}
