//! Corrections of a sensor's parameters: worked out, accepted, taken by the sensor and put in force together, or not at all.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use plumb_cell::command::Command;
use plumb_cell::event::{Event, RunOutcome};
use plumb_cell::prompt::{Answer, PromptKind};
use plumb_record::{Record, RunId};
use serde_json::json;
use tempfile::TempDir;

use super::folder;
use crate::support::World;
use crate::support::running::{cell_with_steps, message_of, request, start, watch};

/// A step with these parameters.
fn correcting(parameters: &str, more: &str) -> String {
    format!(
        "\nsteps:\n  - {{id: set, do: {{correct: {{sensor: eye, parameters: {{{parameters}}}{more}}}}}, on_error: abort}}\n"
    )
}

const SHIFT: &str = "tilt_deg: {shift: 0.5, uncertainty: 0.02, plausible: 0.5}";
const FACTOR: &str = "scale: {factor: 1.25, uncertainty: 0.01, plausible: 0.25}";

struct Corrected {
    outcome: RunOutcome,
    events: Vec<Event>,
    texts: Vec<String>,
}

/// Runs the steps where every question is answered by this key.
fn run_in(folder: &TempDir, world: &Arc<World>, steps: &str, key: &str) -> Corrected {
    let cell = cell_with_steps(folder, steps);
    let mut run = request(&cell, folder);
    run.unattended = false;
    let mut texts = Vec::new();
    let (outcome, events) = watch(start(run, world), |event, handle| {
        let Event::PromptAsked { prompt } = event else { return };
        assert!(matches!(prompt.kind, PromptKind::Choice { .. }), "{prompt:?}");
        texts.push(prompt.text.clone());
        let answer = Answer::Choice { key: key.to_owned() };
        handle.send(Command::Answer { prompt: prompt.id, answer, by: "ada".to_owned() });
    });
    Corrected { outcome, events, texts }
}

fn in_force(folder: &TempDir, cell: &str) -> Vec<(String, f64, String)> {
    let record = Record::open(folder.path()).expect("the record");
    let corrections = record.corrections_in_force(cell, "eye").expect("read");
    let mut values: Vec<_> = corrections.into_iter().map(|one| (one.key.site, one.value, one.unit)).collect();
    values.sort_by(|a, b| a.0.cmp(&b.0));
    values
}

fn message_of_step(events: &[Event], id: &str) -> String {
    let found = events.iter().find_map(|event| match event {
        Event::StepFinished { step, message, .. } if step.0 == id => Some(message.clone()),
        _ => None,
    });
    found.expect("the step ended")
}

#[test]
fn an_accepted_correction_is_taken_by_the_sensor_and_a_second_one_builds_on_it() {
    let (folder, world) = (folder(), World::new([0.0; 3]));
    let steps = correcting(&format!("{SHIFT}, {FACTOR}"), "");
    let first = run_in(&folder, &world, &steps, "accept");
    assert_eq!((first.outcome, message_of(&first.events)), (RunOutcome::Passed, "all steps passed"));
    let [text] = first.texts.as_slice() else { panic!("{:?}", first.texts) };
    assert!(text.starts_with("Apply these corrections?\ntilt: ") && text.contains("\nscale: "), "{text}");
    assert_eq!(
        in_force(&folder, "teachmover"),
        [("scale".to_owned(), 1.25, String::new()), ("tilt".to_owned(), 0.5, "deg".to_owned()),]
    );
    let taken = json!({"corrections": {"tilt_deg": 0.5, "scale": 1.25}});
    assert_eq!(*world.configured.lock().expect("not poisoned"), std::slice::from_ref(&taken));
    let message = message_of_step(&first.events, "set");
    assert!(message.starts_with("applied: tilt ") && message.contains("(revision 1)"), "{message}");

    // A sensor that is started again is given what is in force, and the next change is of that.
    let second = run_in(&folder, &world, &steps, "accept");
    assert_eq!(second.outcome, RunOutcome::Passed);
    let again = json!({"corrections": {"tilt_deg": 1.0, "scale": 1.5625}});
    assert_eq!(*world.configured.lock().expect("not poisoned"), [taken.clone(), taken, again]);
}

#[test]
fn a_discarded_correction_changes_nothing_and_the_run_goes_on() {
    let (folder, world) = (folder(), World::new([0.0; 3]));
    let steps = correcting(SHIFT, "")
        + "  - {id: expected, do: {check: {that: 'set.applied == false && set.revision == 0', otherwise: never}}}\n";
    let run = run_in(&folder, &world, &steps, "reject");
    assert_eq!((run.outcome, message_of(&run.events)), (RunOutcome::Passed, "all steps passed"));
    assert_eq!(message_of_step(&run.events, "set"), "discarded: eye works with the values it had");
    assert!(
        world.configured.lock().expect("not poisoned").is_empty()
            && in_force(&folder, "teachmover").is_empty()
    );
    let found = Record::open(folder.path()).expect("the record").corrections_of_run(RunId(1)).expect("read");
    assert_eq!(found.len(), 1, "what was found stays in the record");
}

#[test]
fn a_correction_that_need_not_be_asked_about_is_applied_at_once() {
    let (folder, world) = (folder(), World::new([0.0; 3]));
    let steps = correcting(SHIFT, ", ask: false")
        + "  - {id: expected, do: {check: {that: 'set.applied && set.revision == 1', otherwise: never}}}\n";
    let run = run_in(&folder, &world, &steps, "reject");
    assert_eq!((run.outcome, run.texts.len()), (RunOutcome::Passed, 0), "{}", message_of(&run.events));
    assert_eq!(world.configured.lock().expect("not poisoned").len(), 1);
}

#[test]
fn a_greater_change_than_plausible_is_refused_with_both_numbers_and_nothing_is_changed() {
    let not_a_number = "tilt_deg: {shift: 0.0 / 0.0, uncertainty: 0.02, plausible: 0.5}";
    for (parameters, words) in [
        (
            SHIFT.replace("shift: 0.5", "shift: 0.501"),
            "tilt would shift by 0.501 deg, more than the plausible 0.5 deg",
        ),
        (SHIFT.replace("shift: 0.5", "shift: -0.501"), "tilt would shift by -0.501 deg"),
        (FACTOR.replace("1.25", "1.26"), "scale would change by 26.0 %, more than the plausible 25 %"),
        (FACTOR.replace("1.25", "0.74"), "scale would change by -26.0 %"),
        (not_a_number.to_owned(), ""),
    ] {
        let (folder, world) = (folder(), World::new([0.0; 3]));
        let run = run_in(&folder, &world, &correcting(&parameters, ""), "accept");
        assert_eq!(run.outcome, RunOutcome::Error, "{parameters}");
        assert!(message_of(&run.events).contains(words), "{}", message_of(&run.events));
        assert!(run.texts.is_empty() && in_force(&folder, "teachmover").is_empty());
    }
}

#[test]
fn what_the_sensor_refuses_does_not_come_into_force() {
    let (folder, world) = (folder(), World::new([0.0; 3]));
    world.refuses_changes.store(true, Ordering::SeqCst);
    let run = run_in(&folder, &world, &correcting(SHIFT, ""), "accept");
    assert_eq!(run.outcome, RunOutcome::Error);
    assert!(message_of(&run.events).contains("too far"), "{}", message_of(&run.events));
    assert!(in_force(&folder, "teachmover").is_empty());
}
