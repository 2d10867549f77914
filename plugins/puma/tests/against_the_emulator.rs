//! The driver at the terminal of an emulated controller, over the arm of a world.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    dead_code,
    reason = "a test that cannot go on fails; shared with the figures of the manual"
)]

mod terminal;

use std::cell::RefCell;
use std::time::{Duration, Instant};

use plumb_plugin::recording::RecordingHost;
use plumb_plugin::{JointVector, PluginError, Robot, conformance};
use plumb_puma::Puma;
use plumb_serial_line::SerialLine;
use plumb_simulated::emulate::val2::{Dialect, Emulator, EmulatorOptions, Event};
use plumb_simulated::protocol::Pace;
use serde_json::json;

use terminal::{Cell, LEFTY, READY, World, conversations, poses, stops};

const FLIPPED: [f64; 6] = [90.0, 0.0, 180.0, 90.0, 0.0, -135.0];

#[test]
fn it_does_what_every_robot_must() {
    let cells = RefCell::new(Vec::new());
    let report = conformance::check_robot(include_str!("../plugin.yaml"), |host| {
        let world = World::start(Pace::Real);
        let options = EmulatorOptions { world: world.socket.clone(), ..EmulatorOptions::default() };
        let emulator = Emulator::start(options).unwrap();
        let config = json!({"port": emulator.status().port});
        cells.borrow_mut().push((world, emulator));
        Puma::create(&config, host)
    });
    assert!(report.is_good(), "{report}");
}

#[test]
fn a_port_that_cannot_be_used_is_reported_with_what_to_check() {
    let world = World::start(Pace::Fast);
    let options = EmulatorOptions { world: world.socket.clone(), ..EmulatorOptions::default() };
    let emulator = Emulator::start(options).unwrap();
    let taken = emulator.status().port.unwrap().display().to_string();
    let _holder = SerialLine::open(&taken, 9600).unwrap();
    for (port, expected) in [
        ("/dev/ttyUSB-none".to_owned(), "there is no such port; check that the adapter is plugged in"),
        (taken, "another program has it open; end that program"),
        ("/dev/null".to_owned(), "that is no serial port; check the name"),
    ] {
        let error = Puma::create(&json!({"port": port}), RecordingHost::new().host()).unwrap_err();
        assert!(error.text().contains(&port) && error.text().contains(expected), "{error:?}");
    }
}

#[test]
fn every_dialect_takes_agins_poses_and_reports_them() {
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
fn potcal_takes_where_the_arm_is_for_the_ready_position() {
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
fn power_panic_and_servo_errors_are_reported_with_what_to_do_and_nothing_moves_until_it_is_activated() {
    for (_, dialect) in Dialect::ALL {
        for (event, words) in [
            (Event::Power(false), "press ARM POWER"),
            (Event::Panic, "the PANIC button was pressed"),
            (Event::Envelope(3), "arm power is off"),
        ] {
            let mut cell = Cell::speaking(dialect);
            cell.emulator.inject(event.clone());
            let error = cell.go(LEFTY).unwrap_err();
            assert!(matches!(error, PluginError::NotReady(_)), "{dialect:?} {event:?}: {error:?}");
            assert!(error.text().contains(words), "{dialect:?} {event:?}: {error}");
            cell.emulator.inject(Event::Power(true));
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
        cell.emulator.inject(Event::Reboot);
        cell.emulator.inject(Event::Power(true));
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

/// Two things happen between two commands: that the controller was started anew is what the driver has to go by.
#[test]
fn a_controller_started_anew_after_an_error_is_said_to_be_started_anew() {
    let mut cell = Cell::speaking(Dialect::Mark2);
    cell.emulator.inject(Event::Power(false));
    cell.emulator.inject(Event::Reboot);
    // A pause of a busy machine between the two messages would make them two answers.
    let began = Instant::now();
    while cell.emulator.status().talking && began.elapsed() < Duration::from_secs(10) {
        std::thread::sleep(Duration::from_millis(1));
    }
    let error = cell.go(LEFTY).unwrap_err();
    assert!(error.text().contains("was started anew"), "{error}");
    assert_eq!(cell.world.joints().map(f64::round), READY);
}

#[test]
fn full_speed_is_the_share_of_the_joints_own_that_the_cell_gives() {
    let speed = |percent: f64| {
        let config = json!({"full_speed_percent": percent});
        Cell::of(EmulatorOptions::default(), Pace::Fast, &config).arm.describe().joints[0].max_speed
    };
    let (fifth, full) = (speed(20.0), speed(100.0));
    assert!((fifth / full - 0.2).abs() < 1e-12 && (0.1..10.0).contains(&full), "{fifth} of {full} rad/s");
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
        cell.emulator.inject(format!("fault {fault}").parse().unwrap());
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
    cell.emulator.inject(Event::Unplug);
    let error = cell.go(LEFTY).unwrap_err();
    assert!(matches!(error, PluginError::Disconnected(_)), "{error:?}");
    cell.assert_world_at(READY);
}

#[test]
fn an_arm_that_the_pendant_has_moved_meanwhile_goes_where_it_is_sent_all_the_same() {
    for (name, dialect) in Dialect::ALL {
        let mut cell = Cell::speaking(dialect);
        cell.go(LEFTY).unwrap();
        cell.world.pendant_turns(1, -3.0);
        // The shoulder was where it is to be, and is not any more.
        let target = [80.0, 0.0, 170.0, 90.0, 0.0, 45.0];
        cell.go(target).unwrap_or_else(|error| panic!("{name}: {error}"));
        cell.assert_at(target);
    }
}

#[test]
fn a_stop_reaches_the_wire_within_a_tenth_of_a_second_and_the_arm_brakes() {
    let stops = stops::made(8);
    let late = stops.iter().filter(|stop| stop.after.as_millis() > 100).count();
    assert!(late <= 1, "{stops:?}");
}

#[test]
fn a_pose_takes_little_more_than_the_line_itself() {
    for row in poses::timed(2) {
        // How much more, `cargo bench -p plumb-puma --bench terminal -- poses` measures on a quiet machine; this holds on any.
        assert!(row.commands_a_pose <= 5.0, "{row}");
        assert!(row.times() < 5.0, "{row}");
    }
}

#[test]
fn conversations_over_a_bad_line_never_move_an_arm_that_has_reported_an_error() {
    // `cargo bench -p plumb-puma --profile dev --bench terminal -- conversations 10000` for more.
    let held = conversations::hold(1..=60, 4, || ());
    assert_eq!(held.wrong, Vec::<String>::new());
    assert!(held.errors > 0, "the lines were bad enough");
    assert_eq!(held.conversations, 60);
}

#[test]
fn a_program_that_a_control_c_does_not_end_is_aborted_and_its_question_answered() {
    for (name, dialect) in Dialect::ALL {
        let mut cell = Cell::speaking(dialect);
        cell.emulator.inject(Event::Program);
        let refused = cell.go(LEFTY).unwrap_err();
        assert!(matches!(refused, PluginError::NotReady(_) | PluginError::Failed(_)), "{name}: {refused:?}");
        cell.arm.activate().unwrap_or_else(|error| panic!("{name}: {error}"));
        cell.go(LEFTY).unwrap_or_else(|error| panic!("{name}: {error}"));
        cell.assert_at(LEFTY);
    }
}

#[test]
fn an_answer_to_aborts_question_that_does_not_come_back_as_typed_moves_nothing() {
    let mut cell = Cell::speaking(Dialect::Mark2);
    cell.emulator.inject(Event::Program);
    // Control C, ABORT with its carriage return, and then the Y, on its way back.
    let before = "\r\n*ABORT\r\nAre you sure (Y/N)? ".len();
    let fault = format!("drop from-arm {}", before + 1).parse().unwrap();
    cell.emulator.inject(Event::Damage(fault));
    let error = cell.arm.activate().unwrap_err();
    assert!(error.text().contains("Y"), "{error}");
    assert!(cell.go(LEFTY).is_err());
    cell.arm.activate().unwrap();
    cell.go(LEFTY).unwrap();
}

/// Types a line as a person does, character by character, and gives what comes back up to the next prompt.
fn typed(line: &mut SerialLine, text: &str) -> String {
    let mut came = String::new();
    let mut read = |line: &mut SerialLine, within: Duration| {
        let bytes = line.read(within).unwrap();
        came.push_str(&String::from_utf8_lossy(&bytes));
        came.clone()
    };
    for byte in text.bytes().chain([b'\r']) {
        line.write(&[byte], Duration::from_secs(1)).unwrap();
        read(line, Duration::from_millis(200));
    }
    let deadline = Instant::now() + Duration::from_secs(20);
    loop {
        let came = read(line, Duration::from_millis(200));
        if came.trim_end().ends_with("\n.") || Instant::now() > deadline {
            return came;
        }
    }
}

#[test]
fn a_point_set_by_its_angles_is_gone_to_as_clients_of_later_controllers_do() {
    let mut world = World::start(Pace::Fast);
    let options = EmulatorOptions { world: world.socket.clone(), ..EmulatorOptions::default() };
    let emulator = Emulator::start(options).unwrap();
    let port = emulator.status().port.unwrap().display().to_string();
    // Activating the arm brings the controller to its prompt.
    let mut arm = Puma::create(&json!({"port": port}), RecordingHost::new().host()).unwrap();
    arm.activate().unwrap();
    arm.deactivate().unwrap();
    drop(arm);
    let mut line = SerialLine::open(&port, 9600).unwrap();
    let expected = [10.0, -80.0, 95.0, 5.0, -20.0, 30.0];
    let output = typed(&mut line, "DO SET #X=#PPOINT(10,-80,95,5,-20,30)");
    assert!(!output.contains('*'), "{output:?}");
    let output = typed(&mut line, "DO MOVE #X");
    assert!(!output.contains('*'), "{output:?}");
    for (expected, made) in expected.iter().zip(world.joints()) {
        assert!((expected - made).abs() < 0.012, "{expected} {made}");
    }
    let output = typed(&mut line, "DO MOVE #Y");
    assert!(output.contains('*'), "nobody has set it: {output:?}");
    let output = typed(&mut line, "DO SET #X=#PPOINT(10,-80");
    assert!(output.contains('*'), "{output:?}");
}
