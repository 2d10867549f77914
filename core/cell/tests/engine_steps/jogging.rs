//! Jogging: at most one step in flight and none queued, stopped cleanly, and warned of keep-out planes while zeros are in question.

use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex};

use plumb_cell::RunHandle;
use plumb_cell::answers::load_answers;
use plumb_cell::command::Command;
use plumb_cell::event::{Event, RunOutcome};
use plumb_cell::prompt::{Answer, PromptId, PromptKind};

use super::folder;
use crate::support::World;
use crate::support::running::{cell_with_steps, message_of, request, start, start_commanded, watch};

const JOG_STEPS: &str = "
steps:
  - {id: place, do: {prompt: {text: There, jog_to: {robot: arm}}}}
";

fn jog(prompt: PromptId, joint: &str, by: f64) -> Command {
    Command::Jog { prompt, joint: joint.to_owned(), by }
}

fn answer(prompt: PromptId, answer: Answer) -> Command {
    Command::Answer { prompt, answer, by: "ada".to_owned() }
}

#[test]
fn a_hundred_jogs_at_once_move_the_arm_by_at_most_two_steps_and_enter_is_not_queued_behind() {
    let folder = folder();
    let cell = cell_with_steps(&folder, JOG_STEPS);
    let world = World::new([0.0; 3]);
    let mut run = request(&cell, &folder);
    run.unattended = false;
    let asked: Arc<Mutex<Option<PromptId>>> = Arc::default();
    let known = Arc::clone(&asked);
    // A key held down: the rest comes while the first step is on its way, and Enter after it.
    let running = start_commanded(run, &world, move |number, handle| {
        let prompt = known.lock().expect("the prompt").expect("asked before it moves");
        if number == 1 {
            for _ in 1..100 {
                handle.send(jog(prompt, "waist", -5.0));
            }
            handle.send(answer(prompt, Answer::Done));
        }
    });
    let mut refused = Vec::new();
    let (outcome, _) = watch(running, |event, handle| match event {
        Event::PromptAsked { prompt } => {
            *asked.lock().expect("the prompt") = Some(prompt.id);
            handle.send(jog(prompt.id, "waist", -5.0));
        }
        Event::AnswerRefused { prompt, reason } => {
            refused.push(reason.clone());
            handle.send(answer(*prompt, Answer::Done));
        }
        _ => {}
    });
    assert_eq!(outcome, RunOutcome::Passed);
    assert!(world.moves.load(Ordering::SeqCst) <= 2, "{} moves", world.moves.load(Ordering::SeqCst));
    assert!(world.truth_deg()[0] >= 11.0 - 2.0 * 5.0 - 1e-9, "{:?}", world.truth_deg());
    assert_eq!(refused.len(), 1, "{refused:?}");
    assert!(refused[0].contains("still moving when you answered"), "{refused:?}");
}

#[test]
fn a_stop_in_mid_jog_withdraws_the_prompt_drops_the_jogs_and_asks_anew_after_the_resume() {
    let folder = folder();
    let cell = cell_with_steps(&folder, JOG_STEPS);
    let world = World::new([0.0; 3]);
    let mut run = request(&cell, &folder);
    run.unattended = false;
    let asked: Arc<Mutex<Option<PromptId>>> = Arc::default();
    let known = Arc::clone(&asked);
    let running = start_commanded(run, &world, move |_, handle| {
        let prompt = known.lock().expect("the prompt").expect("asked before it moves");
        handle.send(Command::Stop);
        for _ in 0..10 {
            handle.send(jog(prompt, "waist", -5.0));
        }
    });
    let mut order = Vec::new();
    let (outcome, _) = watch(running, |event, handle| match event {
        Event::PromptAsked { prompt } => {
            order.push("asked");
            let again = asked.lock().expect("the prompt").replace(prompt.id).is_some();
            handle.send(if again { answer(prompt.id, Answer::Done) } else { jog(prompt.id, "waist", -5.0) });
        }
        Event::PromptWithdrawn { .. } => order.push("withdrawn"),
        Event::PromptAnswered { .. } => order.push("answered"),
        Event::Paused { .. } => {
            order.push("paused");
            handle.send(Command::Resume);
        }
        _ => {}
    });
    assert_eq!(outcome, RunOutcome::Passed);
    assert_eq!(order, ["asked", "withdrawn", "paused", "asked", "answered"]);
    assert_eq!(world.moves.load(Ordering::SeqCst), 1);
}

/// Sends the hand through the table, by the zeros believed, as often as asked for; `choice` is what is answered to the warning.
fn jog_through_the_table(
    mut choose: impl FnMut(usize) -> &'static str,
) -> (Vec<String>, Vec<Event>, RunOutcome, Arc<World>) {
    let folder = folder();
    let cell = cell_with_steps(&folder, JOG_STEPS);
    let world = World::new([0.0; 3]);
    let mut run = request(&cell, &folder);
    run.unattended = false;
    let mut asked = Vec::new();
    let mut lowest = 0;
    let (outcome, events) = watch(start(run, &world), |event, handle: &RunHandle| match event {
        Event::PromptAsked { prompt } => {
            asked.push(prompt.text.clone());
            match &prompt.kind {
                PromptKind::Choice { default, .. } => {
                    assert_eq!(default.as_deref(), Some("stay"), "Enter alone moves nothing");
                    let key = choose(asked.len()).to_owned();
                    handle.send(answer(prompt.id, Answer::Choice { key }));
                }
                _ if asked.len() > 4 => {
                    handle.send(answer(prompt.id, Answer::Done));
                }
                _ => {
                    handle.send(jog(prompt.id, "shoulder", -30.0));
                }
            }
        }
        // Seen beyond the table twice, so that the jog is over: it is where it was to be.
        Event::Clearance { planes, .. } if planes[0].clearance_mm.is_some_and(|mm| mm < 0.0) => {
            lowest += 1;
            if lowest == 2 {
                let prompt = PromptId(3);
                handle.send(answer(prompt, Answer::Done));
            }
        }
        Event::AnswerRefused { prompt, reason } if reason.contains("still moving") => {
            handle.send(answer(*prompt, Answer::Done));
        }
        _ => {}
    });
    (asked, events, outcome, world)
}

#[test]
fn who_would_jog_through_the_table_is_warned_and_nothing_moves_until_it_is_confirmed() {
    let (asked, _, outcome, world) = jog_through_the_table(|_| "stay");
    assert_eq!(outcome, RunOutcome::Passed);
    assert!(asked[1].contains("which are in question, the end of link wrist_roll would come"), "{asked:?}");
    assert!(asked[1].contains("past the table. Nothing has moved."), "{asked:?}");
    assert_eq!(asked.iter().filter(|text| text.contains("Nothing has moved")).count(), 2, "{asked:?}");
    assert_eq!(world.moves.load(Ordering::SeqCst), 0);
}

#[test]
fn once_confirmed_the_jog_goes_on_and_the_height_says_that_it_is_beyond_the_table() {
    let (asked, events, outcome, world) = jog_through_the_table(|_| "go_on");
    assert_eq!(outcome, RunOutcome::Passed);
    assert_eq!(asked.len(), 3, "{asked:?}");
    assert_eq!(world.moves.load(Ordering::SeqCst), 1);
    let clearance = events.iter().rev().find_map(|event| match event {
        Event::Clearance { planes, .. } => Some(planes[0].clone()),
        _ => None,
    });
    let clearance = clearance.expect("the height is shown");
    assert_eq!(clearance.plane, "the table");
    assert!(clearance.clearance_mm.is_some_and(|mm| mm < 0.0), "{clearance:?}");
}

#[test]
fn a_pose_in_the_answers_that_leads_through_the_table_needs_an_operator() {
    let folder = folder();
    let cell = cell_with_steps(&folder, JOG_STEPS);
    let world = World::new([0.0; 3]);
    let answers = folder.path().join("answers.yaml");
    std::fs::write(&answers, "answers:\n  place: {pose_deg: {shoulder: 10}}\n").expect("written");
    let procedures: Vec<_> = cell.procedures.iter().map(AsRef::as_ref).collect();
    let mut run = request(&cell, &folder);
    run.answers = Some(load_answers(&answers, &procedures, &[]).expect("good answers"));
    let (outcome, events) = watch(start(run, &world), |_, _| {});
    assert_eq!(outcome, RunOutcome::NeedsOperator);
    assert!(
        message_of(&events).contains("Somebody has to look whether the way is free"),
        "{}",
        message_of(&events)
    );
    assert_eq!(world.moves.load(Ordering::SeqCst), 0);
}
