//! The simulated world, its arm and its sensor as they run in a cell: three processes, joined by a socket and shared memory.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use plumb_bus::{Bus, Domain};
use plumb_host::{
    HostArguments, HostCommand, HostProcess, Plugin, RobotClient, SensorClient, StopOutcome, WiredInput,
};
use plumb_plugin::{FrameHeader, JointState, JointVector, Motion, ProximityEdge, Value};
use plumb_simulated::client::WorldClient;
use plumb_simulated::protocol::WorldCommand;
use plumb_simulated::serve::clock_file;
use serde_json::json;
use tempfile::TempDir;

/// Longer than anything here may take.
const LONG: Duration = Duration::from_secs(30);

const WAIST: usize = 0;
const SHOULDER: usize = 1;
const ELBOW: usize = 2;

/// A world, and a domain in which hosts meet.
struct Cell {
    world: Child,
    socket: PathBuf,
    bus: Option<Bus>,
    domain: Domain,
    _directory: TempDir,
}

impl Cell {
    fn new(world_file: &str, pace: &str) -> Cell {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let directory = tempfile::Builder::new().prefix("pw").tempdir().unwrap();
        let socket = directory.path().join("world");
        let file = root().join("workcells/teachmover").join(world_file);
        let world = Command::new(env!("CARGO_BIN_EXE_plumb"))
            .args(["world", "--pace", pace, "--socket"])
            .arg(&socket)
            .arg("--file")
            .arg(file)
            .stdin(Stdio::null())
            .spawn()
            .unwrap();
        until("the world's socket", || socket.exists());
        let prefix = format!("plumbworld_{}_{}_", std::process::id(), COUNT.fetch_add(1, Ordering::Relaxed));
        let domain = Domain::new(&prefix, &directory.path().join("r")).unwrap();
        let bus = Some(Bus::open(&domain, "test").unwrap());
        Cell { world, socket, bus, domain, _directory: directory }
    }

    fn bus(&self) -> &Bus {
        self.bus.as_ref().unwrap()
    }

    fn operator(&self) -> WorldClient {
        WorldClient::connect(&self.socket, "test").unwrap()
    }

    fn host(&self, device: &str, plugin: &str, config: Value, inputs: Vec<WiredInput>) -> HostProcess {
        let mut arguments = HostArguments::new(device, &self.domain, &plugin_named(plugin));
        arguments.config = config;
        arguments.inputs = inputs;
        arguments.clock = Some(clock_file(&self.socket));
        let command = HostCommand::new(env!("CARGO_BIN_EXE_plumb").into(), ["host"]);
        HostProcess::spawn(self.bus(), &arguments, command).unwrap()
    }

    fn arm(&self) -> HostProcess {
        self.host("arm", "simulated", json!({"arm": "teachmover", "world": self.socket}), Vec::new())
    }

    fn eye(&self) -> HostProcess {
        let inputs = plugin_named("simulated").manifest.streams;
        let stream = inputs.into_iter().find(|stream| stream.name == "inputs").unwrap();
        let line = WiredInput { input: "line".to_owned(), device: "arm".to_owned(), stream };
        self.host("eye", "ir-proximity", json!({"bit": 0}), vec![line])
    }
}

impl Drop for Cell {
    fn drop(&mut self) {
        if let Ok(mut client) = WorldClient::connect(&self.socket, "test") {
            let _ = client.call(WorldCommand::Shutdown {}, || false, |_| {});
        }
        let _ = self.world.kill();
        let _ = self.world.wait();
        self.bus = None;
        let _ = self.domain.remove();
    }
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// A plugin of this workspace, as the test's own build made it.
fn plugin_named(name: &str) -> Plugin {
    let library = format!("libplumb_{}.so", name.replace('-', "_"));
    let beside_this_test = std::env::current_exe().unwrap().parent().unwrap().join(library);
    Plugin::at_library(&root().join("plugins").join(name).join("plugin.yaml"), &beside_this_test).unwrap()
}

fn until(what: &str, mut so: impl FnMut() -> bool) {
    let deadline = Instant::now() + LONG;
    while !so() {
        assert!(Instant::now() < deadline, "{what} did not come");
        thread::sleep(Duration::from_millis(2));
    }
}

fn turn(joint: usize, by_deg: f64) -> Motion {
    let mut change = JointVector::zeros(6);
    change.set(joint, by_deg.to_radians());
    Motion::relative(change, 1.0).only(1 << joint)
}

/// Turns a joint two degrees at a time until the sensor changes, and returns to where it did.
fn search(arm: &RobotClient, eye: &SensorClient, joint: usize, by_deg: f64, fires: bool) -> ProximityEdge {
    eye.arm().unwrap();
    for _ in 0..20 {
        let state = arm.move_joints(&turn(joint, 2_f64.copysign(by_deg)), LONG).unwrap();
        let reading = eye.read(state.time_ns, LONG).unwrap();
        if let Some(edge) = reading.edges.iter().find(|edge| edge.has_fired() == fires) {
            arm.move_joints(&Motion::absolute(edge.joints, 1.0), LONG).unwrap();
            return *edge;
        }
    }
    panic!("nothing found");
}

#[test]
fn an_edge_comes_from_the_world_through_both_hosts_to_the_last_digit() {
    let cell = Cell::new("world-ideal.yaml", "fast");
    let (arm_host, eye_host) = (cell.arm(), cell.eye());
    let (arm, eye) = (arm_host.robot().unwrap(), eye_host.sensor().unwrap());
    arm.activate().unwrap();
    eye.activate().unwrap();
    search(&arm, &eye, SHOULDER, -1.0, true);
    let truth = cell.operator().look().unwrap();
    assert!((truth.sensor_mm[2] - 8.0).abs() < 1e-11, "{:?}", truth.sensor_mm);
    let line_a = search(&arm, &eye, WAIST, -1.0, false);
    let zero_error = -line_a.joints.as_slice()[WAIST].to_degrees();
    assert!((zero_error - 1.7).abs() < 1e-10, "{zero_error}");
}

/// The first digits of the paper's Table 2-1, from edges that came through all processes.
#[test]
fn three_cycles_over_shared_memory_give_table_2_1() {
    let cell = Cell::new("world-no-table.yaml", "fast");
    let (arm_host, eye_host) = (cell.arm(), cell.eye());
    let (arm, eye) = (arm_host.robot().unwrap(), eye_host.sensor().unwrap());
    arm.activate().unwrap();
    eye.activate().unwrap();
    let mut errors_micron = Vec::new();
    for _ in 0..4 {
        search(&arm, &eye, SHOULDER, -1.0, true);
        let edge = search(&arm, &eye, ELBOW, -1.0, false);
        let joints = edge.joints.as_slice();
        let height = 195.0 + 177.8 * (joints[SHOULDER].sin() + joints[ELBOW].sin());
        errors_micron.push((height - 116.958_309_995_105_1) * 1e3);
        let mut back = turn(SHOULDER, 5.0);
        back.target.set(ELBOW, 5_f64.to_radians());
        back.joint_mask |= 1 << ELBOW;
        arm.move_joints(&back, LONG).unwrap();
    }
    for (found, (printed, digit)) in
        errors_micron.iter().zip([(-10138.6, 0.1), (178.24, 0.01), (-5.6352, 1e-4), (0.17658, 1e-5)])
    {
        assert!((found - printed).abs() < 0.51 * digit, "{errors_micron:?}");
    }
}

#[test]
fn a_host_killed_in_mid_move_leaves_the_arm_at_rest_and_another_finds_it_there() {
    let cell = Cell::new("world-ideal.yaml", "real");
    let host = cell.arm();
    let arm = host.robot().unwrap();
    arm.activate().unwrap();
    let mut operator = cell.operator();
    let process = i32::try_from(host.process()).unwrap();
    thread::scope(|scope| {
        let moving = scope.spawn(|| arm.move_joints(&turn(WAIST, 60.0), LONG));
        until("the move", || operator.read(WorldCommand::Read {}).unwrap().moving);
        kill(Pid::from_raw(process), Signal::SIGKILL).unwrap();
        let error = moving.join().unwrap().unwrap_err();
        assert!(error.to_string().starts_with("the host of arm was ended by SIGKILL"), "{error}");
    });
    until("the arm's rest", || !operator.read(WorldCommand::Read {}).unwrap().moving);
    let stopped = operator.read(WorldCommand::Read {}).unwrap();
    assert!((stopped.joints[WAIST] - operator.welcome().joints[WAIST].home).to_degrees() < 55.0);
    let another = cell.arm();
    let found: JointState = another.robot().unwrap().read_joints().unwrap();
    assert_eq!(found.joints.as_slice(), stopped.joints.as_slice());
    assert!(!found.is_moving());
}

#[test]
fn a_stop_brings_the_simulated_arm_to_rest() {
    let cell = Cell::new("world-worn.yaml", "real");
    let host = cell.arm();
    let (arm, stop) = (host.robot().unwrap(), host.stop_handle().unwrap());
    arm.activate().unwrap();
    let mut operator = cell.operator();
    thread::scope(|scope| {
        let moving = scope.spawn(|| arm.move_joints(&turn(WAIST, 60.0), LONG));
        until("the move", || operator.read(WorldCommand::Read {}).unwrap().moving);
        let outcome = stop.stop(LONG);
        assert!(matches!(outcome, StopOutcome::Stopped { .. }), "{outcome:?}");
        assert!(moving.join().unwrap().unwrap_err().is_stop());
    });
    assert!(!operator.read(WorldCommand::Read {}).unwrap().moving);
}

/// A stripe sensor that is wired to a camera and an arm the test plays itself.
struct Stripe {
    sensor: SensorClient,
    camera: plumb_bus::Publisher,
    arm: plumb_bus::Publisher,
    host: HostProcess,
}

const SIDE: u32 = 64;

impl Stripe {
    fn new(cell: &Cell) -> Self {
        let wired = |input: &str, device: &str, plugin: &str, name: &str| {
            let streams = plugin_named(plugin).manifest.streams;
            let stream = streams.into_iter().find(|stream| stream.name == name).unwrap();
            WiredInput { input: input.to_owned(), device: device.to_owned(), stream }
        };
        let frames = wired("frames", "camera", "simulated-camera", "frames");
        let joints = wired("pose", "arm", "simulated", "joints");
        let camera = cell.bus().publisher("camera", &frames.stream).unwrap();
        let arm = cell.bus().publisher("arm", &joints.stream).unwrap();
        let host =
            cell.host("stripe", "light-stripe", json!({"threshold": {"fixed": 60}}), vec![frames, joints]);
        let sensor = host.sensor().unwrap();
        sensor.activate().unwrap();
        sensor.arm().unwrap();
        Self { sensor, camera, arm, host }
    }

    /// The arm reports that it is at rest.
    fn holds_still(&mut self, time_ns: u64) {
        let state = JointState::new(time_ns, JointVector::zeros(6), false);
        self.arm.emit(bytemuck::bytes_of(&state)).unwrap();
    }

    /// The camera sends a picture of a stripe, so many bytes of its message.
    fn shows(&mut self, time_ns: u64, side: u32, bytes: usize) {
        let header = FrameHeader { time_ns, width: side, height: side, ..FrameHeader::default() };
        let mut message = vec![0; header.message_bytes()];
        let pixels = header.write(&mut message).unwrap();
        for (at, pixel) in pixels.iter_mut().enumerate() {
            *pixel = if at % side as usize == 20 { 200 } else { 5 };
        }
        self.camera.emit(&message[..bytes.min(message.len())]).unwrap();
    }

    /// The rows of the stripe up to a moment, or what is wrong.
    fn rows(&self, after_ns: u64) -> Result<f64, String> {
        let reading = self.sensor.read(after_ns, LONG).map_err(|error| error.to_string())?;
        Ok(reading.quantities.iter().find(|one| one.name == "rows").unwrap().value)
    }
}

/// A second ago by the clock that worlds begin with, ns.
fn a_second_ago() -> u64 {
    let now = nix::time::clock_gettime(nix::time::ClockId::CLOCK_MONOTONIC).unwrap();
    u64::try_from(now.tv_sec() - 1).unwrap() * 1_000_000_000
}

#[test]
fn pictures_late_out_of_order_cut_short_or_of_another_size_are_errors_of_the_stream_and_it_goes_on() {
    // Dated as a camera of this cell would: what is hours behind the cell's clock is refused for that alone. Taken before the world begins, whose clock stands where
    // it began until something moves: however long the hosts take to start, nothing is ahead of it.
    let began = a_second_ago();
    let cell = Cell::new("world-ideal.yaml", "fast");
    let mut stripe = Stripe::new(&cell);
    stripe.holds_still(began + 1_000_000);
    let whole = usize::MAX;
    for (after_ns, side, bytes, expected) in [
        (500_000, SIDE, whole, "so late that where the robot was at its exposure is no longer known"),
        (9_000_000, SIDE, 1024, "a message of frame/1 has 1024 bytes; its header says 4128"),
    ] {
        stripe.shows(began + after_ns, side, bytes);
        let message = stripe.rows(u64::MAX).unwrap_err();
        assert!(message.contains(expected), "{message}");
    }
    stripe.shows(began + 9_000_000, SIDE, whole);
    assert_eq!(stripe.rows(began + 9_000_000), Ok(64.0));
    for (after_ns, side, bytes, expected) in [
        (8_000_000, SIDE, whole, "a picture came out of order, 1.0 ms behind one that came before it"),
        (10_000_000, 32, whole, "a picture of 32 x 32 pixels came; those before it had 64 x 64"),
    ] {
        stripe.shows(began + after_ns, side, bytes);
        let message = stripe.rows(u64::MAX).unwrap_err();
        assert!(message.contains(expected), "{message}");
    }
    stripe.shows(began + 11_000_000, SIDE, whole);
    assert_eq!(stripe.rows(began + 11_000_000), Ok(64.0), "it goes on");
    stripe.host.finish(LONG);
}
