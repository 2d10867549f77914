//! `motors`, with an arm in memory.

use plumb_cell::event::{Event, RunOutcome};
use plumb_plugin::{JointVector, MotorState};
use plumb_record::{Record, RunId};

use super::support::World;
use super::support::running::{cell_with_steps, message_of, request, start, watch};
use super::{folder, readings};

/// The motors of six joints: all but the last report their temperature, none anything else.
fn motors() -> MotorState {
    let temperature = JointVector::from_slice(&[31.0, 52.0, 33.0, 31.0, 31.0, f64::NAN]).expect("six joints");
    MotorState { temperature, temperature_uncertainty: 0.25, ..MotorState::unreported(1, 6) }
}

/// Runs the steps with an arm whose motors report this: how it ended, what it said, and the readings of the record.
fn run(
    motors: Option<MotorState>,
    steps: &str,
) -> (RunOutcome, String, Vec<(String, f64)>, tempfile::TempDir) {
    let folder = folder();
    let cell = cell_with_steps(&folder, steps);
    let world = World::new([0.0; 3]);
    *world.motors.lock().expect("no test panicked") = motors;
    let (outcome, events) = watch(start(request(&cell, &folder), &world), |_: &Event, _| {});
    (outcome, message_of(&events).to_owned(), readings(&folder), folder)
}

#[test]
fn motors_are_recorded_with_what_is_known_of_their_uncertainty_and_steps_depend_on_them() {
    let (outcome, message, readings, folder) = run(
        Some(motors()),
        "
steps:
  - {id: motors, do: {motors: {robot: arm}}}
  - {id: warm, do: {compute: {values: {warm_c: motors.hottest_c}}}, when: motors.hottest_c > 45}
  - {id: hot, do: {compute: {values: {hot_c: motors.hottest_c}}}, when: motors.hottest_c > 60}
  - {id: row, do: {row: {robot: arm, p1_x_mm: 1, temperature_c: motors.shoulder_temperature_c}}}
",
    );
    assert_eq!((outcome, message.as_str()), (RunOutcome::Passed, "all steps passed"));
    let value = |name: &str| readings.iter().find(|(known, _)| known == name).map(|(_, value)| *value);
    assert_eq!(
        (value("shoulder_temperature"), value("warm_c"), value("hot_c")),
        (Some(52.0), Some(52.0), None)
    );
    assert_eq!(value("gripper_temperature"), None, "what is not reported is no reading");
    assert!(!readings.iter().any(|(name, _)| name.ends_with("_load")), "{readings:?}");
    let record = Record::open(folder.path()).expect("the record");
    let recorded = record.readings(RunId(1)).expect("readings");
    let shoulder = recorded.iter().find(|reading| reading.name == "shoulder_temperature").expect("recorded");
    assert_eq!((shoulder.unit.as_str(), shoulder.uncertainty), ("degC", Some(0.25)));
}

#[test]
fn what_was_not_reported_cannot_be_worked_with() {
    let steps = "
steps:
  - {id: motors, do: {motors: {robot: arm}}}
  - {id: load, do: {compute: {values: {load_percent: motors.shoulder_load_percent}}}, on_error: abort}
";
    let (outcome, message, _, _) = run(Some(motors()), steps);
    assert_eq!(outcome, RunOutcome::Error);
    assert!(message.contains("shoulder_load_percent"), "{message}");
}

#[test]
fn a_robot_that_cannot_report_its_motors_is_named_with_its_plugin_and_what_to_do() {
    let steps = "
steps:
  - {id: motors, do: {motors: {robot: arm}}, on_error: abort}
";
    let (outcome, message, readings, _) = run(None, steps);
    assert_eq!((outcome, readings.len()), (RunOutcome::Error, 0));
    let words = "arm: this device cannot read its motors. Its plugin `simulated` does not report motors: take the step out, or name a robot \
                 whose plugin has `read_motors`";
    assert!(message.contains(words), "{message}");
    let (_, message, _, _) = run(Some(MotorState::unreported(1, 6)), steps);
    assert!(message.contains("arm reports nothing of its motors"), "{message}");
}
