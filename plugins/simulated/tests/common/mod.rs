//! What the tests of the world have in common.

#![allow(dead_code, reason = "each test uses a part")]

use std::path::{Path, PathBuf};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use plumb_simulated::client::WorldClient;
use plumb_simulated::protocol::{Pace, WorldCommand};
use plumb_simulated::serve::{ServeError, ServeOptions, serve};
use plumb_simulated::world::{AXES, Joint, LineChange, MotionOrder, World, file};

/// A world file of those a user finds.
pub(crate) fn world_path(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../workcells/teachmover").join(name)
}

/// A world of one of those files.
pub(crate) fn world(name: &str) -> World {
    World::new(file::read(&world_path(name)).unwrap())
}

/// A world of one of those files with pieces of its text replaced.
pub(crate) fn world_with(name: &str, replacements: &[(&str, &str)]) -> World {
    let mut text = std::fs::read_to_string(world_path(name)).unwrap();
    for (from, to) in replacements {
        assert!(text.contains(from), "{name} does not contain {from}");
        text = text.replace(from, to);
    }
    World::new(file::parse(name, &text).unwrap())
}

/// Joint values in which one joint takes part.
pub(crate) fn only(joint: Joint, value: f64) -> [Option<f64>; AXES] {
    let mut joints = [None; AXES];
    joints[joint.index()] = Some(value);
    joints
}

/// Makes a motion to its end.
pub(crate) fn go(world: &mut World, joints: [Option<f64>; AXES], relative: bool) {
    world.begin(&MotionOrder { joints, relative, speed: 1.0 }).unwrap();
    world.finish_motion();
}

/// Turns one joint.
pub(crate) fn turn(world: &mut World, joint: Joint, by_deg: f64) {
    go(world, only(joint, by_deg.to_radians()), true);
}

/// Turns one joint, two degrees at a time and by at most `by_deg`, until the line rises or falls.
pub(crate) fn find(world: &mut World, joint: Joint, by_deg: f64, rises: bool) -> LineChange {
    find_in_chunks(world, joint, by_deg, 2.0, rises)
}

/// Turns one joint, `chunk_deg` at a time and by at most `by_deg`, until the line rises or falls.
pub(crate) fn find_in_chunks(
    world: &mut World,
    joint: Joint,
    by_deg: f64,
    chunk_deg: f64,
    rises: bool,
) -> LineChange {
    let chunk = chunk_deg.copysign(by_deg);
    for _ in 0..(by_deg / chunk).ceil() as u32 {
        let before = world.latest_change();
        turn(world, joint, chunk);
        let changes = world.changes_after(before);
        if let Some(found) = changes.into_iter().find(|change| (change.levels & change.changed != 0) == rises)
        {
            return found;
        }
    }
    panic!("nothing found within {by_deg} deg of {}: {:?}", joint.name(), world.truth());
}

/// As [`find`], and returns to where the line changed.
pub(crate) fn search(world: &mut World, joint: Joint, by_deg: f64, rises: bool) -> LineChange {
    let found = find(world, joint, by_deg, rises);
    go(world, found.joints.0.map(Some), false);
    found
}

/// Waits until something is so, with a deadline no working machine needs.
pub(crate) fn until(what: &str, mut so: impl FnMut() -> bool) {
    let deadline = Instant::now() + Duration::from_secs(30);
    while !so() {
        assert!(Instant::now() < deadline, "{what} did not come");
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// A served world that ends with the test.
pub(crate) struct Served {
    pub(crate) socket: PathBuf,
    directory: tempfile::TempDir,
    thread: Option<JoinHandle<Result<(), ServeError>>>,
}

impl Served {
    pub(crate) fn start(name: &str, pace: Pace) -> Served {
        Served::start_with(name, pace, Duration::from_secs(600))
    }

    pub(crate) fn start_file(file: &Path, pace: Pace) -> Served {
        Served::launch(file.to_owned(), pace, Duration::from_secs(600))
    }

    pub(crate) fn start_with(name: &str, pace: Pace, idle: Duration) -> Served {
        Served::launch(world_path(name), pace, idle)
    }

    fn launch(file: PathBuf, pace: Pace, idle: Duration) -> Served {
        let directory = tempfile::tempdir().unwrap();
        let socket = directory.path().join("world");
        let options = ServeOptions { file, socket: socket.clone(), seed: None, pace, idle };
        let thread = std::thread::spawn(move || serve(&options));
        let served = Served { socket, directory, thread: Some(thread) };
        until("the world's socket", || served.socket.exists());
        served
    }

    pub(crate) fn connect(&self) -> WorldClient {
        let mut client = None;
        until("a connection", || {
            client = WorldClient::connect(&self.socket, "test").ok();
            client.is_some()
        });
        client.unwrap()
    }

    pub(crate) fn directory(&self) -> &Path {
        self.directory.path()
    }

    /// Waits for the world to end by itself.
    pub(crate) fn ended(&mut self) -> Result<(), ServeError> {
        let thread = self.thread.take().unwrap();
        until("the world's end", || thread.is_finished());
        thread.join().unwrap()
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        if let Some(thread) = self.thread.take() {
            if let Ok(mut client) = WorldClient::connect(&self.socket, "test") {
                let _ = client.call(WorldCommand::Shutdown {}, || false, |_| {});
            }
            let _ = thread.join();
        }
    }
}
