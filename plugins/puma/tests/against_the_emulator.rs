//! The driver at the terminal of an emulated controller, over the arm of a world.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on fails")]

use std::cell::RefCell;
use std::path::{Path, PathBuf};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use plumb_plugin::recording::RecordingHost;
use plumb_plugin::{JointState, JointVector, Motion, PluginError, Robot, conformance};
use plumb_puma::Puma;
use plumb_simulated::client::WorldClient;
use plumb_simulated::emulate::val2::{Dialect, Emulator, EmulatorOptions, Event, LineOptions};
use plumb_simulated::protocol::{Pace, Verb};
use plumb_simulated::serve::{ServeError, ServeOptions, serve};
use serde_json::{Value, json};

const PATIENCE: Duration = Duration::from_secs(30);
const READY: [f64; 6] = [0.0, -90.0, 90.0, 0.0, 0.0, 0.0];
const LEFTY: [f64; 6] = [90.0, 0.0, 180.0, 90.0, 0.0, 45.0];
const FLIPPED: [f64; 6] = [90.0, 0.0, 180.0, 90.0, 0.0, -135.0];

/// A world with a PUMA, served.
struct World {
    client: WorldClient,
    socket: PathBuf,
    server: Option<JoinHandle<Result<(), ServeError>>>,
    _folder: tempfile::TempDir,
}

impl World {
    fn start(pace: Pace) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let (file, socket) = (folder.path().join("world.yaml"), folder.path().join("world"));
        std::fs::write(&file, "world: w\narm: {puma560: {resolution: encoder}}\n").unwrap();
        let options =
            ServeOptions { file, socket: socket.clone(), pace, seed: None, idle: Duration::from_secs(600) };
        let server = std::thread::spawn(move || serve(&options));
        Self { client: connect(&socket), socket, server: Some(server), _folder: folder }
    }

    /// Where the world's arm stands, as its drive counts, deg.
    fn joints(&mut self) -> [f64; 6] {
        self.client.read(Verb::Read {}).unwrap().joints.map(f64::to_degrees)
    }
}

impl Drop for World {
    fn drop(&mut self) {
        let _ = self.client.call(Verb::Shutdown {}, || false, |_| {});
        if let Some(server) = self.server.take() {
            let _ = server.join();
        }
    }
}

/// A line that keeps the time of its bytes.
fn at_9600() -> LineOptions {
    LineOptions { baud: Some(9600), ..LineOptions::default() }
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

struct Cell {
    arm: Puma,
    emulator: Emulator,
    recording: RecordingHost,
    world: World,
}

impl Cell {
    fn of(options: EmulatorOptions, pace: Pace, config: &Value) -> Self {
        let world = World::start(pace);
        let emulator = Emulator::start(EmulatorOptions { world: world.socket.clone(), ..options }).unwrap();
        let recording = RecordingHost::new();
        let mut config = config.clone();
        config["port"] = json!(emulator.standing().port);
        let arm = Puma::create(&config, recording.host()).unwrap();
        Self { arm, emulator, recording, world }
    }

    fn speaking(dialect: Dialect) -> Self {
        Self::of(EmulatorOptions { dialect, ..EmulatorOptions::default() }, Pace::Fast, &json!({}))
    }

    fn go(&mut self, degrees: [f64; 6]) -> Result<JointState, PluginError> {
        let target = JointVector::from_slice(&degrees.map(f64::to_radians)).unwrap();
        self.arm.move_joints(&Motion::absolute(target, 1.0))
    }

    fn assert_at(&mut self, degrees: [f64; 6]) {
        let told = self.arm.read_joints().unwrap().joints;
        for (place, (wanted, made)) in degrees.iter().zip(self.world.joints()).enumerate() {
            assert!((wanted - made).abs() < 0.012, "joint {}: {wanted} {made}", place + 1);
            let told = told.get(place).unwrap().to_degrees();
            assert!((told - made).abs() < 0.012, "joint {}: told {told}, made {made}", place + 1);
        }
    }
}

#[test]
fn it_does_what_every_robot_must() {
    let cells = RefCell::new(Vec::new());
    let report = conformance::check_robot(include_str!("../plugin.yaml"), |host| {
        let world = World::start(Pace::Real);
        let options = EmulatorOptions { world: world.socket.clone(), ..EmulatorOptions::default() };
        let emulator = Emulator::start(options).unwrap();
        let config = json!({"port": emulator.standing().port});
        cells.borrow_mut().push((world, emulator));
        Puma::create(&config, host)
    });
    assert!(report.is_good(), "{report}");
}

#[test]
fn every_dialect_takes_agins_poses_and_tells_them() {
    for (name, dialect) in Dialect::ALL {
        let mut cell = Cell::speaking(dialect);
        for pose in [
            LEFTY,
            [-51.656, -180.0, 0.0, -51.656, 0.0, 45.0],
            FLIPPED,
            READY,
            [10.0, -225.0, 225.0, 5.0, -6.0, 200.0],
        ] {
            let arrived = cell.go(pose).unwrap_or_else(|error| panic!("{name}: {error}"));
            assert!(!arrived.is_moving());
            cell.assert_at(pose);
        }
    }
}

#[test]
fn a_joint_beyond_its_range_is_refused_before_anything_is_typed() {
    let mut cell = Cell::speaking(Dialect::Mark2);
    let error = cell.go([0.0, 60.0, 90.0, 0.0, 0.0, 0.0]).unwrap_err();
    assert_eq!(
        error,
        PluginError::OutOfRange("shoulder would go to 60.00 degrees; it goes from -225 to 45".to_owned())
    );
    cell.assert_at(READY);
}

#[test]
fn potcal_takes_where_the_arm_stands_for_the_ready_position() {
    for (_, dialect) in Dialect::ALL {
        let mut cell = Cell::speaking(dialect);
        cell.go([0.0, -91.2, 90.5, 0.3, -0.4, 1.0]).unwrap();
        let ready = JointVector::from_slice(&READY.map(f64::to_radians)).unwrap();
        cell.arm.set_zero(&ready).unwrap();
        cell.assert_at(READY);
        let elsewhere = JointVector::from_slice(&LEFTY.map(f64::to_radians)).unwrap();
        let error = cell.arm.set_zero(&elsewhere).unwrap_err();
        assert!(error.text().starts_with("POTCAL knows one pose only, the ready position"), "{error}");
        cell.go(LEFTY).unwrap();
        let error = cell.arm.set_zero(&ready).unwrap_err();
        assert!(error.text().contains("POTCAL would drive it against its stop"), "{error}");
    }
}

#[test]
fn power_panic_and_servo_errors_are_told_with_what_to_do_and_nothing_moves_until_it_is_activated() {
    for (_, dialect) in Dialect::ALL {
        for (event, words) in [
            (Event::Power(false), "press ARM POWER"),
            (Event::Panic, "the PANIC button was pressed"),
            (Event::Envelope(3), "arm power is off"),
        ] {
            let mut cell = Cell::speaking(dialect);
            cell.emulator.tell(event.clone());
            let error = cell.go(LEFTY).unwrap_err();
            assert!(matches!(error, PluginError::NotReady(_)), "{dialect:?} {event:?}: {error:?}");
            assert!(error.text().contains(words), "{dialect:?} {event:?}: {error}");
            cell.emulator.tell(Event::Power(true));
            let refused = cell.go(LEFTY).unwrap_err();
            assert!(refused.text().starts_with("the arm is not moved after this"), "{refused}");
            assert_eq!(cell.world.joints().map(f64::round), READY);
            cell.arm.activate().unwrap();
            cell.go(LEFTY).unwrap();
            cell.assert_at(LEFTY);
        }
    }
}

#[test]
fn a_controller_started_anew_is_noticed_and_calibrated_only_where_that_is_allowed() {
    for allowed in [false, true] {
        let mut cell = Cell::of(EmulatorOptions::default(), Pace::Fast, &json!({"calibrate": allowed}));
        cell.emulator.tell(Event::Reboot);
        cell.emulator.tell(Event::Power(true));
        let error = cell.go(LEFTY).unwrap_err();
        assert!(error.text().contains("was started anew"), "{error}");
        cell.arm.activate().unwrap();
        let moved = cell.go(LEFTY);
        assert_eq!(moved.is_ok(), allowed, "{moved:?}");
        if let Err(error) = moved {
            assert!(error.text().contains("give `calibrate: true` in the cell file"), "{error}");
        }
    }
}

#[test]
fn a_damaged_character_is_cancelled_and_nothing_moves() {
    for fault in [
        "drop to-arm 8",
        "double to-arm 9",
        "garble to-arm 10",
        "drop from-arm 3",
        "double from-arm 5",
        "garble from-arm 6",
        "late:900 to-arm 4",
    ] {
        let mut cell = Cell::speaking(Dialect::Mark2);
        cell.emulator.tell(format!("fault {fault}").parse().unwrap());
        match cell.go(LEFTY) {
            Ok(_) => cell.assert_at(LEFTY),
            Err(error) => {
                assert!(!error.text().is_empty(), "{fault}");
                cell.arm.activate().unwrap_or_else(|error| panic!("{fault}: {error}"));
                cell.assert_at(READY);
                cell.go(LEFTY).unwrap();
                cell.assert_at(LEFTY);
            }
        }
    }
}

#[test]
fn a_pulled_plug_is_said_and_a_new_driver_goes_on() {
    let mut cell = Cell::speaking(Dialect::Mark2);
    cell.emulator.tell(Event::Unplug);
    let error = cell.go(LEFTY).unwrap_err();
    assert!(matches!(error, PluginError::Disconnected(_)), "{error:?}");
    cell.assert_world_at(READY);
}

impl Cell {
    fn assert_world_at(&mut self, degrees: [f64; 6]) {
        for (wanted, made) in degrees.iter().zip(self.world.joints()) {
            assert!((wanted - made).abs() < 0.012);
        }
    }
}

#[test]
fn a_stop_reaches_the_wire_within_a_tenth_of_a_second_and_the_arm_brakes() {
    let mut late = 0;
    let mut rows = Vec::new();
    for round in 0..8 {
        let (_, dialect) = Dialect::ALL[round % 3];
        let speed = [1.0, 0.5, 0.2][round % 3];
        let options = EmulatorOptions { dialect, line: at_9600(), ..EmulatorOptions::default() };
        let mut cell = Cell::of(options, Pace::Real, &json!({"full_speed_percent": 100}));
        let target = JointVector::from_slice(&LEFTY.map(f64::to_radians)).unwrap();
        let stopper = cell.recording.clone();
        let mut watcher = connect(&cell.world.socket);
        let asked = std::thread::spawn(move || {
            // Well under way, so that there is something to brake.
            let before = loop {
                let waist = watcher.read(Verb::Read {}).unwrap().joints[0].to_degrees();
                if waist > 1.0 {
                    break waist;
                }
                std::thread::sleep(Duration::from_millis(2));
            };
            stopper.set_stop(true);
            (Instant::now(), before)
        });
        let error = cell.arm.move_joints(&Motion::absolute(target, speed)).unwrap_err();
        assert!(matches!(error, PluginError::Stopped(_)), "{error:?}");
        let (asked, before) = asked.join().unwrap();
        let heard = cell.emulator.standing().last_cancel.unwrap();
        late += u32::from(heard.saturating_duration_since(asked) > Duration::from_millis(100));
        rows.push((speed, cell.world.joints()[0] - before, heard.saturating_duration_since(asked)));
        assert!(!cell.world.client.read(Verb::Read {}).unwrap().moving);
    }
    println!("speed, waist from the wish to stop to rest (deg), control C heard after: {rows:?}");
    assert!(late <= 1, "{rows:?}");
}

/// A row of the table: how lines are typed, and time per pose against what the line itself needs.
fn time_for_poses(keeps_up: bool, typing: &str) -> (plumb_puma::Profile, f64) {
    let options = EmulatorOptions { line: at_9600(), keeps_up, ..EmulatorOptions::default() };
    let mut cell = Cell::of(options, Pace::Fast, &json!({"typing": typing}));
    cell.go([1.0, -89.0, 91.0, 1.0, 1.0, 1.0]).unwrap();
    cell.arm.take_time_profile();
    for turn in 0..4 {
        let by = f64::from(turn);
        cell.go([10.0 + by, -80.0 + by, 80.0, 12.5, 20.0 - by, 33.0 + by]).unwrap();
    }
    let profile = cell.arm.take_time_profile();
    let limit =
        if typing == "fast" { profile.sent.max(profile.received) } else { profile.sent + profile.received };
    (profile, f64::from(limit) * 10.0 / 9600.0)
}

#[test]
fn the_time_of_a_pose_is_the_lines_own() {
    for (keeps_up, typing) in [(false, "careful"), (true, "careful"), (true, "fast"), (false, "fast")] {
        let (profile, limit) = time_for_poses(keeps_up, typing);
        let spent = (profile.total - profile.motion).as_secs_f64();
        println!(
            "{typing}, controller {}: {profile}; per pose {:.2} s without motion, the line's own {:.2} s, {:.2} times",
            if keeps_up { "keeps up" } else { "holds one character" },
            spent / 4.0,
            limit / 4.0,
            spent / limit
        );
    }
}

#[test]
fn conversations_over_a_bad_line_never_move_an_arm_that_has_told_an_error() {
    let seeds: u64 = std::env::var("CONVERSATIONS").ok().and_then(|count| count.parse().ok()).unwrap_or(60);
    let mut errors = 0;
    for seed in 1..=seeds {
        let (_, dialect) = Dialect::ALL[(seed % 3) as usize];
        let options = EmulatorOptions {
            dialect,
            line: LineOptions { seed, ..LineOptions::default() },
            ..EmulatorOptions::default()
        };
        let mut cell = Cell::of(options, Pace::Fast, &json!({"echo_within_ms": 60, "reply_within_ms": 300}));
        cell.emulator.tell(Event::DamageAtRandom([0.0005, 0.002, 0.01][(seed / 3 % 3) as usize]));
        for turn in 0..4 {
            let pose = [f64::from(turn) * 7.0 - 20.0, -80.0, 95.0, 3.0 * f64::from(turn), 10.0, -15.0];
            match cell.go(pose) {
                Ok(state) => {
                    let made = cell.world.joints();
                    for (place, made) in made.iter().enumerate() {
                        let told = state.joints.get(place).unwrap().to_degrees();
                        assert!((told - made).abs() < 0.06, "seed {seed}: told {told}, made {made}");
                        assert!(
                            (pose[place] - made).abs() < 0.06,
                            "seed {seed}: sent {}, made {made}",
                            pose[place]
                        );
                    }
                }
                Err(error) => {
                    errors += 1;
                    assert!(error.text().len() > 10, "seed {seed}");
                    let stands = cell.world.joints();
                    std::thread::sleep(Duration::from_millis(30));
                    let _ = cell.arm.read_joints();
                    assert_eq!(cell.world.joints(), stands, "seed {seed}: it moved after {error}");
                    cell.emulator.tell(Event::DamageAtRandom(0.0));
                    let recovered = cell.arm.activate().or_else(|_| cell.arm.activate());
                    recovered.unwrap_or_else(|error| panic!("seed {seed}: {error}"));
                }
            }
        }
    }
    println!("{seeds} conversations of 4 poses, {errors} errors, each recovered from");
}
