//! The driver at the end of a line that pauses or damages what goes over it.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    dead_code,
    reason = "a test that cannot go on fails; shared with the other tests of the driver"
)]

mod terminal;

use std::time::Duration;

use plumb_plugin::recording::RecordingHost;
use plumb_plugin::{PluginError, Robot};
use plumb_puma::Puma;
use plumb_simulated::emulate::val2::{Dialect, Emulator, EmulatorOptions, Event, LineOptions};
use plumb_simulated::protocol::Pace;
use serde_json::{Value, json};

use terminal::relay::Relay;
use terminal::{Cell, LEFTY, READY, World};

/// How the driver types, and how long it waits where a test is not about lateness: under the load of some compilers Linux has held back all bytes of
/// pseudo-terminals for seconds, for its worker that hands them on was not run. Nobody waits so long unless a byte is lost.
fn unhurried(typing: &str, echo_within_ms: u64) -> Value {
    json!({"typing": typing, "echo_within_ms": echo_within_ms, "reply_within_ms": 20_000})
}

/// How long an echo may take where one is lost or late, ms.
const ECHO_MS: u64 = 2000;
/// How late such an echo is then, so that the driver waits no longer.
const LATE: &str = "late:3500";

/// Runs a test for each of some cases, all at the same time: each waits most of its time.
fn for_each<T: Sync>(cases: &[T], test: impl Fn(&T) + Sync) {
    std::thread::scope(|scope| {
        for case in cases {
            scope.spawn(|| test(case));
        }
    });
}

/// An arm, its controller, and a cable that pauses behind some of the controller's words.
struct Paused {
    arm: Puma,
    emulator: Emulator,
    world: World,
    _relay: Relay,
}

impl Paused {
    fn behind(dialect: Dialect, words: &[&'static str], pause_ms: u64) -> Self {
        let world = World::start(Pace::Fast);
        let options = EmulatorOptions { world: world.socket.clone(), dialect, ..EmulatorOptions::default() };
        let emulator = Emulator::start(options).unwrap();
        let pauses: Vec<_> = words.iter().map(|word| (*word, Duration::from_millis(pause_ms))).collect();
        let relay = Relay::to(&emulator.status().port.unwrap(), &pauses);
        let mut config = unhurried("careful", 5000);
        config["port"] = json!(relay.path);
        let arm = Puma::create(&config, RecordingHost::new().host()).unwrap();
        Self { arm, emulator, world, _relay: relay }
    }

    fn go(&mut self, degrees: [f64; 6]) -> Result<(), PluginError> {
        let target = plumb_plugin::JointVector::from_slice(&degrees.map(f64::to_radians)).unwrap();
        self.arm.move_joints(&plumb_plugin::Motion::absolute(target, 1.0)).map(drop)
    }
}

#[test]
fn a_message_that_comes_in_pieces_is_read_to_its_end() {
    // As on a busy machine: the driver looks when half of the message is there.
    for pause_ms in [100, 300] {
        for (word, dialect) in [
            ("*Robot po", Dialect::Mark2),
            ("*ROBOT", Dialect::Mark1),
            ("*Arm po", Dialect::Late),
            ("*", Dialect::Mark2),
        ] {
            let mut cell = Paused::behind(dialect, &[word], pause_ms);
            cell.emulator.inject(Event::Power(false));
            std::thread::sleep(Duration::from_millis(40));
            let error = cell.go(LEFTY).unwrap_err();
            assert!(matches!(error, PluginError::NotReady(_)), "{word} {pause_ms}: {error:?}");
            assert!(error.text().contains("press ARM POWER"), "{word} {pause_ms}: {error}");
            assert_eq!(cell.world.joints().map(f64::round), READY);
        }
    }
}

#[test]
fn an_error_that_answers_a_command_in_pieces_is_that_error() {
    // A `*` alone is what a busy controller shows, too: it counts as that only when nothing follows it.
    for pause_ms in [100, 300] {
        for dialect in [Dialect::Mark2, Dialect::Mark1, Dialect::Late] {
            let mut cell = Paused::behind(dialect, &["*", "*Not c", "*NOT C"], pause_ms);
            cell.emulator.inject(Event::Reboot);
            cell.emulator.inject(Event::Power(true));
            let error = cell.go(LEFTY).unwrap_err();
            assert!(error.text().contains("was started anew"), "{dialect:?} {pause_ms}: {error}");
            cell.arm.activate().unwrap();
            let error = cell.go(LEFTY).unwrap_err();
            assert!(matches!(error, PluginError::NotReady(_)), "{dialect:?} {pause_ms}: {error:?}");
            assert!(error.text().contains("give `calibrate: true`"), "{dialect:?} {pause_ms}: {error}");
            assert_eq!(cell.world.joints().map(f64::round), READY);
        }
    }
}

#[test]
fn answers_that_come_in_pieces_are_whole_when_their_prompt_has_come() {
    // Behind points of numbers, signs, the heading, questions and the busy prompt.
    let words = ["JT3", "   -90.", "-90.0", "Change", "CHANGES", "* ", "0\r", "Are you", "ARE YOU SURE"];
    for (name, dialect) in Dialect::ALL {
        let mut cell = Paused::behind(dialect, &words, 120);
        cell.go(LEFTY).unwrap_or_else(|error| panic!("{name}: {error}"));
        let at = cell.world.joints();
        assert!(at.iter().zip(LEFTY).all(|(at, expected)| (at - expected).abs() < 0.012), "{name}: {at:?}");
        cell.go(READY).unwrap_or_else(|error| panic!("{name}: {error}"));
        let ready = plumb_plugin::JointVector::from_slice(&READY.map(f64::to_radians)).unwrap();
        cell.arm.set_zero(&ready).unwrap_or_else(|error| panic!("{name}: {error}"));
    }
}

/// A line on which one bit of one byte is turned (another for another seed), and the move to a pose that differs from the ready position.
fn move_with(way: &str, byte: u64, typing: &str) -> (Cell, Result<(), PluginError>) {
    let line = LineOptions { baud: Some(9600), seed: byte, ..LineOptions::default() };
    let options = EmulatorOptions { keeps_up: typing == "fast", line, ..EmulatorOptions::default() };
    let mut cell = Cell::of(options, Pace::Fast, &unhurried(typing, ECHO_MS));
    cell.emulator.inject(format!("fault garble {way} {byte}").parse().unwrap());
    let gone = cell.go(LEFTY).map(drop);
    (cell, gone)
}

#[test]
fn a_character_that_comes_back_as_another_cancels_the_line_in_careful_typing() {
    // The controller has heard what was typed; only the echo is wrong. Without the comparison nobody would notice.
    let mut compared = 0;
    for byte in 1..=8 {
        let (mut cell, gone) = move_with("from-arm", byte, "careful");
        match gone {
            Err(error) => {
                assert!(matches!(error, PluginError::Failed(_)), "{error:?}");
                compared += usize::from(error.text().contains("came back for"));
                cell.assert_world_at(READY);
            }
            // A turned bit can make a capital of a letter, as some controllers echo it.
            Ok(()) => cell.assert_at(LEFTY),
        }
    }
    assert!(compared >= 3, "of eight turned bits only {compared} were seen in the echo");
}

#[test]
fn a_line_whose_echo_comes_late_or_not_at_all_is_typed_once_more() {
    // A busy computer is late itself now and then; nothing has counted before the carriage return.
    for_each(
        &[(LATE, "to-arm"), (LATE, "from-arm"), ("drop", "to-arm"), ("drop", "from-arm")],
        |(kind, way)| {
            let config = unhurried("careful", ECHO_MS);
            let mut cell = Cell::of(EmulatorOptions::default(), Pace::Fast, &config);
            cell.emulator.inject(format!("fault {kind} {way} 3").parse().unwrap());
            cell.go(LEFTY).unwrap_or_else(|error| panic!("{kind} {way}: {error}"));
            cell.assert_at(LEFTY);
        },
    );
}

#[test]
fn an_answer_whose_echo_comes_late_or_not_at_all_is_typed_once_more_behind_its_question() {
    // The control C that cancels the answer cancels the question, too: typed at the prompt for a command, the answer was an unknown instruction.
    for_each(&[("careful", LATE), ("careful", "drop"), ("fast", "drop")], |(typing, kind)| {
        let options = EmulatorOptions { keeps_up: *typing == "fast", ..EmulatorOptions::default() };
        let mut cell = Cell::of(options, Pace::Fast, &unhurried(typing, ECHO_MS));
        // Behind `SPEED 50` and `HERE #PLMB`, and a carriage return each: the second character of the values.
        cell.emulator.inject(format!("fault {kind} to-arm 22").parse().unwrap());
        cell.go(LEFTY).unwrap_or_else(|error| panic!("{typing}, {kind}: {error}"));
        cell.assert_at(LEFTY);
    });
    let mut cell = Cell::of(EmulatorOptions::default(), Pace::Fast, &unhurried("careful", ECHO_MS));
    // Behind `WHERE` twice, and `EXECUTE POTCAL`: the Y.
    cell.emulator.inject("fault drop to-arm 28".parse().unwrap());
    let ready = plumb_plugin::JointVector::from_slice(&READY.map(f64::to_radians)).unwrap();
    cell.arm.set_zero(&ready).unwrap();
}

#[test]
fn a_line_whose_echo_is_lost_twice_is_an_error_and_moves_nothing() {
    let mut cell = Cell::of(EmulatorOptions::default(), Pace::Fast, &unhurried("careful", ECHO_MS));
    // The fourth byte that the controller gets is then the control C, the fifth to seventh the line again.
    for fault in ["drop to-arm 3", "drop to-arm 7"] {
        cell.emulator.inject(format!("fault {fault}").parse().unwrap());
    }
    let error = cell.go(LEFTY).unwrap_err();
    assert!(error.text().contains("was not echoed"), "{error}");
    let port = cell.emulator.status().port.unwrap().display().to_string();
    assert!(error.text().starts_with(&format!("{port}: in `")), "{error}");
    cell.assert_world_at(READY);
}

#[test]
fn a_damaged_line_typed_fast_is_cancelled_before_it_counts_and_typed_again_with_care() {
    // With the comparison off the controller would receive the damaged line, and report an error, or take another number. The first line has 8 characters;
    // nothing echoes whether its carriage return arrives.
    for_each(&["to-arm", "from-arm"], |way| {
        for byte in 1..=8 {
            let (mut cell, gone) = move_with(way, byte, "fast");
            gone.unwrap_or_else(|error| panic!("byte {byte} {way}: {error}"));
            cell.assert_at(LEFTY);
        }
    });
}
