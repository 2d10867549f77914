//! The driver on the line of an emulated Dobot: what it does, and whatever befalls the line and the arm.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on fails")]

use std::cell::RefCell;
use std::time::{Duration, Instant};

use plumb_dobot::DobotArm;
use plumb_plugin::recording::RecordingHost;
use plumb_plugin::{JointState, JointVector, Motion, PluginError, Robot, conformance};
use plumb_simulated::emulate::dobot::{Emulator, EmulatorOptions, Event, LineOptions};
use serde_json::{Value, json};

/// How near to its target the driver leaves a joint, deg.
const SETTLES: f64 = 0.05;

struct Bench {
    emulator: Emulator,
    recording: RecordingHost,
    arm: DobotArm,
}

impl Bench {
    /// An arm that moves in no time.
    fn new() -> Self {
        Self::of(EmulatorOptions::default(), &json!({}))
    }

    /// An arm that takes its time.
    fn in_real_time() -> Self {
        Self::of(EmulatorOptions { line: at_full_rate(), ..EmulatorOptions::default() }, &json!({}))
    }

    fn of(options: EmulatorOptions, config: &Value) -> Self {
        let emulator = Emulator::start(options).unwrap();
        let recording = RecordingHost::new();
        let mut arm = connect(&emulator, &recording, config).unwrap();
        arm.activate().unwrap();
        Self { emulator, recording, arm }
    }

    fn go(&mut self, degrees: [f64; 4]) -> Result<JointState, PluginError> {
        self.arm.move_joints(&Motion::absolute(vector(degrees), 1.0))
    }

    fn reads(&mut self) -> Vec<f64> {
        self.arm.read_joints().unwrap().joints.as_slice().iter().map(|value| value.to_degrees()).collect()
    }

    fn assert_at(&mut self, degrees: [f64; 4]) {
        let reads = self.reads();
        assert!(
            degrees.iter().zip(&reads).all(|(expected, reads)| (expected - reads).abs() <= SETTLES),
            "{reads:?}"
        );
    }

    /// Starts a long move, lets something happen in its middle, and gives how the move ended, and how long after that.
    fn move_while(
        &mut self,
        happens: impl FnOnce(&mut Emulator, &RecordingHost) + Send,
    ) -> (PluginError, Duration) {
        let (emulator, recording, arm) = (&mut self.emulator, &self.recording, &mut self.arm);
        std::thread::scope(|scope| {
            let befallen = scope.spawn(move || {
                std::thread::sleep(Duration::from_millis(400));
                let at = Instant::now();
                happens(emulator, recording);
                at
            });
            let error =
                arm.move_joints(&Motion::absolute(vector([80.0, 60.0, 20.0, -40.0]), 0.5)).unwrap_err();
            (error, befallen.join().unwrap().elapsed())
        })
    }
}

fn connect(emulator: &Emulator, recording: &RecordingHost, config: &Value) -> Result<DobotArm, PluginError> {
    let mut config = config.clone();
    config["port"] = json!(emulator.status().port);
    DobotArm::create(&config, recording.host())
}

fn at_full_rate() -> LineOptions {
    LineOptions { baud: Some(115_200), ..LineOptions::default() }
}

fn vector(degrees: [f64; 4]) -> JointVector {
    JointVector::from_slice(&degrees.map(f64::to_radians)).unwrap()
}

#[test]
fn it_does_what_every_robot_must() {
    let emulators = RefCell::new(Vec::new());
    let report = conformance::check_robot(include_str!("../plugin.yaml"), |host| {
        let emulator =
            Emulator::start(EmulatorOptions { line: at_full_rate(), ..EmulatorOptions::default() }).unwrap();
        let config = json!({"port": emulator.status().port});
        emulators.borrow_mut().push(emulator);
        DobotArm::create(&config, host)
    });
    assert!(report.is_good(), "{report}");
}

#[test]
fn it_goes_where_it_is_sent_and_the_joints_arrive_together() {
    let mut bench = Bench::in_real_time();
    let pose = [60.0, 30.0, 60.0, -30.0];
    let state = bench.go(pose).unwrap();
    assert!(!state.is_moving());
    bench.assert_at(pose);
    let on_the_way = bench.recording.emitted::<JointState>("joints");
    let half_way = on_the_way.iter().find(|state| state.joints.get(0).unwrap().to_degrees() > 25.0).unwrap();
    let fraction = (45.0 - half_way.joints.get(1).unwrap().to_degrees()) / 15.0;
    assert!(half_way.is_moving() && (0.35..0.65).contains(&fraction), "{half_way:?}");
    bench.arm.move_joints(&Motion::relative(vector([-10.0, 0.0, 5.0, 0.0]), 0.5).only(0b101)).unwrap();
    bench.assert_at([50.0, 30.0, 65.0, -30.0]);
}

#[test]
fn what_the_arm_cannot_reach_is_refused_and_nothing_moves() {
    let mut bench = Bench::new();
    for (pose, words) in [
        ([0.0, 90.0, 45.0, 0.0], "rear_arm would go to 90.00 degrees; it goes from 0 to 85"),
        (
            [0.0, 80.0, 0.0, 0.0],
            "rear_arm at 80.00 and forearm at 0.00 degrees would be 170.00 degrees apart (90 + rear_arm - forearm); the parallelogram goes from 20 to 145",
        ),
    ] {
        assert_eq!(bench.go(pose).unwrap_err(), PluginError::OutOfRange(words.to_owned()));
    }
    let error = bench.go([f64::NAN, 45.0, 45.0, 0.0]).unwrap_err();
    assert!(error.text().contains("the value for base is NaN; give a number"), "{error}");
    bench.assert_at([0.0, 45.0, 45.0, 0.0]);
    bench.go([5.0, 45.0, 45.0, 0.0]).unwrap();
}

#[test]
fn a_stop_ends_the_move_and_empties_the_queue() {
    let mut bench = Bench::in_real_time();
    let (error, after) = bench.move_while(|_, recording| recording.set_stop(true));
    assert!(
        matches!(&error, PluginError::Stopped(text) if text.starts_with("stopped; the arm holds at base ")),
        "{error:?}"
    );
    assert!(after < Duration::from_millis(500), "{after:?}");
    let stopped = bench.reads();
    assert!(stopped[0] > 2.0 && stopped[0] < 70.0, "{stopped:?}");
    bench.recording.set_stop(false);
    let refused = bench.go([0.0, 45.0, 45.0, 0.0]).unwrap_err();
    assert!(matches!(refused, PluginError::NotReady(_)), "{refused:?}");
    // With the queue running again nothing of the old move is left in it.
    bench.arm.activate().unwrap();
    std::thread::sleep(Duration::from_millis(300));
    let later = bench.reads();
    assert!((later[0] - stopped[0]).abs() < 0.02, "{stopped:?} {later:?}");
    bench.go([0.0, 45.0, 45.0, 0.0]).unwrap();
}

#[test]
fn what_another_program_left_in_the_queue_does_not_begin() {
    let emulator =
        Emulator::start(EmulatorOptions { line: at_full_rate(), ..EmulatorOptions::default() }).unwrap();
    let port = emulator.status().port.unwrap();
    // A move to a base angle of 60 degrees waits in the queue, which is stopped.
    let mut parameters = vec![4_u8];
    parameters.extend([60.0_f32, 45.0, 45.0, 0.0].iter().flat_map(|angle| angle.to_le_bytes()));
    let command = plumb_dobot::frame::command(84, plumb_dobot::frame::Control::Queue, &parameters);
    std::fs::OpenOptions::new()
        .write(true)
        .open(&port)
        .and_then(|mut file| std::io::Write::write_all(&mut file, &command))
        .unwrap();
    std::thread::sleep(Duration::from_millis(100));
    let recording = RecordingHost::new();
    let arm = connect(&emulator, &recording, &json!({})).unwrap();
    let mut bench = Bench { emulator, recording, arm };
    bench.arm.activate().unwrap();
    std::thread::sleep(Duration::from_millis(300));
    bench.assert_at([0.0, 45.0, 45.0, 0.0]);
}

#[test]
fn lost_cut_and_corrupt_answers_are_asked_for_again() {
    let mut bench = Bench::new();
    for (event, base) in [
        (Event::Lose(1), 10.0),
        (Event::Cut(2), -10.0),
        (Event::Corrupt(2), 20.0),
        (Event::DamageAtRandom(0.002), -20.0),
    ] {
        bench.emulator.inject(event.clone());
        for degrees in [base, base / 2.0, base] {
            // With two bytes in a thousand damaged a command may stay without an answer three times: then it says so.
            match bench.go([degrees, 45.0, 45.0, 0.0]) {
                Ok(_) => bench.assert_at([degrees, 45.0, 45.0, 0.0]),
                Err(error) => {
                    assert!(
                        event == Event::DamageAtRandom(0.002) && error.text().contains("does not answer"),
                        "{event:?}: {error}"
                    );
                    bench.emulator.inject(Event::DamageAtRandom(0.0));
                    bench.arm.activate().unwrap();
                }
            }
        }
    }
    bench.emulator.inject(Event::DamageAtRandom(0.0));
    bench.arm.deactivate().unwrap();
    let log = format!("{:?}", bench.recording.lines());
    assert!(log.contains("without an answer and") && log.contains("check the cable"), "{log}");
}

#[test]
fn corrupt_answers_without_end_are_reported_as_damage() {
    let mut bench = Bench::new();
    bench.emulator.inject(Event::Corrupt(1000));
    let error = bench.arm.read_joints().unwrap_err();
    assert!(matches!(error, PluginError::Disconnected(_)), "{error:?}");
    assert!(
        error.text().contains("does not answer where it is (3 damaged answers came: check cable and plugs)"),
        "{error}"
    );
    bench.emulator.inject(Event::Corrupt(0));
    bench.emulator.inject(Event::Lose(1000));
    let error = bench.arm.read_joints().unwrap_err();
    assert!(
        error.text().ends_with("is its 12 V supply in and its power button lit, and is this its port?"),
        "{error}"
    );
    assert!(!error.text().contains("damaged"), "{error}");
}

#[test]
fn an_alarm_in_mid_move_stops_the_arm_and_says_what_to_do() {
    for (code, words, clears) in [
        (
            0x52,
            "alarm 0x52: a joint lost steps: the arm's position is not known any more (forearm); free the arm",
            false,
        ),
        (0x45, "alarm 0x45: a joint is at its end (forearm); move it back from there", true),
    ] {
        let mut bench = Bench::in_real_time();
        let (error, after) = bench.move_while(move |emulator, _| emulator.inject(Event::Alarm(code)));
        assert!(matches!(&error, PluginError::NotReady(text) if text.starts_with(words)), "{error:?}");
        assert!(after < Duration::from_millis(500), "{after:?}");
        let refused = bench.go([0.0; 4]).unwrap_err();
        assert!(refused.text().starts_with("the arm is not moved after this (alarm 0x"), "{refused}");
        match bench.arm.activate() {
            Ok(()) => assert!(clears),
            Err(error) => assert!(!clears && error.text().starts_with(words), "{error}"),
        }
    }
}

#[test]
fn a_move_that_ends_elsewhere_or_not_at_all_is_no_success() {
    let mut bench = Bench::in_real_time();
    let (error, _) = bench.move_while(|emulator, _| emulator.inject(Event::Block));
    assert!(error.text().starts_with("base was sent to 80.00 and is at "), "{error}");
    assert!(
        error
            .text()
            .ends_with("though the Dobot has ended its move without an alarm: does it touch something?"),
        "{error}"
    );
    bench.arm.activate().unwrap();
    bench.go([0.0, 45.0, 45.0, 0.0]).unwrap();
    let (error, after) = bench.move_while(|emulator, _| emulator.inject(Event::Hold));
    assert!(matches!(error, PluginError::TimedOut(_)), "{error:?}");
    assert!(error.text().starts_with("it is at rest, and its queue does not go on: base "), "{error}");
    assert!(after < Duration::from_secs(4), "{after:?}");
}

#[test]
fn a_dobot_without_power_or_cable_says_so_and_is_not_taken_for_one_that_was_homed() {
    let mut bench = Bench::in_real_time();
    let (error, _) = bench.move_while(|emulator, _| emulator.inject(Event::Power(false)));
    assert!(error.text().contains("is its 12 V supply in and its power button lit"), "{error}");
    bench.emulator.inject(Event::Power(true));
    bench.arm.activate().unwrap();
    let log = format!("{:?}", bench.recording.lines());
    assert!(log.contains("cleared: alarm 0x00: it has been switched on or reset; home it"), "{log}");
    bench.go([5.0, 45.0, 45.0, 0.0]).unwrap();
    let (error, after) = bench.move_while(|emulator, _| emulator.inject(Event::Unplug));
    assert!(
        matches!(error, PluginError::Disconnected(_)) && error.text().contains("the port is gone"),
        "{error:?}"
    );
    assert!(after < Duration::from_secs(1), "{after:?}");
}

#[test]
fn an_arm_without_its_servo_has_three_joints() {
    let emulator = Emulator::start(EmulatorOptions::default()).unwrap();
    let recording = RecordingHost::new();
    let mut arm = connect(&emulator, &recording, &json!({"hand": false})).unwrap();
    assert_eq!(arm.describe().joints.len(), 3);
    arm.activate().unwrap();
    let to = JointVector::from_slice(&[0.2, 0.5, 0.9]).unwrap();
    assert_eq!(arm.move_joints(&Motion::absolute(to, 1.0)).unwrap().joints.len(), 3);
}

#[test]
fn a_port_that_cannot_be_used_is_reported_with_what_to_check() {
    let config = json!({"port": "/dev/ttyUSB-none"});
    let error = DobotArm::create(&config, RecordingHost::new().host()).unwrap_err();
    assert!(error.text().starts_with("/dev/ttyUSB-none: there is no such port"), "{error}");
}
