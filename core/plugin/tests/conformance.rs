//! The conformance suite passes what is right and names what is wrong.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::time::Duration;

use plumb_plugin::conformance::{CheckOutcome, CheckReport, check_robot, check_sensor};
use plumb_plugin::{
    DigitalInputs, Host, JointDescription, JointState, JointUnit, JointVector, LineDescription, Motion,
    PluginError, QuantityDescription, Reading, Robot, RobotCapabilities, RobotDescription, Sensor,
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
    EndsBesideTheTarget,
    TakesRelativeForAbsolute,
    MovesEveryJoint,
    SaysNothingAtTheEnd,
    ClockRunsBack,
    DoesNotCloseTheMove,
    IgnoresTheStop,
    ForgetsTheStop,
}

struct TestRobot {
    host: Host,
    flaw: Flaw,
    joints: JointVector,
    reads: u64,
}

impl TestRobot {
    fn new(host: Host, flaw: Flaw) -> Self {
        Self { host, flaw, joints: JointVector::zeros(3), reads: 0 }
    }

    fn state(&self, moving: bool) -> JointState {
        JointState::new(self.host.now_ns(), self.joints, moving)
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
        let mut state = self.state(self.flaw == Flaw::ReadsAsMoving);
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
                self.host.wait(Duration::from_millis(5))?;
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
        let state = self.state(false);
        if self.flaw != Flaw::DoesNotCloseTheMove {
            let inputs = DigitalInputs { time_ns: state.time_ns, joints: end, ..Default::default() };
            self.host.emit("inputs", &inputs)?;
        }
        Ok(state)
    }

    fn stop(&mut self) -> Result<(), PluginError> {
        Ok(())
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
fn each_flaw_fails_the_check_that_names_it() {
    for (flaw, check) in [
        (Flaw::RangeUpsideDown, "its description makes sense"),
        (Flaw::ReadsAsMoving, "it stands when it is read"),
        (Flaw::EndsBesideTheTarget, "a move ends where it was told to"),
        (Flaw::TakesRelativeForAbsolute, "a relative move adds to where the joints are"),
        (Flaw::MovesEveryJoint, "joints that take no part stay where they are"),
        (Flaw::SaysNothingAtTheEnd, "its joint stream ends at rest where the move ended"),
        (Flaw::ClockRunsBack, "its times never go back"),
        (Flaw::DoesNotCloseTheMove, "its input stream closes every move"),
        (Flaw::IgnoresTheStop, "a stop ends a move in time"),
        (Flaw::ForgetsTheStop, "a stop holds until it is activated again"),
    ] {
        let report = check_robot(ROBOT_MANIFEST, |host| Ok(TestRobot::new(host, flaw)));
        assert!(failures(&report).contains(&check), "{flaw:?} passed '{check}':\n{report}");
    }
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
