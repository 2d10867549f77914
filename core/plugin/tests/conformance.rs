//! The conformance suite passes what is right and names what is wrong.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::Duration;

use plumb_plugin::conformance::{CheckOutcome, CheckReport, LISTS, check_robot, check_sensor};
use plumb_plugin::{
    DigitalInputs, Host, JointDescription, JointState, JointUnit, JointVector, LineDescription, Motion,
    PluginError, Quantity, QuantityDescription, Reading, Robot, RobotCapabilities, RobotDescription, Sensor,
    SensorDescription, Value,
};

const ROBOT_MANIFEST: &str = "
id: test-robot
title: A robot for the suite's own tests
version: 0.1.0
contract: [1, 0]
kind: robot
library: libtest_robot.so
streams:
  - {name: joints, message: joint-state/1}
  - {name: inputs, message: digital-inputs/1}
";

const SENSOR_MANIFEST: &str = "
id: test-sensor
title: A sensor for the suite's own tests
version: 0.1.0
contract: [1, 0]
kind: sensor
library: libtest_sensor.so
streams:
  - {name: edges, message: proximity-edge/1}
inputs:
  - {name: line, message: digital-inputs/1}
";

/// What is wrong with a robot.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Flaw {
    None,
    RangeUpsideDown,
    ReadsAsMoving,
    MovesUntilStopped,
    EndsBesideTheTarget,
    TakesRelativeForAbsolute,
    MovesEveryJoint,
    SaysNothingAtTheEnd,
    ClockRunsBack,
    DoesNotCloseTheMove,
    IgnoresTheStop,
    /// As on a machine that was busy just then.
    IsLateToStopOnce,
    IsLateToStop,
    ForgetsTheStop,
    ReturnsWhileItMoves,
    ReadsAsNotANumber,
    EndsAtNotANumber,
    TimesAreZero,
    TimesAreOfTheDay,
    TimesStandStill,
    InputsCannotBeRead,
    EmitsWhatIsNotDeclared,
    BlocksInARead,
    Panics,
    NeverEndsMoving,
}

struct TestRobot {
    host: Host,
    flaw: Flaw,
    joints: JointVector,
    reads: u64,
    /// Moves that ended because of a stop.
    stopped: u32,
    /// How often it was commanded to stop, in all robots of a report.
    stops: Arc<AtomicU32>,
}

/// Some day in 2026, counted in ns from 1970.
const TIME_OF_DAY_NS: u64 = 1_780_000_000_000_000_000;

impl TestRobot {
    fn new(host: Host, flaw: Flaw) -> Self {
        Self { host, flaw, joints: JointVector::zeros(3), reads: 0, stopped: 0, stops: Arc::default() }
    }

    fn now_ns(&self) -> u64 {
        match self.flaw {
            Flaw::TimesAreZero => 0,
            Flaw::TimesAreOfTheDay => TIME_OF_DAY_NS + self.host.now_ns(),
            Flaw::TimesStandStill => 77,
            _ => self.host.now_ns(),
        }
    }

    fn state(&self, moving: bool) -> JointState {
        JointState::new(self.now_ns(), self.joints, moving)
    }

    /// Takes longer than 300 ms and its 20 ms where it is late.
    fn come_to_rest(&mut self) {
        let is_late = match self.flaw {
            Flaw::IsLateToStop => true,
            Flaw::IsLateToStopOnce => self.stopped == 0,
            _ => false,
        };
        if is_late {
            std::thread::sleep(Duration::from_millis(400));
        }
        self.stopped += 1;
    }

    fn end_of(&self, motion: &Motion) -> JointVector {
        match self.flaw {
            Flaw::TakesRelativeForAbsolute => Motion { relative: 0, ..*motion }.end_from(&self.joints),
            Flaw::MovesEveryJoint => Motion { joint_mask: 0b111, ..*motion }.end_from(&self.joints),
            Flaw::EndsBesideTheTarget => {
                let mut end = motion.end_from(&self.joints);
                end.set(0, end.get(0).unwrap_or(0.0) + 0.002);
                end
            }
            _ => motion.end_from(&self.joints),
        }
    }
}

impl Robot for TestRobot {
    fn create(_config: &Value, host: Host) -> Result<Self, PluginError> {
        Ok(Self::new(host, Flaw::None))
    }

    fn describe(&self) -> RobotDescription {
        let upside_down = self.flaw == Flaw::RangeUpsideDown;
        let joint = |name: &str, unit| JointDescription {
            name: name.to_owned(),
            unit,
            lower: if upside_down { 2.0 } else { -2.0 },
            upper: if upside_down { -2.0 } else { 2.0 },
            resolution: 0.001,
            max_speed: 4.0,
            home: 0.0,
        };
        RobotDescription {
            model: "test".to_owned(),
            joints: vec![
                joint("waist", JointUnit::Radian),
                joint("shoulder", JointUnit::Radian),
                joint("gripper", JointUnit::Millimetre),
            ],
            inputs: vec![LineDescription { name: "line".to_owned(), bit: 0 }],
            outputs: Vec::new(),
            capabilities: RobotCapabilities {
                interruptible: true,
                stop_time_ms: 20,
                ..RobotCapabilities::default()
            },
        }
    }

    fn read_joints(&mut self) -> Result<JointState, PluginError> {
        self.reads += 1;
        let was_left_moving = self.flaw == Flaw::MovesUntilStopped && self.stops.load(Ordering::Relaxed) == 0;
        let mut state = self.state(self.flaw == Flaw::ReadsAsMoving || was_left_moving);
        match self.flaw {
            Flaw::ReadsAsNotANumber => state.joints.set(1, f64::NAN),
            // Long enough to be seen, in one read of one check.
            Flaw::BlocksInARead if self.reads == 1 => std::thread::sleep(Duration::from_millis(5_200)),
            Flaw::Panics => panic!("index out of bounds: the robot lost its head"),
            _ => {}
        }
        if self.flaw == Flaw::ClockRunsBack {
            state.time_ns = u64::MAX - self.reads;
        }
        Ok(state)
    }

    fn move_joints(&mut self, motion: &Motion) -> Result<JointState, PluginError> {
        let (from, end) = (self.joints, self.end_of(motion));
        let way = |joint: usize| end.get(joint).unwrap_or(0.0) - from.get(joint).unwrap_or(0.0);
        let longest = (0..3).map(|joint| way(joint).abs()).fold(0.0, f64::max);
        let steps = (longest / (4.0 * motion.speed_fraction) / 0.005).ceil().clamp(1.0, 600.0);
        for step in 1..=steps as u64 {
            if self.flaw == Flaw::IgnoresTheStop || self.flaw == Flaw::ForgetsTheStop && step == 1 {
                std::thread::sleep(Duration::from_millis(5));
            } else {
                self.host.wait(Duration::from_millis(5)).inspect_err(|_| self.come_to_rest())?;
            }
            for joint in 0..3 {
                let part = if step as f64 == steps { 1.0 } else { step as f64 / steps };
                self.joints.set(joint, from.get(joint).unwrap_or(0.0) + way(joint) * part);
            }
            if step as f64 == steps {
                self.joints = end;
            }
            let last = step as f64 == steps && self.flaw != Flaw::SaysNothingAtTheEnd;
            self.host.emit("joints", &self.state(!last))?;
        }
        if self.flaw == Flaw::EmitsWhatIsNotDeclared {
            self.host.emit("diary", &self.state(false))?;
        }
        let mut state = self.state(matches!(self.flaw, Flaw::ReturnsWhileItMoves | Flaw::NeverEndsMoving));
        if self.flaw == Flaw::EndsAtNotANumber {
            state.joints.set(0, f64::NAN);
        }
        if self.flaw != Flaw::DoesNotCloseTheMove {
            let inputs = DigitalInputs { time_ns: state.time_ns, joints: end, ..Default::default() };
            self.host.emit("inputs", &inputs)?;
        }
        Ok(state)
    }

    fn stop(&mut self) -> Result<(), PluginError> {
        self.stops.fetch_add(1, Ordering::Relaxed);
        match self.flaw {
            Flaw::NeverEndsMoving => Err(PluginError::Failed("controller: 3 BUSY".to_owned())),
            _ => Ok(()),
        }
    }

    fn read_inputs(&mut self) -> Result<DigitalInputs, PluginError> {
        if self.flaw == Flaw::InputsCannotBeRead {
            return Err(PluginError::unsupported("read its input lines"));
        }
        Ok(DigitalInputs { time_ns: self.now_ns(), joints: self.joints, ..Default::default() })
    }
}

fn failures(report: &CheckReport) -> Vec<&'static str> {
    let failed = |outcome: &CheckOutcome| matches!(outcome, CheckOutcome::Failed(_));
    report.rows.iter().filter(|(_, outcome)| failed(outcome)).map(|(name, _)| *name).collect()
}

#[test]
fn a_robot_without_flaw_passes_every_check() {
    let report = check_robot(ROBOT_MANIFEST, |host| Ok(TestRobot::new(host, Flaw::None)));
    assert!(report.is_good(), "{report}");
    assert!(report.rows.iter().all(|(_, outcome)| *outcome == CheckOutcome::Passed), "{report}");
}

#[test]
fn a_manifest_that_lists_other_lines_joints_or_quantities_than_are_described_fails() {
    let manifest = format!("{ROBOT_MANIFEST}input_lines: 40\n");
    let report = check_robot(&manifest, |host| Ok(TestRobot::new(host, Flaw::None)));
    assert_eq!(failures(&report), [LISTS], "{report}");
    // Two radians either way, and two millimetres.
    let turns = |name: &str, to_deg: f64| {
        format!("{{name: {name}, from_deg: -{0}, to_deg: {to_deg}}}", 2.0_f64.to_degrees())
    };
    let listed = |joints: &[String]| format!("{ROBOT_MANIFEST}joints: [{}]\n", joints.join(", "));
    let gripper = "{name: gripper, from_mm: -2, to_mm: 2}".to_owned();
    for (shoulder_to, names, is_good) in [
        (2.0_f64.to_degrees(), 3, true),
        (2.0_f64.to_degrees() + 0.01, 3, false),
        (2.0_f64.to_degrees(), 2, false),
    ] {
        let joints = [turns("waist", 2.0_f64.to_degrees()), turns("shoulder", shoulder_to), gripper.clone()];
        let manifest = listed(&joints[..names]);
        let report = check_robot(&manifest, |host| Ok(TestRobot::new(host, Flaw::None)));
        assert_eq!(failures(&report).is_empty(), is_good, "{manifest}{report}");
    }
    let manifest = format!("{SENSOR_MANIFEST}quantities: [{{name: height, unit: mm}}]\n");
    let report = check_sensor(&manifest, |host| Ok(TestSensor { host, flawed: false }));
    assert_eq!(failures(&report), [LISTS], "{report}");
    assert!(report.to_string().contains("the manifest lists height [mm]; the sensor describes "), "{report}");
}

#[test]
fn each_flaw_fails_the_check_that_names_it() {
    for (flaw, check) in [
        (Flaw::RangeUpsideDown, "its description makes sense"),
        (Flaw::ReadsAsMoving, "it is at rest when it is read"),
        (Flaw::ReadsAsMoving, "it is at rest before anything is asked of it"),
        (Flaw::EndsBesideTheTarget, "a move ends at its target"),
        (Flaw::TakesRelativeForAbsolute, "a relative move adds to where the joints are"),
        (Flaw::MovesEveryJoint, "joints that take no part stay where they are"),
        (Flaw::SaysNothingAtTheEnd, "its joint stream ends at rest where the move ended"),
        (Flaw::ClockRunsBack, "its times never go back"),
        (Flaw::DoesNotCloseTheMove, "its input stream closes every move"),
        (Flaw::IgnoresTheStop, "a stop ends a move in time"),
        (Flaw::IsLateToStop, "a stop ends a move in time"),
        (Flaw::ForgetsTheStop, "a stop holds until it is activated again"),
        (Flaw::ReturnsWhileItMoves, "a move ends at its target"),
        (Flaw::ReadsAsNotANumber, "it is at rest when it is read"),
        (Flaw::EndsAtNotANumber, "a move ends at its target"),
        (Flaw::TimesAreZero, "its times are those of the cell's clock"),
        (Flaw::TimesAreOfTheDay, "its times are those of the cell's clock"),
        (Flaw::TimesStandStill, "its times are those of the cell's clock"),
        (Flaw::InputsCannotBeRead, "its input lines can be read at rest"),
        (Flaw::EmitsWhatIsNotDeclared, "it emits what its manifest declares"),
        (Flaw::Panics, "it is at rest when it is read"),
    ] {
        let report = check_robot(ROBOT_MANIFEST, |host| Ok(TestRobot::new(host, flaw)));
        assert!(failures(&report).contains(&check), "{flaw:?} passed '{check}':\n{report}");
    }
}

/// On a machine with ten programs for every processor a good robot failed now and then.
#[test]
fn a_stop_that_is_late_once_is_tried_again() {
    let report = check_robot(ROBOT_MANIFEST, |host| Ok(TestRobot::new(host, Flaw::IsLateToStopOnce)));
    assert!(!failures(&report).contains(&"a stop ends a move in time"), "{report}");
}

#[test]
fn a_robot_that_blocks_for_longer_than_its_host_would_wait_is_named_with_both_times() {
    // One report with one slow robot: the one of the third check.
    let first = AtomicU32::new(0);
    let report = check_robot(ROBOT_MANIFEST, |host| {
        let is_third = first.fetch_add(1, Ordering::Relaxed) == 2;
        Ok(TestRobot::new(host, if is_third { Flaw::BlocksInARead } else { Flaw::None }))
    });
    assert_eq!(failures(&report), ["it is at rest when it is read"], "{report}");
    assert!(report.to_string().contains("'read joints' took 5.2 s; it may take 5.0 s"), "{report}");
}

#[test]
fn a_robot_is_stopped_after_a_check_that_failed() {
    let stops = Arc::new(AtomicU32::new(0));
    let report = check_robot(ROBOT_MANIFEST, |host| {
        Ok(TestRobot { stops: Arc::clone(&stops), ..TestRobot::new(host, Flaw::ReturnsWhileItMoves) })
    });
    assert_eq!(failures(&report), ["a move ends at its target"], "{report}");
    // One more for each of the two checks that interrupt a move.
    assert_eq!(stops.load(Ordering::Relaxed), 3);
}

#[test]
fn a_robot_that_was_left_moving_is_stopped_first_and_then_checked() {
    let stops = Arc::new(AtomicU32::new(0));
    let report = check_robot(ROBOT_MANIFEST, |host| {
        Ok(TestRobot { stops: Arc::clone(&stops), ..TestRobot::new(host, Flaw::MovesUntilStopped) })
    });
    assert!(report.is_good(), "{report}");
    // Before the first check; and one for each of the two checks that interrupt a move.
    assert_eq!(stops.load(Ordering::Relaxed), 3);
}

#[test]
fn a_failure_teaches_what_the_contract_says_and_what_to_change() {
    let report = check_robot(ROBOT_MANIFEST, |host| Ok(TestRobot::new(host, Flaw::TimesAreZero)));
    let text = report.to_string();
    for line in [
        "FAILED   its times are those of the cell's clock: a time is 0",
        "         contract: every time_ns is taken from the host's now_ns",
        "         change:   call now_ns (host.now_ns()) where the value is read",
    ] {
        assert!(text.lines().any(|one| one.starts_with(line)), "{line}\n{text}");
    }
}

#[test]
fn nothing_more_is_asked_of_a_robot_that_could_not_be_stopped() {
    let report = check_robot(ROBOT_MANIFEST, |host| Ok(TestRobot::new(host, Flaw::NeverEndsMoving)));
    assert_eq!(failures(&report), ["a move ends at its target"], "{report}");
    let text = report.to_string();
    assert!(
        text.contains(
            "then it could not be stopped, so that nothing more is asked of it: controller: 3 BUSY"
        ),
        "{text}"
    );
    assert!(text.contains("skipped  a relative move adds to where the joints are: not run"), "{text}");
}

#[test]
fn a_panic_fails_its_check_and_the_report_goes_on() {
    let report = check_robot(ROBOT_MANIFEST, |host| Ok(TestRobot::new(host, Flaw::Panics)));
    assert!(
        report.to_string().contains("it panicked: index out of bounds: the robot lost its head"),
        "{report}"
    );
    assert!(report.rows.len() > 13 && report.rows[2].1 == CheckOutcome::Passed, "{report}");
}

#[test]
fn a_manifest_of_the_wrong_kind_is_named() {
    let report = check_robot(SENSOR_MANIFEST, |host| Ok(TestRobot::new(host, Flaw::None)));
    assert_eq!(failures(&report), ["its manifest is good"]);
    assert!(report.to_string().contains("it says it is a sensor, and is a robot"), "{report}");
}

struct TestSensor {
    host: Host,
    flawed: bool,
}

impl Sensor for TestSensor {
    fn create(_config: &Value, host: Host) -> Result<Self, PluginError> {
        Ok(Self { host, flawed: false })
    }

    fn describe(&self) -> SensorDescription {
        let quantity = QuantityDescription { name: "level".to_owned(), unit: String::new() };
        SensorDescription { model: "test".to_owned(), switches: !self.flawed, quantities: vec![quantity] }
    }

    fn configure(&mut self, _settings: &Value) -> Result<(), PluginError> {
        if self.flawed { Ok(()) } else { Err(PluginError::Refused("it has no settings".to_owned())) }
    }

    fn poll(&mut self) -> Result<(), PluginError> {
        loop {
            match self.host.receive::<DigitalInputs>("line") {
                Ok(Some(_)) => {}
                Ok(None) => return Ok(()),
                Err(_) if self.flawed => {}
                Err(error) => return Err(error),
            }
        }
    }

    fn read(&mut self, after_ns: u64) -> Result<Option<Reading>, PluginError> {
        let reading =
            Reading { time_ns: after_ns, fired: Some(false), edges: Vec::new(), quantities: Vec::new() };
        Ok((self.flawed || after_ns == 0).then_some(reading))
    }
}

#[test]
fn a_sensor_without_flaw_passes_every_check() {
    let report = check_sensor(SENSOR_MANIFEST, |host| Ok(TestSensor { host, flawed: false }));
    assert!(report.rows.iter().all(|(_, outcome)| *outcome == CheckOutcome::Passed), "{report}");
}

#[test]
fn a_sensor_that_hides_losses_and_claims_too_much_is_named() {
    let report = check_sensor(SENSOR_MANIFEST, |host| Ok(TestSensor { host, flawed: true }));
    assert_eq!(
        failures(&report),
        [
            "its readings hold what its description says",
            "it does not claim to have seen what has not come",
            "it reports lost messages and goes on",
            "it refuses settings it does not know",
        ]
    );
}

const GAUGE_MANIFEST: &str = "
id: test-gauge
title: A gauge for the suite's own tests
version: 0.1.0
contract: [1, 0]
kind: sensor
library: libtest_gauge.so
";

/// What is wrong with a sensor that measures by itself.
#[derive(Clone, Copy, Debug, PartialEq)]
enum GaugeFlaw {
    None,
    TimesAreZero,
    TimesAreOfTheDay,
    HandsOutAnOldReading,
    LeavesAQuantityOut,
    HasAnUnknownUnit,
    HasASlashInItsUnit,
    HasANameNobodyCanWrite,
    EmitsWhatIsNotDeclared,
    BlocksInARead,
    Panics,
    ReadsNotANumber,
    NeverHasAReading,
}

struct Gauge {
    host: Host,
    flaw: GaugeFlaw,
}

impl Sensor for Gauge {
    fn create(_config: &Value, host: Host) -> Result<Self, PluginError> {
        Ok(Self { host, flaw: GaugeFlaw::None })
    }

    fn describe(&self) -> SensorDescription {
        let (name, unit) = match self.flaw {
            GaugeFlaw::HasAnUnknownUnit => ("height", "furlong"),
            GaugeFlaw::HasASlashInItsUnit => ("height", "mm/s"),
            GaugeFlaw::HasANameNobodyCanWrite => ("the height", "mm"),
            _ => ("height", "mm"),
        };
        let quantity =
            |name: &str, unit: &str| QuantityDescription { name: name.to_owned(), unit: unit.to_owned() };
        SensorDescription {
            model: "gauge".to_owned(),
            switches: false,
            quantities: vec![quantity(name, unit), quantity("temperature", "degC")],
        }
    }

    fn read(&mut self, _after_ns: u64) -> Result<Option<Reading>, PluginError> {
        let now = self.host.now_ns();
        let time_ns = match self.flaw {
            GaugeFlaw::TimesAreZero => 0,
            GaugeFlaw::TimesAreOfTheDay => TIME_OF_DAY_NS + now,
            GaugeFlaw::HandsOutAnOldReading => 5,
            _ => now,
        };
        match self.flaw {
            GaugeFlaw::EmitsWhatIsNotDeclared => {
                self.host.emit("heights", &JointState::new(now, JointVector::zeros(1), false))?;
            }
            GaugeFlaw::BlocksInARead => std::thread::sleep(Duration::from_millis(5_100)),
            GaugeFlaw::Panics => panic!("the gauge lost its head"),
            GaugeFlaw::NeverHasAReading => return Ok(None),
            _ => {}
        }
        let value = if self.flaw == GaugeFlaw::ReadsNotANumber { f64::NAN } else { 12.5 };
        let described = self.describe().quantities.into_iter();
        let kept = if self.flaw == GaugeFlaw::LeavesAQuantityOut { 1 } else { 2 };
        let quantity = |described: QuantityDescription| Quantity {
            name: described.name,
            value,
            standard_uncertainty: 0.1,
        };
        let quantities = described.take(kept).map(quantity).collect();
        Ok(Some(Reading { time_ns, quantities, ..Reading::default() }))
    }
}

#[test]
fn each_flaw_of_a_gauge_fails_the_check_that_names_it() {
    for (flaw, check, words) in [
        (GaugeFlaw::None, "", ""),
        (
            GaugeFlaw::TimesAreZero,
            "its readings are dated by the cell's clock",
            "is 0: take it from the host's clock",
        ),
        (GaugeFlaw::TimesAreOfTheDay, "its readings are dated by the cell's clock", "the time of day"),
        (
            GaugeFlaw::HandsOutAnOldReading,
            "a reading asked for after a moment is not an older one",
            "asked for a reading not before 6 ns it gave one of 5 ns",
        ),
        (GaugeFlaw::LeavesAQuantityOut, "its readings hold what its description says", "lacks 'temperature'"),
        (
            GaugeFlaw::HasAnUnknownUnit,
            "its description makes sense",
            "'furlong' of 'height' is no unit plumb knows",
        ),
        (GaugeFlaw::HasASlashInItsUnit, "its description makes sense", "mm_per_s"),
        (
            GaugeFlaw::HasANameNobodyCanWrite,
            "its description makes sense",
            "cannot be named in an expression",
        ),
        (GaugeFlaw::EmitsWhatIsNotDeclared, "it emits what its manifest declares", "'heights'"),
        (GaugeFlaw::Panics, "its readings hold what its description says", "the gauge lost its head"),
        (GaugeFlaw::ReadsNotANumber, "its readings hold what its description says", "NaN"),
        (GaugeFlaw::NeverHasAReading, "its readings are dated by the cell's clock", "nothing to read"),
    ] {
        let report = check_sensor(GAUGE_MANIFEST, |host| Ok(Gauge { host, flaw }));
        let failed = failures(&report);
        assert!(
            if check.is_empty() { failed.is_empty() } else { failed.contains(&check) },
            "{flaw:?}:\n{report}"
        );
        assert!(report.to_string().contains(words), "{flaw:?} is not reported with '{words}':\n{report}");
    }
}

#[test]
fn a_gauge_may_take_as_long_as_its_manifest_says_and_no_longer() {
    let report = |manifest: &str| {
        // One reading of one check is slow.
        let made = AtomicU32::new(0);
        check_sensor(manifest, |host| {
            let is_slow = made.fetch_add(1, Ordering::Relaxed) == 1;
            Ok(Gauge { host, flaw: if is_slow { GaugeFlaw::BlocksInARead } else { GaugeFlaw::None } })
        })
    };
    let quick = report(GAUGE_MANIFEST);
    assert_eq!(failures(&quick), ["it can be armed, polled and read at once"], "{quick}");
    assert!(quick.to_string().contains("'read' took 5.1 s; it may take 5.0 s"), "{quick}");
    let slow = report(&format!("{GAUGE_MANIFEST}read_time_limit_s: 60\n"));
    assert!(slow.is_good(), "{slow}");
}
