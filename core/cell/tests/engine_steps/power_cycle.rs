//! Zeros after a power cycle: what the drive reads is compared with where the record left it.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use plumb_cell::command::Command;
use plumb_cell::event::{Event, RunOutcome};
use plumb_cell::prompt::{Answer, Decision};
use plumb_cell::workcell::Workcell;
use plumb_record::{Record, RunId};
use tempfile::TempDir;

use super::folder;
use crate::support::World;
use crate::support::running::{
    ZERO_ERROR_DEG, cell_with_steps, message_of, operator, request, start, start_commanded, watch, workcell,
};

const TURN: &str = "
steps:
  - {id: turn, do: {move: {robot: arm, by_deg: {waist: 1}}}}
";

/// An arm whose zeros were found, where that run left it.
fn initialized(folder: &TempDir) -> Arc<World> {
    let world = World::new(ZERO_ERROR_DEG);
    world.is_new.store(false, Ordering::SeqCst);
    let (outcome, events) = watch(start(request(&workcell("cell.yaml"), folder), &world), |_, _| {});
    assert_eq!(outcome, RunOutcome::Passed, "{}", message_of(&events));
    world
}

fn turn(cell: &Arc<Workcell>, record: &TempDir, world: &Arc<World>) -> (RunOutcome, Vec<Event>) {
    let mut run = request(cell, record);
    run.answers = None;
    watch(start(run, world), |_, _| {})
}

fn losses(events: &[Event]) -> Vec<String> {
    let lost = events.iter().filter_map(|event| match event {
        Event::ZerosLost { device, joints, reason } => {
            Some(format!("{device} {}: {reason}", joints.join(" ")))
        }
        _ => None,
    });
    lost.collect()
}

#[test]
fn a_drive_that_reads_where_it_was_left_keeps_its_zeros_and_nothing_is_said() {
    let (record, steps) = (folder(), folder());
    let world = initialized(&record);
    let cell = cell_with_steps(&steps, TURN);
    for _ in 0..2 {
        let (outcome, events) = turn(&cell, &record, &world);
        assert_eq!((outcome, message_of(&events)), (RunOutcome::Passed, "all steps passed"));
        assert_eq!(losses(&events), [""; 0]);
    }
}

#[test]
fn a_drive_that_was_switched_off_loses_its_zeros_until_a_run_finds_them_again() {
    let (record, steps) = (folder(), folder());
    let cell = cell_with_steps(&steps, TURN);
    let world = initialized(&record).switched_off_and_on();
    world.is_new.store(false, Ordering::SeqCst);
    let (outcome, events) = turn(&cell, &record, &world);
    assert_eq!(outcome, RunOutcome::NeedsOperator);
    assert_eq!(outcome.exit_code(), 4);
    let message = losses(&events);
    assert_eq!(message.len(), 1, "{message:?}");
    assert!(
        message[0].starts_with("arm waist shoulder elbow: its drive reads 0.000 deg at the waist"),
        "{message:?}"
    );
    assert!(message[0].contains("and run 1 left it at"), "{message:?}");
    assert!(message[0].contains("its keep-out planes are not watched"), "{message:?}");
    assert!(message_of(&events).contains("arm has lost its zeros"), "{}", message_of(&events));
    let help = "Find them with a procedure that says `finds_zeros` first";
    assert!(message_of(&events).contains(help), "{}", message_of(&events));

    // Left alone since: the drive now reads what the record holds, and the zeros are lost all the same.
    let (outcome, events) = turn(&cell, &record, &world);
    assert_eq!(outcome, RunOutcome::NeedsOperator);
    assert!(message_of(&events).contains("and no run has found it since"), "{}", message_of(&events));
    assert_eq!(world.moves.load(Ordering::SeqCst), 0, "nothing has moved");
}

#[test]
fn a_run_that_finds_the_zeros_begins_without_them_and_ends_with_new_ones() {
    let record = folder();
    let before = initialized(&record);
    // Its counters begin anew and the arm is over the white paper as on the first day.
    let world = World::new([2.0, -1.0, 0.5]);
    world.is_new.store(false, Ordering::SeqCst);
    drop(before);
    let whole = workcell("cell.yaml");
    let (outcome, events) = watch(start(request(&whole, &record), &world), |_, _| {});
    assert_eq!(outcome, RunOutcome::Passed, "{}", message_of(&events));
    assert_eq!(losses(&events).len(), 1);
    let applied: Vec<(f64, f64)> = events
        .iter()
        .filter_map(|event| match event {
            Event::CorrectionApplied { correction, .. } => Some((correction.old, correction.new)),
            _ => None,
        })
        .collect();
    for ((old, new), truth) in applied.iter().zip([2.0, -1.0, 0.5]) {
        assert_eq!(*old, 0.0, "the zeros of before are not begun with");
        assert!((new - truth).abs() < 0.01, "{applied:?}");
    }
    let steps = folder();
    let (outcome, events) = turn(&cell_with_steps(&steps, TURN), &record, &world);
    assert_eq!((outcome, message_of(&events)), (RunOutcome::Passed, "all steps passed"));
}

#[test]
fn a_new_simulated_world_for_each_run_loses_nothing() {
    let (record, steps) = (folder(), folder());
    drop(initialized(&record));
    let another = World::new(ZERO_ERROR_DEG);
    let (outcome, events) = turn(&cell_with_steps(&steps, TURN), &record, &another);
    assert_eq!((outcome, losses(&events).len()), (RunOutcome::Passed, 0));
}

#[test]
fn an_arm_moved_with_its_pendant_asks_anyone_who_is_there_whether_its_power_stayed_on() {
    for (key, ended) in [("hold", RunOutcome::Passed), ("lost", RunOutcome::NeedsOperator)] {
        let (record, steps) = (folder(), folder());
        let world = initialized(&record);
        world.push_deg(0, 7.0);
        let mut run = request(&cell_with_steps(&steps, TURN), &record);
        (run.answers, run.unattended) = (None, false);
        let mut asked = String::new();
        let (outcome, events) = watch(start(run, &world), |event, handle| {
            if let Event::PromptAsked { prompt } = event {
                asked = prompt.text.clone();
                let answer = Answer::Choice { key: key.to_owned() };
                handle.send(Command::Answer { prompt: prompt.id, answer, by: "ada".to_owned() });
            }
        });
        assert_eq!(outcome, ended, "{}", message_of(&events));
        assert!(asked.contains("If its power was off, its zeros no longer hold"), "{asked}");
        assert_eq!(losses(&events).is_empty(), key == "hold");
        let log = Record::open(record.path()).expect("the record").log(RunId(2)).expect("its log");
        assert!(log.iter().any(|line| line.level == "warning" && line.source == "arm"), "{log:?}");
    }
}

#[test]
fn an_arm_that_died_in_mid_move_is_on_its_way_and_keeps_its_zeros() {
    let (record, steps) = (folder(), folder());
    let world = initialized(&record);
    let cell = cell_with_steps(
        &steps,
        "
steps:
  - {id: turn, do: {move: {robot: arm, by_deg: {waist: 10}}}}
",
    );
    world.lose_arm_at_move.store(world.moves.load(Ordering::SeqCst) + 1, Ordering::SeqCst);
    assert_eq!(turn(&cell, &record, &world).0, RunOutcome::Error);
    let (outcome, events) = turn(&cell, &record, &world);
    assert_eq!((outcome, message_of(&events)), (RunOutcome::Passed, "all steps passed"));
    assert_eq!(losses(&events), [""; 0]);
}

#[test]
fn a_run_that_was_stopped_in_mid_move_notes_where_the_arm_came_to_rest() {
    let (record, steps) = (folder(), folder());
    let world = initialized(&record);
    let cell = cell_with_steps(&steps, TURN);
    let first = world.moves.load(Ordering::SeqCst) + 1;
    let mut run = request(&cell, &record);
    (run.answers, run.unattended) = (None, false);
    let running = start_commanded(run, &world, move |number, handle| {
        if number == first {
            handle.send(Command::Abort);
        }
    });
    assert_eq!(watch(running, operator(Decision::Abort)).0, RunOutcome::Aborted);
    *world.on_move.lock().expect("the hook") = None;
    let (outcome, events) = turn(&cell, &record, &world);
    assert_eq!((outcome, losses(&events).len()), (RunOutcome::Passed, 0), "{}", message_of(&events));
}

#[test]
fn a_resumed_run_whose_drive_counts_anew_needs_an_operator() {
    let (record, steps) = (folder(), folder());
    let world = initialized(&record);
    let cell = cell_with_steps(&steps, TURN);
    world.lose_arm_at_move.store(world.moves.load(Ordering::SeqCst) + 1, Ordering::SeqCst);
    assert_eq!(turn(&cell, &record, &world).0, RunOutcome::Error);
    let anew = world.switched_off_and_on();
    anew.is_new.store(false, Ordering::SeqCst);
    let mut again = request(&cell, &record);
    (again.answers, again.resume) = (None, Some(RunId(2)));
    let (outcome, events) = watch(start(again, &anew), |_, _| {});
    assert_eq!(outcome, RunOutcome::NeedsOperator);
    assert_eq!(losses(&events).len(), 1);
    assert_eq!(anew.moves.load(Ordering::SeqCst), 0);
}
