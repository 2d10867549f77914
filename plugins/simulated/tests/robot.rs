//! The plugin as its host sees it.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod common;

use common::{Served, until};
use plumb_plugin::recording::RecordingHost;
use plumb_plugin::{
    ContractVersion, DeviceKind, DigitalInputs, JointState, JointUnit, JointVector, Manifest, Motion,
    PluginError, Robot,
};
use plumb_simulated::SimulatedRobot;
use plumb_simulated::protocol::{Pace, PendantKey, WorldCommand};
use serde_json::json;

fn robot(served: &Served) -> (RecordingHost, SimulatedRobot) {
    let recording = RecordingHost::new();
    let config = json!({"arm": "teachmover", "world": served.socket});
    let robot = SimulatedRobot::create(&config, recording.host()).unwrap();
    (recording, robot)
}

fn turn(joint: usize, by_deg: f64) -> Motion {
    let mut change = JointVector::zeros(6);
    change.set(joint, by_deg.to_radians());
    Motion::relative(change, 1.0).only(1 << joint)
}

#[test]
fn it_describes_its_joints_with_units_limits_and_resolution() {
    let served = Served::start("world-backlash.yaml", Pace::Fast);
    let description = robot(&served).1.describe();
    let names: Vec<&str> = description.joints.iter().map(|joint| joint.name.as_str()).collect();
    assert_eq!(names, ["waist", "shoulder", "elbow", "wrist_pitch", "wrist_roll", "gripper"]);
    let waist = &description.joints[0];
    assert!((waist.resolution.to_degrees() - 360.0 / 7072.0).abs() < 1e-12);
    assert!((waist.max_speed.to_degrees() - 472.0 * 360.0 / 7072.0).abs() < 1e-9);
    assert!((waist.upper.to_degrees() - 90.0).abs() < 1e-12);
    assert_eq!(description.joints[5].unit, JointUnit::Millimetre);
    assert!((description.joints[5].resolution - 25.4 / 371.0).abs() < 1e-12);
    assert!(description.capabilities.interruptible && description.capabilities.jog);
}

#[test]
fn it_knows_its_joints_as_the_controller_does_and_not_as_they_are() {
    let served = Served::start("world-ideal.yaml", Pace::Fast);
    let (_, mut robot) = robot(&served);
    let state = robot.read_joints().unwrap();
    assert!((state.joints.as_slice()[1].to_degrees() - 43.4).abs() < 1e-9, "true 41, and 2.4 beyond it");
}

#[test]
fn a_move_emits_its_edges_then_where_it_ended_then_the_levels() {
    let served = Served::start("world-ideal.yaml", Pace::Fast);
    let (recording, mut robot) = robot(&served);
    robot.activate().unwrap();
    let began = recording.emitted::<DigitalInputs>("inputs").len();
    let end = robot.move_joints(&turn(1, -10.0)).unwrap();
    let inputs = recording.emitted::<DigitalInputs>("inputs").split_off(began);
    assert_eq!(inputs.len(), 2);
    assert!(inputs[0].has_changed(0) && inputs[0].level(0));
    assert!(inputs[0].time_ns < end.time_ns);
    assert_eq!(inputs[1].changed, 0);
    assert!(inputs[1].time_ns >= end.time_ns);
    assert!(inputs[1].level(0));
    let last = *recording.emitted::<JointState>("joints").last().unwrap();
    assert_eq!((last.joints, last.moving), (end.joints, 0));
}

#[test]
fn returning_to_an_edges_pose_brings_the_arm_exactly_there() {
    let served = Served::start("world-ideal.yaml", Pace::Fast);
    let (recording, mut robot) = robot(&served);
    robot.move_joints(&turn(1, -10.0)).unwrap();
    let edge =
        *recording.emitted::<DigitalInputs>("inputs").iter().find(|message| message.changed != 0).unwrap();
    robot.move_joints(&Motion::absolute(edge.joints, 1.0)).unwrap();
    let truth = served.connect().look().unwrap();
    assert!((truth.sensor_mm[2] - 8.0).abs() < 1e-11, "{:?}", truth.sensor_mm);
    assert!(truth.fired);
}

#[test]
fn a_move_in_real_time_is_reported_on_its_way() {
    let served = Served::start("world-ideal.yaml", Pace::Real);
    let (recording, mut robot) = robot(&served);
    robot.move_joints(&turn(0, 8.0)).unwrap();
    let states = recording.emitted::<JointState>("joints");
    let moving = states.iter().filter(|state| state.is_moving()).count();
    assert!(moving >= 5, "{moving} states on the way");
    assert!(states.windows(2).all(|pair| pair[0].time_ns <= pair[1].time_ns));
}

#[test]
fn a_stop_ends_a_move_with_the_arm_at_rest() {
    let served = Served::start("world-ideal.yaml", Pace::Real);
    let (recording, mut robot) = robot(&served);
    let before = robot.read_joints().unwrap();
    let (stopper, mut watcher) = (recording.clone(), served.connect());
    let stopping = std::thread::spawn(move || {
        let started = watcher.read(WorldCommand::Read {}).unwrap().joints;
        until("the move", || watcher.read(WorldCommand::Read {}).unwrap().joints != started);
        stopper.set_stop(true);
    });
    let error = robot.move_joints(&turn(0, 60.0)).unwrap_err();
    stopping.join().unwrap();
    assert!(matches!(error, PluginError::Stopped(_)));
    robot.stop().unwrap();
    let after = robot.read_joints().unwrap();
    assert!(!after.is_moving());
    let went = (after.joints.as_slice()[0] - before.joints.as_slice()[0]).to_degrees();
    assert!(went > 0.0 && went < 45.0, "{went}");
    let last = *recording.emitted::<JointState>("joints").last().unwrap();
    assert_eq!(last.joints, after.joints);
}

#[test]
fn a_stop_asked_for_before_a_move_keeps_the_arm_still() {
    for pace in [Pace::Real, Pace::Fast] {
        let served = Served::start("world-ideal.yaml", pace);
        let (recording, mut robot) = robot(&served);
        let before = robot.read_joints().unwrap();
        recording.set_stop(true);
        assert!(matches!(robot.move_joints(&turn(0, 60.0)), Err(PluginError::Stopped(_))));
        assert_eq!(robot.read_joints().unwrap().joints, before.joints);
    }
}

#[test]
fn the_operator_drives_until_the_stop_key() {
    let served = Served::start("world-ideal.yaml", Pace::Fast);
    let (_, mut robot) = robot(&served);
    let mut operator = served.connect();
    let before = robot.jog(true).unwrap();
    assert_eq!((before.key, before.finished), (0, 0));
    let joints: [_; 6] = std::array::from_fn(|axis| (axis == 2).then_some(0.05));
    operator.read(WorldCommand::Move { joints: joints.into(), relative: true, speed: 0.5 }).unwrap();
    let meanwhile = robot.jog(true).unwrap();
    let went = meanwhile.state.joints.as_slice()[2] - before.state.joints.as_slice()[2];
    assert!((went - 0.05).abs() < 1e-12);
    operator.read(WorldCommand::Key { key: PendantKey::Stop }).unwrap();
    let end = robot.jog(false).unwrap();
    assert_eq!((end.key, end.finished), (7, 1));
}

#[test]
fn lines_and_zero_are_set() {
    let served = Served::start("world-ideal.yaml", Pace::Fast);
    let (_, mut robot) = robot(&served);
    robot.write_outputs(0b10110).unwrap();
    assert_eq!(served.connect().read(WorldCommand::Read {}).unwrap().outputs, 0b10110);
    let error = robot.write_outputs(1 << 5).unwrap_err();
    assert_eq!(
        error.to_string(),
        "output levels 0b100000 set a line past the last; the arm has the lines 0 to 4"
    );
    robot.set_zero(&JointVector::from_slice(&[0.1, 0.2, -1.0, -1.5, 0.0, 5.0]).unwrap()).unwrap();
    let state = robot.read_joints().unwrap();
    assert!((state.joints.as_slice()[2] + 1.0).abs() < 1e-12);
    let error = robot.set_zero(&JointVector::zeros(3)).unwrap_err();
    assert_eq!(error.to_string(), "3 joint values for an arm of 6 joints");
}

#[test]
fn bad_configurations_are_refused_with_what_would_be_right() {
    let served = Served::start("world-ideal.yaml", Pace::Fast);
    for (config, sentence) in [
        (
            json!(null),
            "a simulated robot takes the name of its world's arm, as {arm: teachmover}, {arm: puma560} or what an arm file says, and, from the cell, the socket of its world",
        ),
        (json!({"arm": "teachmover"}), "missing field `world`"),
        (json!({"arm": "teachmover", "world": served.socket, "speed": 3}), "unknown field `speed`"),
        (
            json!({"arm": "puma", "world": served.socket}),
            "there is no arm `puma` in the world `TeachMover over a T target, ideal`; write `arm: teachmover`",
        ),
    ] {
        let error = SimulatedRobot::create(&config, RecordingHost::new().host()).unwrap_err();
        assert!(matches!(error, PluginError::Refused(_)), "{error:?}");
        assert!(error.to_string().contains(sentence), "{error}");
    }
}

#[test]
fn a_world_that_is_not_there_or_goes_is_a_broken_connection() {
    let config = json!({"arm": "teachmover", "world": "/nowhere/at/all"});
    let error = SimulatedRobot::create(&config, RecordingHost::new().host()).unwrap_err();
    assert!(matches!(error, PluginError::Disconnected(_)));

    let mut served = Served::start("world-ideal.yaml", Pace::Fast);
    let (_, mut robot) = robot(&served);
    served.connect().call(WorldCommand::Shutdown {}, || false, |_| {}).unwrap();
    served.ended().unwrap();
    let error = robot.read_joints().unwrap_err();
    assert!(matches!(error, PluginError::Disconnected(_)), "{error:?}");
}

#[test]
fn a_robot_that_is_dropped_leaves_the_world_as_it_was() {
    let served = Served::start("world-ideal.yaml", Pace::Fast);
    let (_, mut first) = robot(&served);
    let end = first.move_joints(&turn(0, -5.0)).unwrap();
    drop(first);
    let (_, mut second) = robot(&served);
    assert_eq!(second.read_joints().unwrap().joints, end.joints);
}

#[test]
fn the_manifest_is_of_this_contract() {
    let manifest = Manifest::parse(include_str!("../plugin.yaml"), "plugin.yaml").unwrap();
    assert_eq!(manifest.id, "simulated");
    assert_eq!(manifest.kind, DeviceKind::Robot);
    // The first version that has all it uses: a later one would ask for a newer program without need.
    assert_eq!(manifest.contract, ContractVersion(1, 0));
}
