//! A run that was cut off goes on where it was: in its repetitions, past what was not needed, and with what had failed.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use plumb_cell::event::{Event, RunOutcome, StepOutcome};
use plumb_record::RunId;
use tempfile::TempDir;

use super::{folder, outcomes, readings};
use crate::support::World;
use crate::support::running::{cell_with_steps, message_of, request, start, watch};

/// Runs the steps until the arm is lost in that move, and resumes the run; the events of the resumed run and its outcome.
fn lost_and_resumed(steps: &str, lost_at: usize) -> (TempDir, RunOutcome, Vec<Event>, Arc<World>) {
    let folder = folder();
    let cell = cell_with_steps(&folder, steps);
    let world = World::new([0.0; 3]);
    world.lose_arm_at_move.store(lost_at, Ordering::SeqCst);
    let (outcome, events) = watch(start(request(&cell, &folder), &world), |_, _| {});
    assert_eq!(outcome, RunOutcome::Error, "{}", message_of(&events));
    let mut again = request(&cell, &folder);
    again.resume = Some(RunId(1));
    let (outcome, events) = watch(start(again, &world), |_, _| {});
    (folder, outcome, events, world)
}

const TURNS: &str = "
steps:
  - {id: never, when: 1 > 2, do: {repeat: {times: 2, steps: [{id: x, do: {compute: {values: {v: 1}}}}]}}}
  - id: again
    do:
      repeat:
        times: 4
        until: count.n >= 2
        steps:
          - {id: count, do: {compute: {values: {n: again.turn}}}}
          - {id: odd, when: again.turn != 2, do: {compute: {values: {m: again.turn}}}}
          - {id: out, do: {move: {robot: arm, by_deg: {waist: 1}}}}
  - {id: last, do: {move: {robot: arm, by_deg: {waist: 1}}}}
  - {id: turns, do: {compute: {values: {turns: again.turns, counted: all.count.len()}}}}
";

fn named(pairs: &[(&str, f64)]) -> Vec<(String, f64)> {
    pairs.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect()
}

#[test]
fn a_repetition_goes_on_in_the_turn_in_which_it_was_cut_off() {
    for (lost_at, moves, open) in [(1, 4, "again[1].out"), (2, 4, "again[2].out"), (3, 4, "last")] {
        let (folder, outcome, events, world) = lost_and_resumed(TURNS, lost_at);
        let at = events.iter().find_map(|event| match event {
            Event::RunStarted { resumed_at, .. } => Some(resumed_at.as_ref().map(|step| step.0.clone())),
            _ => None,
        });
        assert_eq!(at, Some(Some(open.to_owned())), "lost at move {lost_at}");
        assert_eq!((outcome, message_of(&events)), (RunOutcome::Passed, "all steps passed"), "{lost_at}");
        assert_eq!(
            world.moves.load(Ordering::SeqCst),
            moves,
            "lost at move {lost_at}: only that is done again"
        );
        let all = [("n", 1.0), ("m", 1.0), ("n", 2.0), ("turns", 4.0), ("counted", 2.0)];
        assert_eq!(readings(&folder), named(&all), "lost at move {lost_at}");
        // What is done already is shown again as it ended, in order, and every step of the plan once.
        let shown: Vec<_> = outcomes(&events).into_iter().map(|(step, _)| step).collect();
        let expected = [
            "again[1].count",
            "again[1].odd",
            "again[1].out",
            "again[2].count",
            "again[2].odd",
            "again[2].out",
        ];
        let of_turns: Vec<&str> = shown
            .iter()
            .map(String::as_str)
            .filter(|step| step.starts_with("again[1]") || step.starts_with("again[2]"))
            .collect();
        assert_eq!(of_turns, expected, "lost at move {lost_at}");
    }
}

#[test]
fn a_check_that_failed_and_was_left_out_fails_the_resumed_run_too() {
    let steps = "
steps:
  - {id: first, do: {check: {that: 1 > 2, otherwise: one is not more than two}}, on_error: skip}
  - {id: other, do: {check: {that: 2 > 3, otherwise: two is not more than three}}, on_error: skip}
  - {id: unneeded, when: 1 > 2, do: {compute: {values: {a: 1}}}}
  - {id: out, do: {move: {robot: arm, by_deg: {waist: 1}}}}
  - {id: after, do: {compute: {values: {b: 2}}}}
";
    let (folder, outcome, events, _) = lost_and_resumed(steps, 1);
    assert_eq!((outcome, message_of(&events)), (RunOutcome::Failed, "one is not more than two"));
    assert_eq!(readings(&folder), named(&[("b", 2.0)]));
    let reported: Vec<_> = outcomes(&events);
    let of = |id: &str| reported.iter().find(|(step, _)| step == id).map(|(_, outcome)| *outcome);
    assert_eq!(of("first"), Some(StepOutcome::Skipped));
    assert_eq!(of("unneeded"), Some(StepOutcome::NotNeeded));
}
