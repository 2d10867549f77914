//! What the driver does when all is well, and when it is stopped.

use std::cell::RefCell;
use std::time::{Duration, Instant};

use plumb_plugin::{JointState, PluginError, Robot, conformance};
use plumb_simulated::emulate::universal_robots::{Emulator, EmulatorOptions, Series};
use plumb_simulated::protocol::Pace;
use plumb_universal_robots::UniversalRobot;
use serde_json::json;

use crate::cell::{Cell, UPRIGHT, World, configured};

const BENT: [f64; 6] = [30.0, -120.0, 80.0, -60.0, 45.0, -100.0];

#[test]
fn it_does_what_every_robot_must() {
    let cells = RefCell::new(Vec::new());
    let report = conformance::check_robot(include_str!("../../plugin.yaml"), |host| {
        let world = World::start(Pace::Real);
        let options = EmulatorOptions { world: world.socket.clone(), ..EmulatorOptions::default() };
        let emulator = Emulator::start(&options).unwrap();
        let config = configured(&emulator, &json!({}));
        cells.borrow_mut().push((world, emulator));
        UniversalRobot::create(&config, host)
    });
    assert!(report.is_good(), "{report}");
}

#[test]
fn both_generations_go_where_they_are_sent_in_no_time_and_in_their_own() {
    for (series, pace) in [(Series::E, Pace::Real), (Series::Cb3, Pace::Fast), (Series::E, Pace::Fast)] {
        let options = EmulatorOptions { series, ..EmulatorOptions::default() };
        let mut cell = Cell::of(options, pace, &json!({"full_speed_deg_per_s": 180})).unwrap();
        cell.arm.activate().unwrap();
        for pose in [BENT, UPRIGHT, BENT, BENT] {
            let state = cell.go(pose).unwrap();
            assert!(!state.is_moving());
            for ((reported, expected), is) in
                state.joints.as_slice().iter().zip(pose).zip(cell.world.joints().0)
            {
                assert!(
                    (reported.to_degrees() - expected).abs() < 0.006,
                    "{} for {expected}",
                    reported.to_degrees()
                );
                assert!((is - expected).abs() < 0.001, "{is} for {expected}");
            }
            assert_eq!(cell.arm.read_joints().unwrap().joints, state.joints);
        }
    }
}

#[test]
fn it_reports_where_it_is_on_the_way_and_never_faster_than_it_may() {
    let mut cell = Cell::start();
    cell.arm.activate().unwrap();
    cell.go(BENT).unwrap();
    let reported = cell.recording.emitted::<JointState>("joints");
    assert!(reported.len() > 50, "{} states in two seconds", reported.len());
    for pair in reported.windows(2) {
        let [before, after] = pair else { continue };
        assert!(after.time_ns >= before.time_ns);
        let seconds = (after.time_ns - before.time_ns) as f64 * 1e-9;
        let turned = (after.joints.as_slice()[5] - before.joints.as_slice()[5]).abs().to_degrees();
        // A state that comes late by some cycles shows a longer way.
        assert!(turned < 60.0 * (seconds + 0.05), "{turned} deg in {seconds} s");
    }
}

#[test]
fn a_stop_takes_hold_at_once_and_nothing_moves_before_it_is_activated() {
    let mut cell = Cell::start();
    cell.arm.activate().unwrap();
    let recording = cell.recording.clone();
    let mut asked = None;
    let end = cell.go_until(|_| {
        recording.set_stop(true);
        asked = Some(Instant::now());
    });
    let took = asked.map(|asked| asked.elapsed());
    assert!(matches!(end, Err(PluginError::Stopped(_))), "{end:?}");
    // Besides what the driver states, what a busy machine adds.
    let limit = Duration::from_millis(300 + u64::from(cell.arm.describe().capabilities.stop_time_ms));
    assert!(took.is_some_and(|took| took < limit), "{took:?}, {limit:?} declared");
    cell.assert_rests_within(Duration::ZERO);
    let refused = cell.go(UPRIGHT).unwrap_err();
    assert!(matches!(refused, PluginError::Stopped(_)), "{refused:?}");
    cell.recording.set_stop(false);
    cell.arm.activate().unwrap();
    cell.go(UPRIGHT).unwrap();
}

#[test]
fn a_driver_that_dies_leaves_an_arm_that_stops_by_itself() {
    let mut cell = Cell::start();
    cell.arm.activate().unwrap();
    // The driver's process hangs: it neither gives a sign of life nor stops the arm.
    let text = plumb_universal_robots::program::move_joints(
        9,
        &[2.0, -1.5, 0.0, -1.5, 0.0, 0.0],
        0.5,
        1.4,
        24,
        Duration::from_millis(250),
    );
    let address = cell.emulator.status().address.unwrap();
    let mut script = std::net::TcpStream::connect((address, 30_002)).unwrap();
    std::io::Write::write_all(&mut script, text.as_bytes()).unwrap();
    let begin = Instant::now();
    while !cell.emulator.status().moving && begin.elapsed() < Duration::from_secs(5) {
        std::thread::sleep(Duration::from_millis(2));
    }
    assert!(cell.emulator.status().moving, "the arm has begun to move");
    cell.assert_rests_within(Duration::from_secs(2));
    assert!(cell.world.joints().0[0] < 60.0, "it stopped long before its end");
}
