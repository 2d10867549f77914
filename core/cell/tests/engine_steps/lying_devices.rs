//! Devices that say what is not so: nothing of it becomes a row.

use std::sync::atomic::Ordering;

use plumb_cell::engine::RunRequest;
use plumb_cell::event::{Event, RunOutcome};
use plumb_cell::prompt::Decision;
use plumb_record::{Record, RunId};

use super::folder;
use crate::support::running::{ZERO_ERROR_DEG, cell_with_steps, message_of, operator, request, start, watch};
use crate::support::{Lie, World};

const MOVE_AND_ROW: &str = "
steps:
  - {id: out, do: {move: {robot: arm, by_deg: {waist: 5}}}, on_error: abort}
  - {id: row, do: {row: {robot: arm, p1_x_mm: 1, p1_y_mm: 2, p1_z_mm: 3}}}
";

#[test]
fn a_move_that_ended_elsewhere_or_not_at_all_is_an_error_and_no_row() {
    let lies: [(Lie, &[&str]); 6] = [
        (|state| state.joints.set(0, 20.0), &["waist", "to 14.300 deg", "reports 1145.916 deg"]),
        (|state| state.joints.set(0, state.joints.get(0).unwrap_or(0.0) - 0.01), &["waist", "to 14.300 deg"]),
        (|state| state.moving = 1, &["still moves"]),
        (|state| state.joints.set(1, f64::NAN), &["shoulder", "NaN"]),
        (|state| state.joints.count = 3, &["3 joint values", "6 joints"]),
        (|state| state.time_ns = 0, &["before one it reported earlier"]),
    ];
    for (lie, words) in lies {
        let folder = folder();
        let cell = cell_with_steps(&folder, MOVE_AND_ROW);
        let world = World::new(ZERO_ERROR_DEG);
        *world.lie_after_move.lock().expect("the lie") = Some(lie);
        let (outcome, events) = watch(start(request(&cell, &folder), &world), |_, _| {});
        let message = message_of(&events);
        assert_eq!(outcome, RunOutcome::Error, "{message}");
        for word in words {
            assert!(message.contains(word), "{word}: {message}");
        }
        assert!(message.contains("arm") && message.contains("plugin `simulated`"), "{message}");
        let rows =
            events.iter().any(|event| matches!(event, Event::StepFinished { step, .. } if step.0 == "row"));
        assert!(!rows, "no row is made of it");
    }
}

#[test]
fn a_robot_that_describes_a_speed_below_zero_is_not_used() {
    let folder = folder();
    let cell = cell_with_steps(&folder, MOVE_AND_ROW);
    let world = World::new(ZERO_ERROR_DEG);
    *world.waist_speed.lock().expect("the speed") = -1.0;
    let (outcome, events) = watch(start(request(&cell, &folder), &world), |_, _| {});
    assert_eq!(outcome, RunOutcome::Error);
    assert!(
        message_of(&events).contains("its waist has a greatest speed of -1 rad/s"),
        "{}",
        message_of(&events)
    );
    assert_eq!(world.moves.load(Ordering::SeqCst), 0);
}

#[test]
fn a_robot_beyond_its_own_limits_is_not_measured_with() {
    let folder = folder();
    let cell = cell_with_steps(&folder, MOVE_AND_ROW);
    let world = World::new(ZERO_ERROR_DEG);
    world.push_deg(2, -200.0);
    let (outcome, events) = watch(start(request(&cell, &folder), &world), |_, _| {});
    assert_eq!(outcome, RunOutcome::Error);
    let message = message_of(&events);
    assert!(
        message.contains("elbow at -279.300 deg, but by its own description it goes from -183.346 deg"),
        "{message}"
    );
    assert_eq!(world.moves.load(Ordering::SeqCst), 0);
}

#[test]
fn a_reading_from_before_the_move_is_refused_and_not_kept() {
    let steps = "
steps:
  - {id: out, do: {move: {robot: arm, by_deg: {waist: 5}}}}
  - {id: seen, do: {measure: {sensor: eye}}, on_error: abort}
";
    let folder = folder();
    let cell = cell_with_steps(&folder, steps);
    let world = World::new(ZERO_ERROR_DEG);
    world.reads_at_ns.store(1, Ordering::SeqCst);
    let (outcome, events) = watch(start(request(&cell, &folder), &world), operator(Decision::Abort));
    assert_eq!(outcome, RunOutcome::Error);
    let message = message_of(&events);
    assert!(message.contains("the reading of eye is stale"), "{message}");
    assert!(
        message.contains("before the end of the last motion") && message.contains("plugin `ir-proximity`"),
        "{message}"
    );
    let record = Record::open(folder.path()).expect("the record");
    assert!(record.readings(RunId(1)).expect("the readings").is_empty());
}

/// Nobody would end the trying: what was decided has been tried once the device does not come back.
#[test]
fn a_retry_decided_beforehand_ends_with_a_device_that_does_not_come_back() {
    let steps = "
steps:
  - {id: out, do: {move: {robot: arm, by_deg: {waist: 1}}}, on_error: retry, retries: 3}
";
    for unattended in [false, true] {
        let folder = folder();
        let cell = cell_with_steps(&folder, steps);
        let world = World::new([0.0; 3]);
        world.lose_arm_at_move.store(1, Ordering::SeqCst);
        // Arm and eye, as the run begins.
        world.connects_at_most.store(2, Ordering::SeqCst);
        let request = RunRequest { unattended, ..request(&cell, &folder) };
        let (outcome, events) = watch(start(request, &world), |_, _| {});
        assert_eq!(outcome, RunOutcome::Error, "{}", message_of(&events));
        assert_eq!(world.connections.load(Ordering::SeqCst), 3, "one more was tried");
        assert!(message_of(&events).contains("SIGKILL"), "{}", message_of(&events));
    }
}
