//! Searches where the light is not twice the same.

use plumb_cell::event::{Event, RunOutcome};

use super::support::World;
use super::support::running::{ZERO_ERROR_DEG, cell_with_steps, message_of, request, start, watch};
use super::{folder, readings};

const LOWER: &str = "
steps:
  - {id: lower, do: {search: {robot: arm, joint: shoulder, travel_deg: -40, until: {sensor: eye, is: on}, back_off_deg: 2}}, on_error: abort}
  - {id: found, do: {compute: {values: {at_deg: lower.joints.shoulder_deg, stands_deg: arm.joints.shoulder_deg}}}}
";

/// Lowers the hand in light that makes the sensor fire at these heights, one after the other.
fn lowered(heights: &[f64]) -> (RunOutcome, String, Vec<(String, f64)>, f64) {
    let folder = folder();
    let cell = cell_with_steps(&folder, LOWER);
    let world = World::new(ZERO_ERROR_DEG);
    *world.fires_at.lock().expect("no test panicked") = heights.to_vec();
    let (outcome, events) = watch(start(request(&cell, &folder), &world), |_: &Event, _| {});
    (outcome, message_of(&events).to_owned(), readings(&folder), world.height())
}

#[test]
fn a_search_creeps_on_until_the_sensor_is_as_wanted_and_records_the_edge_itself() {
    let (outcome, message, steady, height) = lowered(&[]);
    assert_eq!(outcome, RunOutcome::Passed, "{message}");
    assert!((height - 8.0).abs() < 1e-9, "in steady light it ends at the edge itself: {height}");
    let (outcome, message, unsteady, height) = lowered(&[8.0, 8.0, 7.9]);
    assert_eq!(outcome, RunOutcome::Passed, "{message}");
    assert_eq!(unsteady[0], steady[0], "the edge that is recorded is the one of the slow approach");
    assert!((7.7..=7.9).contains(&height), "it ends where the sensor has fired again: {height}");
    assert!(unsteady[1].1 < unsteady[0].1 - 0.03, "{unsteady:?}");
}

#[test]
fn a_search_goes_no_further_after_its_edge_than_the_fast_approach_may_overshoot() {
    let (outcome, message, _, height) = lowered(&[8.0, 8.0, 3.0]);
    assert_eq!(outcome, RunOutcome::Error);
    assert!(
        message.contains("eye came on on shoulder's slow approach, but stays off when it comes there again, even 1.00 deg further"),
        "{message}"
    );
    assert!(height > 5.0, "{height}");
}

#[test]
fn a_search_that_may_find_nothing_says_so_and_the_run_goes_on() {
    let steps = "
steps:
  - {id: up, do: {search: {robot: arm, joint: shoulder, travel_deg: 2, until: {sensor: eye, is: on}, nothing_found: go_on}}}
  - {id: down, do: {search: {robot: arm, joint: shoulder, travel_deg: -40, until: {sensor: eye, is: on}, nothing_found: go_on}}}
  - {id: expected, do: {check: {that: 'up.found == false && down.found && up.joints.shoulder_deg > 43', otherwise: never}}}
";
    let folder = folder();
    let cell = cell_with_steps(&folder, steps);
    let (outcome, events) =
        watch(start(request(&cell, &folder), &World::new(ZERO_ERROR_DEG)), |_: &Event, _| {});
    assert_eq!((outcome, message_of(&events)), (RunOutcome::Passed, "all steps passed"));
}
