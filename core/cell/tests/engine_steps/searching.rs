//! A search, move by move: the pieces, the back-off, the return, and what is said of it.

use std::sync::{Arc, Mutex};

use plumb_cell::event::{Event, RunOutcome, StepOutcome};
use plumb_cell::prompt::Decision;
use plumb_record::{CorrectionKey, NewCorrection, NewRun, Record, RunId};
use tempfile::TempDir;

use super::{folder, outcomes, run_attended};
use crate::support::World;
use crate::support::running::{cell_with_steps, message_of, operator, request, start, watch};

/// The shoulder (deg) at which the hand is 8 mm over the table: 195 + 177.8 sin s - 177.8 sin 78 deg - 109 = 8.
fn edge_deg() -> f64 {
    let elbow = 177.8 * 78.0_f64.to_radians().sin();
    ((8.0 - 195.0 + elbow + 109.0) / 177.8).asin().to_degrees()
}

struct Searched {
    outcome: RunOutcome,
    message: String,
    /// Where the shoulder was at the beginning of each move and at the end, deg.
    ways: Vec<f64>,
}

fn searched_in(folder: &TempDir, steps: &str) -> Searched {
    let cell = cell_with_steps(folder, steps);
    let world = World::new([0.0; 3]);
    let ways = Arc::new(Mutex::new(Vec::new()));
    let (seen, there) = (Arc::clone(&ways), Arc::downgrade(&world));
    *world.on_move.lock().expect("the hook") = Some(Box::new(move |_| {
        if let Some(world) = there.upgrade() {
            seen.lock().expect("the ways").push(world.truth_deg()[1]);
        }
    }));
    let (outcome, events) = watch(start(request(&cell, folder), &world), |_, _| {});
    let mut ways = ways.lock().expect("the ways").clone();
    ways.push(world.truth_deg()[1]);
    Searched { outcome, message: message_of(&events).to_owned(), ways }
}

fn search(more: &str) -> String {
    format!(
        "do: {{search: {{robot: arm, joint: shoulder, until: {{sensor: eye, is: on}}, {more}}}}}, on_error: abort"
    )
}

fn assert_ways(found: &[f64], expected: &[f64]) {
    assert_eq!(found.len(), expected.len(), "{found:?}, not {expected:?}");
    for (found_deg, expected_deg) in found.iter().zip(expected) {
        assert!((found_deg - expected_deg).abs() < 1e-6, "{found:?}, not {expected:?}");
    }
}

#[test]
fn a_search_comes_in_pieces_backs_off_comes_slowly_and_ends_at_its_edge() {
    let steps = format!(
        "\nsteps:\n  - {{id: lower, {}}}\n",
        search(
            "travel_deg: -40, back_off_deg: 2, fast: {chunk_deg: 3, speed: 1}, slow: {chunk_deg: 0.8, speed: 0.2}"
        )
    );
    let found = searched_in(&folder(), &steps);
    assert_eq!(found.outcome, RunOutcome::Passed, "{}", found.message);
    let edge = edge_deg();
    // 8.4 deg to the edge: three pieces, back off to 2 deg before it, three slow pieces, and past the edge by 0.4 deg, so back once more and to the edge itself.
    let before = edge + 2.0;
    let expected = [41.0, 38.0, 35.0, 32.0, before, before - 0.8, before - 1.6, before - 2.4, before, edge];
    assert_ways(&found.ways, &expected);
}

const THERE: &str = "
steps:
  - {id: lower, do: {search: {robot: arm, joint: shoulder, travel_deg: -40, until: {sensor: eye, is: on}}}, on_error: abort}
  - {id: press, do: {move: {robot: arm, by_deg: {shoulder: -1}}}}
  - {id: again, ";

#[test]
fn a_search_that_is_there_already_backs_off_by_its_own_way_or_tries_one_slow_piece_and_says_where_to_go() {
    let edge = edge_deg();
    let steps = format!("{THERE}{}}}\n", search("travel_deg: -40, back_off_deg: 3, already_there: back_off"));
    let found = searched_in(&folder(), &steps);
    assert_eq!(found.outcome, RunOutcome::Passed, "{}", found.message);
    let pressed =
        found.ways.iter().position(|way| (way - (edge - 1.0)).abs() < 1e-6).expect("it was pressed");
    assert!((found.ways[pressed + 1] - (edge + 2.0)).abs() < 1e-6, "{:?}", found.ways);
    assert!((found.ways[found.ways.len() - 1] - edge).abs() < 1e-6, "{:?}", found.ways);

    let steps = format!("{THERE}{}}}\n", search("travel_deg: -40, slow: {chunk_deg: 0.5}"));
    let found = searched_in(&folder(), &steps);
    assert_eq!(found.outcome, RunOutcome::Error);
    assert!((found.ways[found.ways.len() - 1] - (edge - 1.5)).abs() < 1e-6, "{:?}", found.ways);
    assert!(
        found.message.contains("eye is already ON at the start of the search. Move arm's shoulder towards greater values until eye is OFF"),
        "{}",
        found.message
    );
}

/// A folder where the zero of the shoulder is 1.5 deg.
fn folder_with_zero() -> TempDir {
    let folder = folder();
    let mut record = Record::open(folder.path()).expect("the record");
    let run = record.start_run(&NewRun { cell: "teachmover".into(), ..NewRun::default() }).expect("a run");
    let key = CorrectionKey { device: "arm".into(), quantity: "joint_zero".into(), site: "shoulder".into() };
    let zero = NewCorrection { key, old: 0.0, new: 1.5, uncertainty: None, budget: None, unit: "deg".into() };
    let numbers = record.propose_corrections(run, "test", "teachmover", &[zero]).expect("proposed");
    record.apply_corrections("teachmover", "arm", &numbers, "test").expect("applied");
    folder
}

fn message_of_step(folder: &TempDir, step: &str) -> String {
    let record = Record::open(folder.path()).expect("the record");
    let steps = record.steps(RunId(2)).expect("the steps");
    let found = steps.iter().rev().find(|attempt| attempt.step == step).expect("it was tried");
    found.message.clone().expect("a message")
}

#[test]
fn what_a_search_found_and_what_it_did_not_is_reported_in_corrected_numbers() {
    let folder = folder_with_zero();
    let steps = format!(
        "\nsteps:\n  - {{id: up, {}}}\n  - {{id: lower, {}}}\n",
        search("travel_deg: 2, nothing_found: go_on"),
        search("travel_deg: -40")
    );
    let found = searched_in(&folder, &steps);
    assert_eq!(found.outcome, RunOutcome::Passed, "{}", found.message);
    assert_eq!(message_of_step(&folder, "up"), "eye stayed OFF while shoulder went from 42.50 to 44.50 deg");
    let expected = format!("eye came on with shoulder at {:.4} deg (", edge_deg() + 1.5);
    let message = message_of_step(&folder, "lower");
    assert!(message.starts_with(&expected), "{message}, not {expected}");
}

#[test]
fn a_search_goes_as_far_as_the_joint_does_and_says_so() {
    let steps =
        format!("\nsteps:\n  - {{id: up, {}}}\n", search("travel_deg: 500, fast: {chunk_deg: 30, speed: 1}"));
    let found = searched_in(&folder(), &steps);
    assert_eq!(found.outcome, RunOutcome::Failed);
    let sentence = "eye stayed OFF while shoulder went from 41.00 to 183.35 deg, and shoulder goes no further. Move the arm nearer";
    assert!(found.message.contains(sentence), "{}", found.message);
    assert_ways(&found.ways, &[41.0, 71.0, 101.0, 131.0, 161.0, 3.2_f64.to_degrees()]);
    let steps = format!("\nsteps:\n  - {{id: up, {}}}\n", search("travel_deg: 0"));
    let found = searched_in(&folder(), &steps);
    assert!(
        found.message.contains("the travel of the search is 0: give how far it may go"),
        "{}",
        found.message
    );
}

#[test]
fn a_search_that_finds_nothing_says_how_far_it_looked_and_asks_what_to_do() {
    let steps = "
steps:
  - {id: lower, do: {search: {robot: arm, joint: shoulder, travel_deg: 2, until: {sensor: eye, is: on}}}}
  - {id: after, do: {move: {robot: arm, by_deg: {waist: 1}}}}
";
    let (outcome, events, _, _) = run_attended(steps, operator(Decision::Skip));
    assert_eq!(outcome, RunOutcome::Failed, "what was to be found was not, although the run went on");
    let error = events.iter().find_map(|event| match event {
        Event::StepFinished { outcome: StepOutcome::Failed, message, .. } => Some(message.clone()),
        _ => None,
    });
    let error = error.expect("an error");
    assert!(error.starts_with("eye stayed OFF while shoulder went from"), "{error}");
    let lower: Vec<_> = outcomes(&events)
        .into_iter()
        .filter(|(step, _)| step == "lower")
        .map(|(_, outcome)| outcome)
        .collect();
    assert_eq!(lower, [StepOutcome::Failed, StepOutcome::Skipped]);
}

#[test]
fn a_search_that_is_there_already_says_so_or_backs_off_first() {
    let search = |extra: &str| {
        format!(
            "
steps:
  - {{id: lower, do: {{search: {{robot: arm, joint: shoulder, travel_deg: -40, until: {{sensor: eye, is: on}}}}}}}}
  - {{id: press, do: {{move: {{robot: arm, by_deg: {{shoulder: -1}}}}}}}}
  - {{id: again, do: {{search: {{robot: arm, joint: shoulder, travel_deg: -40, until: {{sensor: eye, is: on}}{extra}}}}}}}
"
        )
    };
    let (outcome, events, _, _) = run_attended(&search(""), operator(Decision::Abort));
    assert_eq!(outcome, RunOutcome::Error);
    assert!(
        message_of(&events).contains("eye is already ON at the start of the search"),
        "{}",
        message_of(&events)
    );
    let (outcome, events, _, _) =
        run_attended(&search(", already_there: back_off"), operator(Decision::Abort));
    assert_eq!((outcome, message_of(&events)), (RunOutcome::Passed, "all steps passed"));
}

#[test]
fn a_slow_approach_goes_as_far_as_the_fast_one_may_have_overshot_and_no_further() {
    let folder = folder();
    let steps = format!("\nsteps:\n  - {{id: lower, {}}}\n", search("travel_deg: -40, back_off_deg: 2"));
    let cell = cell_with_steps(&folder, &steps);
    let world = World::new([0.0; 3]);
    *world.fires_at.lock().expect("no test panicked") = vec![8.0, -500.0];
    let (outcome, events) = watch(start(request(&cell, &folder), &world), |_, _| {});
    assert_eq!(outcome, RunOutcome::Error);
    assert!(
        message_of(&events).contains("eye came on on shoulder's slow approach, but stays off"),
        "{}",
        message_of(&events)
    );
    // The back-off of 2 deg and one fast piece of 1 deg beyond the edge.
    let at = world.truth_deg()[1];
    assert!((at - (edge_deg() - 3.0)).abs() < 1e-6, "{at}");
}

#[test]
fn how_far_a_search_has_come_is_reported_as_a_share_of_its_way_with_where_the_joint_is() {
    let folder = folder_with_zero();
    let steps = format!(
        "\nsteps:\n  - {{id: lower, {}}}\n",
        search("travel_deg: -40, fast: {chunk_deg: 4, speed: 1}")
    );
    let cell = cell_with_steps(&folder, &steps);
    let (_, events) = watch(start(request(&cell, &folder), &World::new([0.0; 3])), |_, _| {});
    let reported: Vec<_> = events
        .iter()
        .filter_map(|event| match event {
            Event::StepProgress { step, fraction, text } if step.0 == "lower" => {
                Some((*fraction, text.as_str()))
            }
            _ => None,
        })
        .collect();
    for (reported, (fraction, text)) in
        reported.iter().zip([(0.1, "fast: shoulder at 38.50 deg"), (0.2, "fast: shoulder at 34.50 deg")])
    {
        assert!((reported.0.expect("a share") - fraction).abs() < 1e-9, "{reported:?}");
        assert_eq!(reported.1, text);
    }
    let slow = reported.iter().filter(|(_, text)| text.starts_with("slowly: shoulder at "));
    assert!(slow.count() >= 4, "{reported:?}");
}
