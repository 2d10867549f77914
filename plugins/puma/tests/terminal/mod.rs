//! The driver at the terminal of an emulated controller, over the arm of a world of its own.

pub(crate) mod conversations;
pub(crate) mod poses;
pub(crate) mod relay;
pub(crate) mod stops;

use std::path::{Path, PathBuf};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use plumb_plugin::recording::RecordingHost;
use plumb_plugin::{JointState, JointVector, Motion, PluginError, Robot};
use plumb_puma::Puma;
use plumb_simulated::client::WorldClient;
use plumb_simulated::emulate::val2::{Dialect, Emulator, EmulatorOptions, LineOptions};
use plumb_simulated::protocol::{Pace, WorldCommand};
use plumb_simulated::serve::{ServeError, ServeOptions, serve};
use serde_json::{Value, json};

const PATIENCE: Duration = Duration::from_secs(30);
pub(crate) const READY: [f64; 6] = [0.0, -90.0, 90.0, 0.0, 0.0, 0.0];
pub(crate) const LEFTY: [f64; 6] = [90.0, 0.0, 180.0, 90.0, 0.0, 45.0];

/// A world with a PUMA, served.
pub(crate) struct World {
    pub(crate) client: WorldClient,
    pub(crate) socket: PathBuf,
    server: Option<JoinHandle<Result<(), ServeError>>>,
    _folder: tempfile::TempDir,
}

impl World {
    pub(crate) fn start(pace: Pace) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let (file, socket) = (folder.path().join("world.yaml"), folder.path().join("world"));
        std::fs::write(&file, "world: w\narm: {puma560: {resolution: encoder}}\n").unwrap();
        let options =
            ServeOptions { file, socket: socket.clone(), pace, seed: None, idle: Duration::from_secs(600) };
        let server = std::thread::spawn(move || serve(&options));
        Self { client: connect(&socket), socket, server: Some(server), _folder: folder }
    }

    /// Somebody turns a joint (from 0) by so many degrees with the teach pendant.
    pub(crate) fn pendant_turns(&mut self, joint: usize, degrees: f64) {
        let joints: [_; 6] = std::array::from_fn(|axis| (axis == joint).then_some(degrees.to_radians()));
        self.client.read(WorldCommand::Move { joints: joints.into(), relative: true, speed: 1.0 }).unwrap();
    }

    /// Where the world's arm is, as its drive counts, deg.
    pub(crate) fn joints(&mut self) -> [f64; 6] {
        self.client.read(WorldCommand::Read {}).unwrap().joints.fixed::<6>().unwrap().map(f64::to_degrees)
    }
}

impl Drop for World {
    fn drop(&mut self) {
        let _ = self.client.call(WorldCommand::Shutdown {}, || false, |_| {});
        if let Some(server) = self.server.take() {
            let _ = server.join();
        }
    }
}

/// A line that keeps the time of its bytes.
pub(crate) fn at_9600() -> LineOptions {
    LineOptions { baud: Some(9600), ..LineOptions::default() }
}

pub(crate) fn connect(socket: &Path) -> WorldClient {
    let deadline = Instant::now() + PATIENCE;
    loop {
        match WorldClient::connect(socket, "operator") {
            Ok(client) => return client,
            Err(error) if Instant::now() > deadline => panic!("{error}"),
            Err(_) => std::thread::sleep(Duration::from_millis(2)),
        }
    }
}

pub(crate) struct Cell {
    pub(crate) arm: Puma,
    pub(crate) emulator: Emulator,
    pub(crate) recording: RecordingHost,
    pub(crate) world: World,
}

impl Cell {
    pub(crate) fn of(options: EmulatorOptions, pace: Pace, config: &Value) -> Self {
        let world = World::start(pace);
        let emulator = Emulator::start(EmulatorOptions { world: world.socket.clone(), ..options }).unwrap();
        let recording = RecordingHost::new();
        let mut config = config.clone();
        config["port"] = json!(emulator.status().port);
        let arm = Puma::create(&config, recording.host()).unwrap();
        Self { arm, emulator, recording, world }
    }

    pub(crate) fn speaking(dialect: Dialect) -> Self {
        Self::of(EmulatorOptions { dialect, ..EmulatorOptions::default() }, Pace::Fast, &json!({}))
    }

    pub(crate) fn go(&mut self, degrees: [f64; 6]) -> Result<JointState, PluginError> {
        let target = JointVector::from_slice(&degrees.map(f64::to_radians)).unwrap();
        self.arm.move_joints(&Motion::absolute(target, 1.0))
    }

    pub(crate) fn assert_at(&mut self, degrees: [f64; 6]) {
        let reported = self.arm.read_joints().unwrap().joints;
        for (index, (expected, made)) in degrees.iter().zip(self.world.joints()).enumerate() {
            assert!((expected - made).abs() < 0.012, "joint {}: {expected} {made}", index + 1);
            let reported = reported.get(index).unwrap().to_degrees();
            assert!((reported - made).abs() < 0.012, "joint {}: reported {reported}, made {made}", index + 1);
        }
    }
}

impl Cell {
    pub(crate) fn assert_world_at(&mut self, degrees: [f64; 6]) {
        for (expected, made) in degrees.iter().zip(self.world.joints()) {
            assert!((expected - made).abs() < 0.012);
        }
    }
}
