//! What goes wrong becomes an error that says what to do, never a reading; and the arm is at rest.

use std::time::Duration;

use plumb_plugin::{PluginError, Robot};
use plumb_simulated::emulate::universal_robots::{Emulator, EmulatorOptions, Event};
use plumb_simulated::protocol::Pace;
use serde_json::json;

use crate::cell::{Cell, UPRIGHT};

fn failed_to_start(options: EmulatorOptions) -> PluginError {
    match Cell::of(options, Pace::Real, &json!({})) {
        Ok(_) => panic!("a driver came of it"),
        Err(error) => error,
    }
}

/// In mid-move, and what the move then says.
fn in_mid_move(happen: impl FnOnce(&mut Emulator) + Send, words: &str) -> (Cell, PluginError) {
    let mut cell = Cell::start();
    cell.arm.activate().unwrap();
    let error = cell.go_until(happen).unwrap_err();
    assert!(error.text().contains(words), "{error:?}");
    let refused = cell.go(UPRIGHT).unwrap_err();
    let same = refused.text().contains("the arm is not moved after this");
    assert!(same && refused.text().contains(words), "{refused:?}");
    (cell, error)
}

#[test]
fn a_controller_that_speaks_an_older_protocol_is_refused_with_what_to_do() {
    let error = failed_to_start(EmulatorOptions { protocol: 1, ..EmulatorOptions::default() });
    let words = "does not speak version 2 of the protocol: update its software to 3.4 or later";
    assert!(error.text().contains(words), "{error:?}");
}

#[test]
fn an_address_at_which_nothing_listens_is_reported_with_what_to_check() {
    let mut cell = Cell::start();
    cell.emulator.inject(Event::Gone);
    let error = cell.arm.read_joints().unwrap_err();
    assert!(matches!(error, PluginError::Disconnected(_)), "{error:?}");
    assert!(error.text().contains("the controller has ended the RTDE connection"), "{error}");
    let error = cell.arm.activate().unwrap_err();
    assert!(error.text().contains("nothing listens there: is it the controller"), "{error}");
}

#[test]
fn a_protective_stop_in_mid_move_is_reported_and_nothing_goes_on_once_it_is_unlocked() {
    let (mut cell, error) =
        in_mid_move(|emulator| emulator.inject(Event::ProtectiveStop), "the arm is in a protective stop");
    assert!(matches!(error, PluginError::NotReady(_)), "{error:?}");
    let unread = cell.arm.read_joints().unwrap_err();
    assert!(unread.text().contains("unlock it at the pendant"), "{unread}");
    cell.emulator.inject(Event::UnlockProtectiveStop);
    cell.assert_rests_within(Duration::from_millis(500));
    cell.arm.activate().unwrap();
    cell.go(UPRIGHT).unwrap();
}

#[test]
fn an_emergency_stop_in_mid_move_leaves_an_arm_that_has_to_be_switched_on() {
    let (mut cell, _) = in_mid_move(
        |emulator| emulator.inject(Event::EmergencyStop),
        "the robot's emergency stop is pressed: release it",
    );
    cell.assert_rests_within(Duration::from_secs(1));
    cell.emulator.inject(Event::ReleaseEmergencyStop);
    let off = cell.arm.activate().unwrap_err();
    assert!(off.text().contains("the arm is switched off: switch it on at the pendant"), "{off}");
    assert_eq!(cell.arm.read_joints().unwrap_err(), off);
    cell.emulator.inject(Event::Power(true));
    cell.arm.activate().unwrap();
    cell.go(UPRIGHT).unwrap();
}

#[test]
fn a_program_that_is_stopped_at_the_pendant_is_no_arrival() {
    in_mid_move(|emulator| emulator.inject(Event::StopProgram), "the move was ended before the arm arrived");
}

#[test]
fn a_computer_too_busy_for_its_signs_of_life_is_named_as_why_the_move_ended() {
    let mut cell = Cell::start();
    cell.arm.activate().unwrap();
    let recording = cell.recording.clone();
    let error = cell.go_until(|_| recording.hold_up(Duration::from_millis(1500))).unwrap_err();
    for words in ["this computer gave no sign of life for ", "after 0.25 s (`watchdog_ms`)"] {
        assert!(error.text().contains(words), "{error}");
    }
    cell.assert_rests_within(Duration::from_secs(2));
}

#[test]
fn local_control_is_reported_when_it_is_activated_and_when_it_comes_in_between() {
    let mut cell = Cell::start();
    cell.arm.activate().unwrap();
    cell.emulator.inject(Event::Remote(false));
    for error in [cell.go([20.0, -90.0, 0.0, -90.0, 0.0, 0.0]).unwrap_err(), cell.arm.activate().unwrap_err()]
    {
        assert!(matches!(error, PluginError::NotReady(_)), "{error:?}");
        assert!(error.text().contains("local control and takes no programs: switch it to remote"), "{error}");
    }
    // What the joints read is true all the same.
    cell.arm.read_joints().unwrap();
    assert_eq!(cell.world.joints().0.map(f64::round), UPRIGHT);
}

#[test]
fn a_controller_that_is_gone_in_mid_move_is_reported_at_once_and_the_arm_stops_by_itself() {
    let (mut cell, error) =
        in_mid_move(|emulator| emulator.inject(Event::Gone), "the controller has ended the RTDE connection");
    assert!(matches!(error, PluginError::Disconnected(_)), "{error:?}");
    cell.assert_rests_within(Duration::from_secs(2));
}

#[test]
fn a_connection_that_was_lost_is_made_anew_when_it_is_activated() {
    let (mut cell, _) =
        in_mid_move(|emulator| emulator.inject(Event::Disconnect), "ended the RTDE connection");
    cell.assert_rests_within(Duration::from_secs(2));
    cell.arm.activate().unwrap();
    cell.go(UPRIGHT).unwrap();
}

#[test]
fn half_a_state_is_no_state() {
    let (cell, error) = in_mid_move(|emulator| emulator.inject(Event::Cut), "ended the RTDE connection");
    assert!(matches!(error, PluginError::Disconnected(_)), "{error:?}");
    drop(cell);
}

#[test]
fn states_that_stop_coming_repeat_or_come_late_end_a_move_and_are_no_reading() {
    for (event, healed, words) in [
        (Event::Silence(true), Event::Silence(false), "the controller has sent nothing for"),
        (
            Event::Freeze(true),
            Event::Freeze(false),
            "old when they come: they are late, or its clock has stopped",
        ),
        (Event::Late(Duration::from_millis(900)), Event::Late(Duration::ZERO), "the controller"),
    ] {
        let (mut cell, error) = in_mid_move(|emulator| emulator.inject(event.clone()), words);
        assert!(matches!(error, PluginError::TimedOut(_)), "{event:?}: {error:?}");
        cell.assert_rests_within(Duration::from_secs(2));
        let unread = cell.arm.read_joints().unwrap_err();
        assert!(matches!(unread, PluginError::TimedOut(_)), "{event:?}: {unread:?}");
        cell.emulator.inject(healed);
        std::thread::sleep(Duration::from_millis(1000));
        cell.arm.activate().unwrap();
        cell.arm.read_joints().unwrap();
    }
}

#[test]
fn a_position_beyond_the_arms_stops_ends_in_the_controllers_own_words() {
    let mut cell = Cell::start();
    cell.arm.activate().unwrap();
    let error = cell.go([0.0, 30.0, 0.0, -90.0, 0.0, 0.0]).unwrap_err();
    assert!(error.text().contains("protective stop"), "{error}");
    let message = cell.arm.read_joints().unwrap_err();
    assert!(message.text().contains("protective stop"), "{message}");
}

#[test]
fn registers_that_another_program_writes_are_reported_and_others_can_be_had() {
    let cell = Cell::start();
    let config = |register: u8| crate::cell::configured(&cell.emulator, &json!({"first_register": register}));
    let host = plumb_plugin::recording::RecordingHost::new();
    let second = plumb_universal_robots::UniversalRobot::create(&config(24), host.host()).unwrap_err();
    assert!(second.text().contains("another program writes `input_int_register_24`"), "{second}");
    plumb_universal_robots::UniversalRobot::create(&config(26), host.host()).unwrap();
}
