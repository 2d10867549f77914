//! The driver on a bus of emulated servos: what it does, and whatever befalls the line and the servos.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on fails")]

use std::cell::RefCell;
use std::path::Path;
use std::time::{Duration, Instant};

use plumb_feetech::FeetechArm;
use plumb_plugin::recording::RecordingHost;
use plumb_plugin::{JointState, JointVector, Motion, PluginError, Robot, conformance};
use plumb_simulated::emulate::feetech::{Emulator, EmulatorOptions, Event, LineOptions, Status};
use serde_json::{Value, json};

/// Nothing waited for here takes nearly as long.
const PATIENCE: Duration = Duration::from_secs(30);

/// A step of a servo, degrees.
const STEP: f64 = 360.0 / 4096.0;

fn joints() -> Value {
    let names = ["shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll", "gripper"];
    let joint = |(index, name)| json!({"name": name, "servo": index + 1, "from_deg": -100, "to_deg": 100});
    names.iter().enumerate().map(joint).collect()
}

struct Bench {
    emulator: Emulator,
    recording: RecordingHost,
    arm: FeetechArm,
}

impl Bench {
    /// Servos that turn at once.
    fn new() -> Self {
        Self::of(EmulatorOptions::default(), &json!({}))
    }

    /// Servos that take their time.
    fn in_real_time() -> Self {
        Self::of(EmulatorOptions { line: at_1_megabaud(), ..EmulatorOptions::default() }, &json!({}))
    }

    fn of(options: EmulatorOptions, config: &Value) -> Self {
        let emulator = Emulator::start(EmulatorOptions { servos: 6, ..options }).unwrap();
        let recording = RecordingHost::new();
        let mut arm = connect(&emulator, &recording, config).unwrap();
        arm.activate().unwrap();
        Self { emulator, recording, arm }
    }

    fn go(&mut self, degrees: [f64; 6]) -> Result<JointState, PluginError> {
        self.arm.move_joints(&Motion::absolute(vector(degrees), 1.0))
    }

    fn reads(&mut self) -> Vec<f64> {
        self.arm.read_joints().unwrap().joints.as_slice().iter().map(|value| value.to_degrees()).collect()
    }

    fn assert_at(&mut self, degrees: [f64; 6]) {
        for (index, (expected, reads)) in degrees.iter().zip(self.reads()).enumerate() {
            assert!((expected - reads).abs() <= 1.5 * STEP, "servo {}: {expected} {reads}", index + 1);
        }
    }

    /// Where the encoders are now.
    fn encoders(&mut self) -> Vec<i32> {
        status_now(&mut self.emulator).encoders
    }

    /// Starts a long move, lets something happen once the first servo has turned by ten degrees, and gives how the move ended, and how long after that.
    fn move_while(
        &mut self,
        happens: impl FnOnce(&mut Emulator, &RecordingHost) + Send,
    ) -> (PluginError, Duration) {
        let (emulator, recording, arm) = (&mut self.emulator, &self.recording, &mut self.arm);
        std::thread::scope(|scope| {
            let befallen = scope.spawn(move || {
                await_status(emulator, |status| (status.encoders[0] - 2048).abs() > 114);
                let at = Instant::now();
                happens(emulator, recording);
                at
            });
            let motion = Motion::absolute(vector([60.0, -60.0, 60.0, 60.0, 60.0, 60.0]), 0.5);
            let error = arm.move_joints(&motion).unwrap_err();
            (error, befallen.join().unwrap().elapsed())
        })
    }
}

/// The status of the servos now.
fn status_now(emulator: &mut Emulator) -> Status {
    // Loses nothing; the emulator looks at the servos after every event.
    emulator.inject(Event::Lose(0));
    emulator.status()
}

/// Waits until the status of the servos is as it should be.
fn await_status(emulator: &mut Emulator, is_so: impl Fn(&Status) -> bool) {
    let deadline = Instant::now() + PATIENCE;
    while !is_so(&status_now(emulator)) {
        assert!(Instant::now() < deadline, "{:?}", emulator.status());
        std::thread::sleep(Duration::from_millis(2));
    }
}

fn connect(
    emulator: &Emulator,
    recording: &RecordingHost,
    config: &Value,
) -> Result<FeetechArm, PluginError> {
    let mut config = config.clone();
    config["port"] = json!(emulator.status().port);
    if config.get("joints").is_none() {
        config["joints"] = joints();
    }
    if config.get("full_speed_deg_per_s").is_none() {
        config["full_speed_deg_per_s"] = json!(120);
    }
    FeetechArm::create(&config, recording.host())
}

fn at_1_megabaud() -> LineOptions {
    LineOptions { baud: Some(1_000_000), ..LineOptions::default() }
}

fn vector(degrees: [f64; 6]) -> JointVector {
    JointVector::from_slice(&degrees.map(f64::to_radians)).unwrap()
}

#[test]
fn it_does_what_every_robot_must() {
    let emulators = RefCell::new(Vec::new());
    let report = conformance::check_robot(include_str!("../plugin.yaml"), |host| {
        let options = EmulatorOptions { servos: 6, line: at_1_megabaud(), ..EmulatorOptions::default() };
        let emulator = Emulator::start(options).unwrap();
        let config = json!({"port": emulator.status().port, "joints": joints()});
        emulators.borrow_mut().push(emulator);
        FeetechArm::create(&config, host)
    });
    assert!(report.is_good(), "{report}");
}

#[test]
fn it_goes_where_it_is_sent_and_the_servos_arrive_together() {
    let mut bench = Bench::in_real_time();
    let pose = [30.0, -20.0, 45.0, 10.0, -60.0, 5.0];
    let state = bench.go(pose).unwrap();
    assert!(!state.is_moving());
    bench.assert_at(pose);
    let on_the_way = bench.recording.emitted::<JointState>("joints");
    let half_way = on_the_way.iter().find(|state| state.joints.get(4).unwrap().to_degrees() < -30.0).unwrap();
    let fraction = half_way.joints.get(0).unwrap().to_degrees() / 30.0;
    assert!(half_way.is_moving() && (0.4..0.65).contains(&fraction), "{half_way:?}");
}

#[test]
fn a_joint_beyond_its_range_is_refused_and_nothing_moves() {
    let mut bench = Bench::new();
    let error = bench.go([0.0, 0.0, 101.0, 0.0, 0.0, 0.0]).unwrap_err();
    assert_eq!(
        error,
        PluginError::OutOfRange("elbow_flex would go to 101.00 degrees; it goes from -100 to 100".to_owned())
    );
    let error = bench.go([0.0, 0.0, f64::NAN, 0.0, 0.0, 0.0]).unwrap_err();
    assert!(error.text().contains("the value for elbow_flex is NaN; give a number"), "{error}");
    bench.assert_at([0.0; 6]);
}

#[test]
fn a_stop_holds_every_servo_where_it_is() {
    let mut bench = Bench::in_real_time();
    let (error, after) = bench.move_while(|_, recording| recording.set_stop(true));
    assert!(
        matches!(&error, PluginError::Stopped(text) if text.starts_with("stopped; the arm holds at shoulder_pan ")),
        "{error:?}"
    );
    assert!(after < Duration::from_millis(400), "{after:?}");
    let stopped = bench.reads();
    assert!(stopped[0] > 5.0 && stopped[0] < 55.0, "{stopped:?}");
    let encoders = bench.encoders();
    for (encoder, stopped) in encoders.iter().zip(&stopped) {
        assert!((f64::from(encoder - 2048) * STEP - stopped).abs() < 0.2, "{encoder} {stopped}");
    }
    assert_eq!(bench.emulator.status().holds, [true; 6]);
    bench.recording.set_stop(false);
    bench.go([0.0; 6]).unwrap();
}

#[test]
fn lost_cut_and_damaged_answers_are_asked_for_again() {
    let mut bench = Bench::new();
    for (event, pose) in [
        (Event::Lose(1), 10.0),
        (Event::Cut(2), -10.0),
        (Event::Lose(3), 20.0),
        (Event::DamageAtRandom(0.002), -20.0),
    ] {
        bench.emulator.inject(event.clone());
        for degrees in [pose, pose / 2.0, pose] {
            // With two bytes in a thousand damaged a question may stay without an answer three times: then it says so.
            match bench.go([degrees; 6]) {
                Ok(_) => bench.assert_at([degrees; 6]),
                Err(error) => {
                    assert!(
                        error.text().contains("answer") || error.text().contains("did not take the goal"),
                        "{event:?}: {error}"
                    );
                    bench.emulator.inject(Event::DamageAtRandom(0.0));
                    bench.arm.activate().unwrap();
                }
            }
        }
    }
}

#[test]
fn an_adapter_that_brings_back_what_is_sent_is_no_servo_that_answers() {
    let mut bench = Bench::of(EmulatorOptions { echo: true, ..EmulatorOptions::default() }, &json!({}));
    bench.go([25.0; 6]).unwrap();
    bench.assert_at([25.0; 6]);
    // A question for two bytes brought back has the length of its answer.
    bench.arm.set_zero(&vector([30.0; 6])).unwrap();
    bench.assert_at([30.0; 6]);
    let offsets = bench.emulator.status().offsets;
    assert!(offsets.iter().all(|offset| (offset + 57).abs() <= 1), "5 degrees are 57 steps: {offsets:?}");
    bench.emulator.inject(Event::Answers(1, false));
    let error = bench.arm.read_joints().unwrap_err();
    assert!(error.text().starts_with("shoulder_pan (servo 1) does not answer"), "{error}");
}

#[test]
fn a_servo_that_does_not_answer_is_named_and_the_others_hold() {
    let mut bench = Bench::in_real_time();
    let (error, _) = bench.move_while(|emulator, _| emulator.inject(Event::Answers(4, false)));
    assert!(matches!(error, PluginError::Disconnected(_)), "{error:?}");
    assert!(error.text().starts_with("wrist_flex (servo 4) does not answer"), "{error}");
    // The one that does not hear goes on to its goal; when nothing moves any more, the others are short of theirs.
    await_status(&mut bench.emulator, |status| !status.moving);
    let encoders = bench.encoders();
    for (servo, encoder) in [1, 2, 3, 5, 6].map(|servo| (servo, encoders[servo - 1])) {
        assert!((encoder - 2048).abs() < 600, "servo {servo} is short of its goal: {encoder}");
    }
    assert!(bench.arm.read_joints().is_err(), "no reading in place of one that is missing");
    bench.emulator.inject(Event::Answers(4, true));
    let refused = bench.go([0.0; 6]).unwrap_err();
    assert!(refused.text().starts_with("the arm is not moved after this (wrist_flex (servo 4)"), "{refused}");
    bench.arm.activate().unwrap();
    bench.go([0.0; 6]).unwrap();
}

#[test]
fn servos_that_let_go_are_reported_with_what_to_do() {
    for (event, words) in [
        (Event::Overload(3), "elbow_flex (servo 3): it was overloaded and has let go: free the joint"),
        (Event::Celsius(3, 75), "elbow_flex (servo 3): it is too hot and has let go"),
        (Event::Volts(3.0), "shoulder_pan (servo 1): its supply voltage is out of range"),
    ] {
        let mut bench = Bench::in_real_time();
        let (error, after) = bench.move_while(|emulator, _| emulator.inject(event.clone()));
        assert!(
            matches!(&error, PluginError::NotReady(text) if text.starts_with(words)),
            "{event:?}: {error:?}"
        );
        assert!(after < Duration::from_millis(500), "{after:?}");
        if event == Event::Celsius(3, 75) {
            let hot = bench.arm.activate().unwrap_err();
            assert!(hot.text().contains("75 degrees Celsius"), "{hot}");
            bench.emulator.inject(Event::Celsius(3, 35));
        }
        bench.emulator.inject(Event::Volts(7.4));
        bench.arm.activate().unwrap();
        bench.go([0.0; 6]).unwrap();
    }
}

#[test]
fn a_bus_without_power_or_without_an_adapter_says_so() {
    let mut bench = Bench::in_real_time();
    let (error, _) = bench.move_while(|emulator, _| emulator.inject(Event::Power(false)));
    assert!(error.text().starts_with("none of the 6 servos answers on /dev/"), "{error}");
    assert!(error.text().contains("is the arm's power supply on"), "{error}");
    bench.emulator.inject(Event::Power(true));
    assert_eq!(bench.emulator.status().holds, [false; 6], "servos that were switched off and on let go");
    bench.arm.activate().unwrap();
    bench.go([5.0; 6]).unwrap();
    let (error, _) = bench.move_while(|emulator, _| emulator.inject(Event::Unplug));
    assert!(
        matches!(error, PluginError::Disconnected(_)) && error.text().contains("the port is gone"),
        "{error:?}"
    );
}

#[test]
fn load_is_made_up_for_until_it_is_too_much() {
    let mut bench = Bench::new();
    bench.emulator.inject(Event::Sag(2, 14));
    bench.go([0.0, 40.0, 0.0, 0.0, 0.0, 0.0]).unwrap();
    bench.assert_at([0.0, 40.0, 0.0, 0.0, 0.0, 0.0]);
    bench.emulator.inject(Event::Sag(2, 90));
    let error = bench.go([0.0, 20.0, 0.0, 0.0, 0.0, 0.0]).unwrap_err();
    assert!(error.text().starts_with("shoulder_lift was sent to 20.04 and is at"), "{error}");
    assert!(error.text().contains("does it touch something, or carry too much?"), "{error}");
}

#[test]
fn the_motors_report_temperature_load_and_voltage_to_a_step_of_their_registers() {
    let mut bench = Bench::new();
    bench.emulator.inject(Event::Celsius(3, 52));
    bench.emulator.inject(Event::Volts(7.1));
    bench.emulator.inject(Event::Sag(2, 14));
    let before_ns = bench.recording.host().now_ns();
    let motors = bench.arm.read_motors().unwrap();
    assert!(motors.time_ns >= before_ns);
    assert_eq!(motors.temperature.as_slice(), [31.0, 31.0, 52.0, 31.0, 31.0, 31.0]);
    assert_eq!(motors.voltage.as_slice(), [7.1; 6]);
    // The emulator's servos hold with 60 per mille, and one per mille more for each step of sag.
    assert_eq!(motors.load.as_slice(), [0.06, 0.074, 0.06, 0.06, 0.06, 0.06]);
    // A step of 1 degree, of 0.1 V, of 1 per mille: uniform within it.
    let uncertainties = [motors.temperature_uncertainty, motors.voltage_uncertainty, motors.load_uncertainty];
    for (uncertainty, step) in uncertainties.iter().zip([1.0, 0.1, 0.001]) {
        assert!((uncertainty - step / 12.0_f64.sqrt()).abs() < 1e-9 * step, "{uncertainties:?}");
    }
    bench.emulator.inject(Event::Answers(4, false));
    let error = bench.arm.read_motors().unwrap_err();
    assert!(error.text().starts_with("wrist_flex (servo 4) does not answer"), "{error}");
}

#[test]
fn torque_comes_on_without_a_leap() {
    let mut bench = Bench::new();
    bench.go([30.0; 6]).unwrap();
    // The servos keep the goal of 30 degrees; a hand turns them, which is to say that their offsets move.
    bench.emulator.inject(Event::Power(false));
    bench.emulator.inject(Event::Power(true));
    bench.arm.activate().unwrap();
    bench.assert_at([30.0; 6]);
    assert_eq!(bench.emulator.status().holds, [true; 6]);
}

/// The angles by which a joint's servo counts, and those of the joint: its zero 14 degrees off, its direction the other one.
fn calibrate(bench: &mut Bench) {
    let truth = |reads: f64| -(reads - 14.0);
    for by in [0.0, 20.0] {
        let stopped = bench.reads()[2];
        bench
            .arm
            .move_joints(&Motion::absolute(vector([0.0, 0.0, stopped + by, 0.0, 0.0, 0.0]), 1.0).only(4))
            .unwrap();
        // What the encoder shows, whatever the driver makes of it.
        let encoder = f64::from(bench.encoders()[2] - 2048) * STEP;
        let mut declared = bench.reads();
        declared[2] = truth(encoder);
        let declared: [f64; 6] = declared.try_into().unwrap();
        bench.arm.set_zero(&vector(declared)).unwrap();
        assert!((bench.reads()[2] - declared[2]).abs() <= STEP, "{:?} {declared:?}", bench.reads());
    }
}

#[test]
fn two_declared_poses_set_a_zero_and_a_direction_and_both_are_kept() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("arm.json");
    let config = json!({"calibration": file});
    let mut bench = Bench::of(EmulatorOptions::default(), &config);
    calibrate(&mut bench);
    bench.go([0.0, 0.0, 10.0, 0.0, 0.0, 0.0]).unwrap();
    let encoder = f64::from(bench.encoders()[2] - 2048) * STEP;
    assert!((encoder - 4.0).abs() < 0.2, "10 degrees of the joint are {encoder} of its servo");
    let kept: Value = serde_json::from_str(&std::fs::read_to_string(&file).unwrap()).unwrap();
    assert_eq!(
        (&kept["elbow_flex"]["drive_mode"], &kept["elbow_flex"]["id"]),
        (&json!(1), &json!(3)),
        "{kept}"
    );
    assert_eq!(kept["wrist_flex"]["drive_mode"], json!(0), "{kept}");
    // The power goes and comes back, the driver is started anew: nothing is lost.
    bench.emulator.inject(Event::Power(false));
    bench.emulator.inject(Event::Power(true));
    let Bench { emulator, arm, .. } = bench;
    drop(arm);
    let recording = RecordingHost::new();
    let arm = connect(&emulator, &recording, &config).unwrap();
    let mut again = Bench { emulator, recording, arm };
    again.assert_at([0.0, 0.0, 10.0, 0.0, 0.0, 0.0]);
    let Bench { emulator, arm, .. } = again;
    drop(arm);
    assert_other_calibrations_are_refused(&emulator, &file, &config);
}

fn assert_other_calibrations_are_refused(emulator: &Emulator, file: &Path, config: &Value) {
    let text = std::fs::read_to_string(file).unwrap();
    let mut kept: Value = serde_json::from_str(&text).unwrap();
    kept["elbow_flex"]["homing_offset"] = json!(7);
    for (text, words) in [
        (kept.to_string(), "another program has calibrated it since"),
        (
            text.replace("\"id\": 3", "\"id\": 9"),
            "elbow_flex has servo 3 in the cell file and 9 in the calibration file",
        ),
        ("[]".to_owned(), "is not laid out as one"),
    ] {
        std::fs::write(file, text).unwrap();
        let error = connect(emulator, &RecordingHost::new(), config).unwrap_err();
        assert!(matches!(error, PluginError::Refused(_)) && error.text().contains(words), "{error:?}");
    }
}

#[test]
fn a_pose_that_fits_neither_direction_changes_nothing() {
    let mut bench = Bench::new();
    bench.arm.set_zero(&vector([0.0, 0.0, 5.0, 0.0, 0.0, 0.0])).unwrap();
    bench.go([0.0, 0.0, 25.0, 0.0, 0.0, 0.0]).unwrap();
    let error = bench.arm.set_zero(&vector([0.0, 0.0, 50.0, 0.0, 0.0, 0.0])).unwrap_err();
    assert!(error.text().contains("neither direction fits. Nothing was changed"), "{error}");
    bench.assert_at([0.0, 0.0, 25.0, 0.0, 0.0, 0.0]);
}

#[test]
fn a_port_that_cannot_be_used_is_reported_with_what_to_check() {
    let config = json!({"port": "/dev/ttyACM-none", "joints": joints()});
    let error = FeetechArm::create(&config, RecordingHost::new().host()).unwrap_err();
    assert!(error.text().starts_with("/dev/ttyACM-none: there is no such port"), "{error}");
}
