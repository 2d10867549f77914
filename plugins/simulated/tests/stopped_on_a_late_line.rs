//! Emulated controllers on a busy machine: an order to move comes to the world late, and what stops the arm comes to it at once.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod common;

use std::io::{BufRead, BufReader, Write};
use std::net::Shutdown;
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::time::Duration;

use common::{Served, until};
use plumb_simulated::emulate::teachmover::{Motors, MotorsInWorld};
use plumb_simulated::emulate::{dobot, val2};
use plumb_simulated::protocol::{Pace, WorldCommand};

/// How late an order to move is.
const LATE: Duration = Duration::from_millis(200);

/// A way to the world on which orders to move are late.
fn late_way_to(served: &Served) -> PathBuf {
    let way = served.directory().join("late");
    let (listener, socket) = (UnixListener::bind(&way).unwrap(), served.socket.clone());
    std::thread::spawn(move || {
        for caller in listener.incoming().map_while(Result::ok) {
            let world = UnixStream::connect(&socket).unwrap();
            let (answers, back) = (world.try_clone().unwrap(), caller.try_clone().unwrap());
            std::thread::spawn(move || pass_on(answers, back, Duration::ZERO));
            std::thread::spawn(move || pass_on(caller, world, LATE));
        }
    });
    way
}

fn pass_on(from: UnixStream, mut to: UnixStream, late: Duration) {
    for line in BufReader::new(from).lines().map_while(Result::ok) {
        if line.contains("\"move\"") || line.contains("\"step\"") {
            std::thread::sleep(late);
        }
        if writeln!(to, "{line}").is_err() {
            break;
        }
    }
    // The other end may have gone first.
    let _ = to.shutdown(Shutdown::Both);
}

/// How far the first joint has turned in the world, deg, once the arm is at rest.
fn turned(served: &Served) -> f64 {
    let mut client = served.connect();
    until("the arm's rest", || !client.read(WorldCommand::Read {}).unwrap().moving);
    client.read(WorldCommand::Read {}).unwrap().joints[0].to_degrees()
}

/// A frame of the Dobot's protocol.
fn frame(id: u8, control: u8, floats: &[f32], mode: Option<u8>) -> Vec<u8> {
    let mut payload = vec![id, control];
    payload.extend(mode);
    payload.extend(floats.iter().flat_map(|number| number.to_le_bytes()));
    let sum = payload.iter().fold(0_u8, |sum, byte| sum.wrapping_add(*byte));
    [&[0xaa, 0xaa, payload.len() as u8][..], &payload, &[sum.wrapping_neg()]].concat()
}

fn write(port: Option<PathBuf>, bytes: &[u8]) {
    std::fs::OpenOptions::new().write(true).open(port.unwrap()).unwrap().write_all(bytes).unwrap();
}

#[test]
fn a_dobot_that_runs_into_something_as_it_sets_out_stops() {
    let world = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../workcells/magician/world.yaml");
    let served = Served::start_file(&world, Pace::Real);
    let options =
        dobot::EmulatorOptions { world: Some(late_way_to(&served)), ..dobot::EmulatorOptions::default() };
    let mut emulator = dobot::Emulator::start(options).unwrap();
    // At a fifth of 100 deg/s the base takes four seconds to 80 degrees.
    let speed = frame(83, 1, &[20.0, 100.0], None);
    let motion = frame(84, 3, &[80.0, 45.0, 45.0, 0.0], Some(4));
    write(emulator.status().port, &[speed, frame(240, 1, &[], None), motion].concat());
    until("the move", || emulator.status().moving);
    emulator.inject(dobot::Event::Block);
    let at = turned(&served);
    assert!(at < 70.0, "it went on to {at} degrees");
    until("the end of the move", || emulator.status().index == 1);
}

#[test]
fn a_puma_whose_power_goes_as_it_sets_out_stops() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("world.yaml");
    std::fs::write(&file, "world: w\narm: {puma560: {resolution: encoder}}\n").unwrap();
    let served = Served::start_file(&file, Pace::Real);
    let options = val2::EmulatorOptions { world: late_way_to(&served), ..val2::EmulatorOptions::default() };
    let mut emulator = val2::Emulator::start(options).unwrap();
    // At a quarter of 82 deg/s the waist takes four seconds.
    write(emulator.status().port, b"DO DRIVE 1,80,25\r");
    until("the move", || emulator.status().moving);
    emulator.inject(val2::Event::Power(false));
    let at = turned(&served);
    assert!(at < 70.0, "it went on to {at} degrees");
}

#[test]
fn a_teachmover_that_is_stopped_as_it_sets_out_stops() {
    let served = Served::start("world-ideal.yaml", Pace::Real);
    let mut motors = MotorsInWorld::connect(&late_way_to(&served)).unwrap();
    motors.start([800, 0, 0, 0, 0, 0], 200.0, 0).unwrap();
    motors.halt(0).unwrap();
    let made = motors.position(0)[0];
    assert!(made < 700, "it went on for {made} half-steps");
}
