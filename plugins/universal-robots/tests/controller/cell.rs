//! A world with a UR5, an emulated controller over it, and the driver.

use std::path::PathBuf;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use plumb_plugin::recording::RecordingHost;
use plumb_plugin::{JointState, JointVector, Motion, PluginError, Robot};
use plumb_simulated::client::WorldClient;
use plumb_simulated::emulate::universal_robots::{Emulator, EmulatorOptions};
use plumb_simulated::protocol::{Pace, WorldCommand};
use plumb_simulated::serve::{ServeError, ServeOptions, serve};
use plumb_universal_robots::UniversalRobot;
use serde_json::{Value, json};

const PATIENCE: Duration = Duration::from_secs(30);

/// Where the arm is upright, deg.
pub(crate) const UPRIGHT: [f64; 6] = [0.0, -90.0, 0.0, -90.0, 0.0, 0.0];

/// A world with a UR5, served.
pub(crate) struct World {
    pub(crate) client: WorldClient,
    pub(crate) socket: PathBuf,
    server: Option<JoinHandle<Result<(), ServeError>>>,
    _folder: tempfile::TempDir,
}

impl World {
    pub(crate) fn start(pace: Pace) -> Self {
        let folder = tempfile::Builder::new().prefix("plumb-ur-").tempdir().unwrap();
        let (file, socket) = (folder.path().join("world.yaml"), folder.path().join("world"));
        let arm = include_str!("../../../../workcells/ur5/ur5.arm.yaml");
        std::fs::write(folder.path().join("ur5.arm.yaml"), arm).unwrap();
        std::fs::write(&file, "world: w\narm: {described: {by: ur5.arm.yaml}}\n").unwrap();
        let options =
            ServeOptions { file, socket: socket.clone(), pace, seed: None, idle: Duration::from_secs(600) };
        let server = std::thread::spawn(move || serve(&options));
        Self { client: connect(&socket), socket, server: Some(server), _folder: folder }
    }

    /// Where the world's arm is, deg, and whether it moves.
    pub(crate) fn joints(&mut self) -> ([f64; 6], bool) {
        let reading = self.client.read(WorldCommand::Read {}).unwrap();
        (reading.joints.fixed::<6>().unwrap().map(f64::to_degrees), reading.moving)
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

fn connect(socket: &std::path::Path) -> WorldClient {
    let deadline = Instant::now() + PATIENCE;
    loop {
        match WorldClient::connect(socket, "operator") {
            Ok(client) => return client,
            Err(error) if Instant::now() > deadline => panic!("{error}"),
            Err(_) => std::thread::sleep(Duration::from_millis(2)),
        }
    }
}

/// All three. The driver goes first when it is dropped, the world last.
pub(crate) struct Cell {
    pub(crate) arm: UniversalRobot,
    pub(crate) recording: RecordingHost,
    pub(crate) emulator: Emulator,
    pub(crate) world: World,
}

impl Cell {
    pub(crate) fn start() -> Self {
        Self::of(EmulatorOptions::default(), Pace::Real, &json!({})).unwrap()
    }

    pub(crate) fn of(options: EmulatorOptions, pace: Pace, config: &Value) -> Result<Self, PluginError> {
        let world = World::start(pace);
        let fast = pace == Pace::Fast;
        let options = EmulatorOptions { world: world.socket.clone(), fast, ..options };
        let emulator = Emulator::start(&options).unwrap();
        let recording = RecordingHost::new();
        let arm = UniversalRobot::create(&configured(&emulator, config), recording.host())?;
        Ok(Self { arm, recording, emulator, world })
    }

    pub(crate) fn go(&mut self, degrees: [f64; 6]) -> Result<JointState, PluginError> {
        self.arm.move_joints(&Motion::absolute(radians(degrees), 1.0))
    }

    /// Sends the arm a long way, and lets something happen to the controller once it has moved by 5 degrees.
    pub(crate) fn go_until(
        &mut self,
        happen: impl FnOnce(&mut Emulator) + Send,
    ) -> Result<JointState, PluginError> {
        let Self { arm, emulator, world, .. } = self;
        let (begin, _) = world.joints();
        std::thread::scope(|scope| {
            let watching = scope.spawn(|| {
                let deadline = Instant::now() + PATIENCE;
                while (world.joints().0[0] - begin[0]).abs() < 5.0 && Instant::now() < deadline {
                    std::thread::sleep(Duration::from_millis(2));
                }
                happen(emulator);
            });
            let mut far = begin;
            far[0] += if begin[0] > 0.0 { -120.0 } else { 120.0 };
            let end = arm.move_joints(&Motion::absolute(radians(far), 1.0));
            watching.join().unwrap();
            end
        })
    }

    /// The arm comes to rest within this time, and stays there.
    pub(crate) fn assert_rests_within(&mut self, within: Duration) {
        let begin = Instant::now();
        // Between two cycles the world's arm may rest for a moment: the controller knows better.
        while self.emulator.status().moving {
            assert!(begin.elapsed() < within, "the arm moves on");
            std::thread::sleep(Duration::from_millis(2));
        }
        let (there, _) = self.world.joints();
        std::thread::sleep(Duration::from_millis(300));
        assert_eq!(self.world.joints(), (there, false));
    }
}

pub(crate) fn configured(emulator: &Emulator, config: &Value) -> Value {
    let mut config = config.clone();
    config["address"] = json!(emulator.status().address);
    config
}

pub(crate) fn radians(degrees: [f64; 6]) -> JointVector {
    JointVector::from_slice(&degrees.map(f64::to_radians)).unwrap()
}
