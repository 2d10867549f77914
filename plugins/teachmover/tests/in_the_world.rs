//! The driver, the emulated controller and the simulated world: what the controller counts, the world's arm has done.

#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test that cannot go on fails")]

use std::path::{Path, PathBuf};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use plumb_plugin::recording::RecordingHost;
use plumb_plugin::{DigitalInputs, JointState, JointVector, Motion, PluginError, Robot};
use plumb_simulated::client::WorldClient;
use plumb_simulated::emulate::teachmover::{Emulator, Event, LineOptions, MotorsInWorld};
use plumb_simulated::protocol::{Pace, PendantKey, WorldCommand};
use plumb_simulated::serve::{ServeError, ServeOptions, serve};
use plumb_teachmover::TeachMover;
use plumb_teachmover::drive::Joint;
use serde_json::json;

const PATIENCE: Duration = Duration::from_secs(30);

/// The sensor's line.
const SENSOR: u32 = 0;

struct Cell {
    arm: TeachMover,
    emulator: Emulator,
    /// The operator's own connection to the world.
    world: WorldClient,
    recording: RecordingHost,
    server: Option<JoinHandle<Result<(), ServeError>>>,
    _folder: tempfile::TempDir,
}

impl Cell {
    /// A cell around the arm of a world file, with `replaced` in its text.
    fn of(file: &str, replaced: &[(&str, &str)]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let socket = folder.path().join("world");
        let server = start_world(folder.path(), file, replaced, &socket);
        let world = connect(&socket);
        let motors = MotorsInWorld::connect(&socket).unwrap();
        let emulator = Emulator::start(LineOptions::default(), Box::new(motors)).unwrap();
        let config = json!({
            "port": emulator.status().port.unwrap(),
            "grip_switch": {"bit": 7},
            "only_the_pendant_stops": ["hand_control"],
        });
        let recording = RecordingHost::new();
        let arm = TeachMover::create(&config, recording.host()).unwrap();
        Self { arm, emulator, world, recording, server: Some(server), _folder: folder }
    }

    fn turn(&mut self, joint: Joint, by_deg: f64) -> Result<JointState, PluginError> {
        let mut change = JointVector::zeros(6);
        change.set(joint.index(), by_deg.to_radians());
        self.arm.move_joints(&Motion::relative(change, 1.0).only(1 << joint.index()))
    }

    /// The joints as the world's arm has made them and as the driver reports them, at most `half_steps` apart.
    fn assert_agreed(&mut self, half_steps: f64) {
        let reported = self.arm.read_joints().unwrap().joints;
        let made = self.world.read(WorldCommand::Read {}).unwrap().joints;
        for (joint, (reported, made)) in Joint::ALL.into_iter().zip(reported.as_slice().iter().zip(made)) {
            let apart = (reported - made).abs() * joint.half_steps_per_unit();
            assert!(apart <= half_steps + 1e-6, "{}: reported {reported}, made {made}", joint.name());
        }
    }
}

impl Drop for Cell {
    fn drop(&mut self) {
        let _ = self.world.call(WorldCommand::Shutdown {}, || false, |_| {});
        if let Some(server) = self.server.take() {
            let _ = server.join();
        }
    }
}

fn start_world(
    folder: &Path,
    file: &str,
    replaced: &[(&str, &str)],
    socket: &Path,
) -> JoinHandle<Result<(), ServeError>> {
    let original = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../workcells/teachmover").join(file);
    let mut text = std::fs::read_to_string(original).unwrap();
    for (from, to) in replaced {
        assert!(text.contains(from), "{file} does not contain {from}");
        text = text.replace(from, to);
    }
    let copy: PathBuf = folder.join("world.yaml");
    std::fs::write(&copy, text).unwrap();
    let options = ServeOptions {
        file: copy,
        socket: socket.to_owned(),
        pace: Pace::Fast,
        seed: None,
        idle: Duration::from_secs(600),
    };
    std::thread::spawn(move || serve(&options))
}

fn connect(socket: &Path) -> WorldClient {
    let deadline = Instant::now() + PATIENCE;
    loop {
        match WorldClient::connect(socket, "operator") {
            Ok(client) => return client,
            Err(error) if Instant::now() > deadline => panic!("{error}"),
            Err(_) => std::thread::sleep(Duration::from_millis(2)),
        }
    }
}

const HALF_STEPS: [(&str, &str); 1] = [("resolution: continuous", "resolution: half_step")];

#[test]
fn the_worlds_arm_does_what_the_controller_counts() {
    for (file, replaced) in [("world-ideal.yaml", &HALF_STEPS[..]), ("world-worn.yaml", &[])] {
        let mut cell = Cell::of(file, replaced);
        for (joint, by_deg) in [
            (Joint::Waist, -12.3),
            (Joint::Shoulder, 4.5),
            (Joint::Elbow, -6.7),
            (Joint::WristPitch, 8.9),
            (Joint::WristRoll, 21.0),
        ] {
            let state = cell.turn(joint, by_deg).unwrap();
            assert!(!state.is_moving());
            cell.assert_agreed(0.0);
        }
    }
}

#[test]
fn a_stop_anywhere_in_a_move_leaves_registers_and_world_alike() {
    let mut cell = Cell::of("world-worn.yaml", &[]);
    for half_steps in [0, 1, 2, 7, 11, 16, 40] {
        cell.emulator.inject(Event::StopAfter(half_steps));
        let way = if half_steps % 2 == 0 { 9.0 } else { -9.0 };
        let stopped = cell.turn(Joint::Waist, way).unwrap_err();
        assert!(matches!(stopped, PluginError::Stopped(_)), "{stopped:?}");
        cell.arm.activate().unwrap();
        cell.assert_agreed(0.0);
    }
}

#[test]
fn a_stop_at_the_worlds_pendant_is_a_stop_of_the_move() {
    let mut cell = Cell::of("world-worn.yaml", &[]);
    cell.world.read(WorldCommand::Key { key: PendantKey::Stop }).unwrap();
    let stopped = cell.turn(Joint::Waist, -9.0).unwrap_err();
    assert!(
        stopped.text().starts_with("the STOP key on the pendant was pressed; the arm is at"),
        "{stopped}"
    );
    cell.assert_agreed(0.0);
    cell.turn(Joint::Waist, -9.0).unwrap();
    cell.assert_agreed(0.0);
}

#[test]
fn the_sensors_line_changes_between_the_poses_the_driver_reports() {
    let mut cell = Cell::of("world-ideal.yaml", &HALF_STEPS);
    let mut change = None;
    for _ in 0..40 {
        cell.turn(Joint::Shoulder, -0.5).unwrap();
        let emitted = cell.recording.emitted::<DigitalInputs>("inputs");
        change = emitted.into_iter().find(|inputs| inputs.has_changed(SENSOR));
        if change.is_some() {
            break;
        }
    }
    let change = change.expect("the sensor does not fire");
    assert!(change.level(SENSOR));
    let shoulder = Joint::Shoulder.index();
    let (middle, half_width) =
        (change.joints.get(shoulder).unwrap(), change.joints_half_width.get(shoulder).unwrap());
    // 0.5 degrees are 10 half-steps, one piece: the change is known to within half of it.
    assert!((half_width * Joint::Shoulder.half_steps_per_unit() - 5.0).abs() < 0.6, "{half_width}");
    let here = cell.world.read(WorldCommand::Read {}).unwrap();
    assert_eq!(here.inputs & 1, 1);
    assert!((here.joints[shoulder] - middle).abs() <= half_width + 1e-9);
    for other in [Joint::Waist, Joint::Elbow, Joint::WristPitch] {
        assert_eq!(change.joints_half_width.get(other.index()), Some(0.0));
    }
}

#[test]
fn under_hand_control_the_operator_places_the_arm_and_the_registers_follow() {
    for (file, apart) in [("world-worn.yaml", 0.0), ("world-ideal.yaml", 0.5)] {
        let mut cell = Cell::of(file, &[]);
        assert_eq!(cell.arm.jog(true).unwrap().finished, 0);
        let deadline = Instant::now() + PATIENCE;
        while !cell.world.read(WorldCommand::Read {}).unwrap().pendant {
            assert!(Instant::now() < deadline, "the controller does not hand the arm over");
            std::thread::sleep(Duration::from_millis(2));
        }
        let mut there = [None; 6];
        there[Joint::Waist.index()] = Some(0.05);
        there[Joint::Shoulder.index()] = Some(0.8);
        cell.world.read(WorldCommand::Place { joints: there.into() }).unwrap();
        assert_eq!(cell.arm.jog(true).unwrap().finished, 0);
        cell.world.read(WorldCommand::Key { key: PendantKey::Stop }).unwrap();
        while cell.arm.jog(true).unwrap().finished == 0 {
            assert!(Instant::now() < deadline, "hand control does not end");
            std::thread::sleep(Duration::from_millis(2));
        }
        cell.assert_agreed(apart);
        cell.turn(Joint::Waist, 3.0).unwrap();
        cell.assert_agreed(apart);
    }
}

#[test]
fn the_gripper_stops_at_what_the_world_puts_between_its_fingers() {
    let mut cell = Cell::of("world-ideal.yaml", &HALF_STEPS);
    cell.world.read(WorldCommand::Hold { width_mm: 12.0 }).unwrap();
    let target = JointVector::from_slice(&[0.0; 6]).unwrap();
    let closed =
        cell.arm.move_joints(&Motion::absolute(target, 0.5).only(1 << Joint::Gripper.index())).unwrap();
    let opening = closed.joints.get(Joint::Gripper.index()).unwrap();
    assert!((11.3..=12.1).contains(&opening), "{opening}");
    assert!(cell.arm.read_inputs().unwrap().level(7));
}
