//! Ways out of a step that failed: an answer given again, the arm moved by hand, back to the step that placed it.

use std::collections::VecDeque;
use std::sync::Arc;

use plumb_cell::RunHandle;
use plumb_cell::command::Command;
use plumb_cell::event::{Event, RunOutcome, StepOutcome};
use plumb_cell::prompt::{Answer, Decision, Prompt, PromptKind};
use plumb_record::{Record, RunId};

use super::{folder, outcomes, run_attended};
use crate::support::World;
use crate::support::running::{Patient, ZERO_ERROR_DEG, cell_with_steps, message_of, request, start, watch};

fn answer(prompt: &Prompt, answer: Answer) -> Command {
    Command::Answer { prompt: prompt.id, answer, by: "ada".to_owned() }
}

fn jog(prompt: &Prompt, joint: &str, by: f64) -> Command {
    Command::Jog { prompt: prompt.id, joint: joint.to_owned(), by }
}

/// What an operator does about one prompt.
enum Reply {
    Decide(Decision),
    Number(f64),
    /// Jogs one joint by this, then confirms.
    Jog(&'static str, f64),
    /// Accepts corrections.
    Accept,
    /// Raises the shoulder first, which a search has lowered.
    RaiseAndJog(&'static str, f64),
    /// Leaves the run to be resumed.
    Keep,
}

/// Replies to the prompts in their order, and notes what was asked.
fn replies(replies: Vec<Reply>, asked: &mut Vec<Prompt>) -> impl FnMut(&Event, &RunHandle) {
    let mut replies = VecDeque::from(replies);
    let mut patient = Patient::default();
    move |event, handle| {
        patient.take(event, handle);
        let Event::PromptAsked { prompt } = event else { return };
        asked.push(prompt.clone());
        match replies.pop_front() {
            Some(Reply::Decide(decision)) => {
                handle.send(answer(prompt, Answer::Decision { decision }));
            }
            Some(Reply::Number(value)) => {
                handle.send(answer(prompt, Answer::Number { value }));
            }
            Some(Reply::Accept) => {
                handle.send(answer(prompt, Answer::Choice { key: "accept".to_owned() }));
            }
            Some(Reply::Jog(joint, by)) => {
                patient.send([jog(prompt, joint, by), answer(prompt, Answer::Done)], handle);
            }
            Some(Reply::RaiseAndJog(joint, by)) => {
                let raise = jog(prompt, "shoulder", 30.0);
                patient.send([raise, jog(prompt, joint, by), answer(prompt, Answer::Done)], handle);
            }
            Some(Reply::Keep) => {
                handle.send(Command::Keep);
            }
            None => {
                handle.send(Command::Abort);
            }
        }
    }
}

fn run(
    steps: &str,
    operator: Vec<Reply>,
) -> (RunOutcome, Vec<Event>, Vec<Prompt>, tempfile::TempDir, Arc<World>) {
    let mut asked = Vec::new();
    let (outcome, events, folder, world) = run_attended(steps, replies(operator, &mut asked));
    (outcome, events, asked, folder, world)
}

fn labels(prompt: &Prompt) -> Vec<(Decision, &str)> {
    let PromptKind::Decision { options, labels, .. } = &prompt.kind else { panic!("a decision: {prompt:?}") };
    options.iter().copied().zip(labels.iter().map(String::as_str)).collect()
}

const LEVEL: &str = "
steps:
  - {id: level, title: How tilted?, do: {prompt: {text: Read it, number: {unit: deg}}}}
  - {id: twice, do: {compute: {values: {tilt_deg: level.value * 2}}}}
  - {id: upright, title: Upright?, do: {check: {that: twice.tilt_deg <= 2, otherwise: 'Tilted by {level.value:.1}'}}}
";

#[test]
fn a_check_that_failed_takes_the_answer_it_judges_again() {
    let operator = vec![Reply::Number(1.5), Reply::Decide(Decision::Retry), Reply::Number(0.3)];
    let (outcome, events, asked, folder, _) = run(LEVEL, operator);
    assert_eq!((outcome, message_of(&events)), (RunOutcome::Passed, "all steps passed"));
    assert_eq!(asked[1].text, "Tilted by 1.5");
    let offered = labels(&asked[1]);
    assert_eq!(offered[0], (Decision::Retry, "Answer \u{201c}How tilted?\u{201d} again"));
    assert_eq!(offered[1].0, Decision::Move);
    assert!(offered[1].1.ends_with("yourself, then answer \u{201c}How tilted?\u{201d} again"), "{offered:?}");
    assert_eq!(offered.len(), 4, "there is no earlier prompt to go back to: {offered:?}");
    let back = events.iter().find_map(|event| match event {
        Event::WentBack { from, to } => Some((from.0.as_str(), to.0.as_str())),
        _ => None,
    });
    assert_eq!(back, Some(("upright", "level")));
    let record = Record::open(folder.path()).expect("the record");
    let steps = record.steps(RunId(1)).expect("the steps");
    let of = |id: &str| {
        let attempts = steps.iter().filter(|attempt| attempt.step == id);
        attempts.map(|attempt| attempt.outcome.clone().unwrap_or_default()).collect::<Vec<_>>()
    };
    assert_eq!(of("level"), ["passed", "interrupted", "passed"]);
    assert_eq!(of("upright"), ["failed", "interrupted", "passed"], "the record keeps the failed attempt");
    let last = steps.iter().rev().find(|attempt| attempt.step == "level").expect("it was asked");
    assert_eq!(last.result["value"], 0.3);
}

#[test]
fn a_failed_check_may_be_left_out_as_ever_and_then_the_run_has_failed() {
    let (outcome, events, ..) = run(LEVEL, vec![Reply::Number(1.5), Reply::Decide(Decision::Skip)]);
    assert_eq!((outcome, message_of(&events)), (RunOutcome::Failed, "Tilted by 1.5"));
    let again = vec![Reply::Number(1.5), Reply::Decide(Decision::Abort)];
    assert_eq!(run(LEVEL, again).0, RunOutcome::Failed);
}

const TOO_LOW: &str = "
steps:
  - {id: lower, do: {search: {robot: arm, joint: shoulder, travel_deg: -40, until: {sensor: eye, is: on}}}}
  - {id: press, do: {move: {robot: arm, by_deg: {shoulder: -1}}}}
  - {id: again, do: {search: {robot: arm, joint: shoulder, travel_deg: -10, until: {sensor: eye, is: on}}}}
";

#[test]
fn an_arm_that_is_too_low_is_raised_by_hand_and_the_search_begins_where_it_is_then() {
    let operator = vec![Reply::Decide(Decision::Move), Reply::Jog("shoulder", 5.0)];
    let (outcome, events, asked, ..) = run(TOO_LOW, operator);
    assert!(asked[0].text.contains("eye is already ON at the start of the search"), "{}", asked[0].text);
    assert!(asked[0].text.contains("shoulder towards greater values until eye is OFF"), "{}", asked[0].text);
    let PromptKind::JogTo { joint, sensor, .. } = &asked[1].kind else { panic!("{:?}", asked[1]) };
    assert_eq!((joint.as_deref(), sensor.as_deref()), (Some("shoulder"), Some("eye")));
    assert_eq!(outcome, RunOutcome::Passed, "{}", message_of(&events));
    let after = events.iter().skip_while(|event| !matches!(event, Event::PromptAsked { .. }));
    let seen: Vec<bool> = after
        .filter_map(|event| match event {
            Event::Signal { on, .. } => Some(*on),
            _ => None,
        })
        .collect();
    assert!(seen[0] && seen.contains(&false), "the operator sees the sensor go off: {seen:?}");
}

#[test]
fn a_repeated_search_that_looks_no_further_finds_nothing_however_often_and_does_after_a_move() {
    let far = TOO_LOW.replace("travel_deg: -40", "travel_deg: -2");
    let operator =
        vec![Reply::Decide(Decision::Retry), Reply::Decide(Decision::Move), Reply::Jog("shoulder", -12.0)];
    let (outcome, events, asked, ..) = run(&far, operator);
    assert!(asked[0].text.starts_with("eye stayed OFF while shoulder went from"), "{}", asked[0].text);
    assert_eq!(asked[0].text, asked[1].text, "again from the same place");
    let lower = outcomes(&events).into_iter().filter(|(step, _)| step == "lower");
    let lower: Vec<StepOutcome> = lower.map(|(_, outcome)| outcome).collect();
    assert_eq!(lower[..2], [StepOutcome::Failed, StepOutcome::Failed]);
    assert!(
        lower[2..].contains(&StepOutcome::Passed) || outcome != RunOutcome::Passed,
        "{lower:?} {outcome:?}"
    );
}

const PLACED: &str = "
steps:
  - {id: place, title: Over the white, do: {prompt: {text: There, jog_to: {robot: arm}}}}
  - id: turn
    do:
      repeat:
        times: 2
        steps:
          - {id: lower, do: {search: {robot: arm, joint: shoulder, travel_deg: -30, until: {sensor: eye, is: on}}}}
          - {id: raise, do: {move: {robot: arm, by_deg: {shoulder: 20}}}}
  - {id: count, do: {compute: {values: {turns: all.lower.len()}}}}
";

#[test]
fn an_arm_on_the_wrong_side_goes_back_to_where_it_was_placed_and_what_was_found_there_is_forgotten() {
    let operator =
        vec![Reply::Jog("waist", -20.0), Reply::Decide(Decision::Back), Reply::RaiseAndJog("waist", 20.0)];
    let (outcome, events, asked, folder, _) = run(PLACED, operator);
    assert_eq!(labels(&asked[1])[2], (Decision::Back, "Go back to \u{201c}Over the white\u{201d}"));
    assert_eq!(asked[2].title, "Over the white");
    assert_eq!((outcome, message_of(&events)), (RunOutcome::Passed, "all steps passed"));
    let record = Record::open(folder.path()).expect("the record");
    let count = record.readings(RunId(1)).expect("the readings");
    assert_eq!(count.last().map(|one| one.value), Some(2.0), "only turns that count: {count:?}");
}

#[test]
fn a_run_that_went_back_is_resumed_there_and_not_where_it_failed() {
    let folder = folder();
    let cell = cell_with_steps(&folder, PLACED);
    let world = World::new(ZERO_ERROR_DEG);
    let mut request_of = request(&cell, &folder);
    request_of.unattended = false;
    let mut asked = Vec::new();
    let operator = vec![Reply::Jog("waist", -20.0), Reply::Decide(Decision::Back), Reply::Keep];
    let (outcome, _) = watch(start(request_of, &world), replies(operator, &mut asked));
    assert_eq!(outcome, RunOutcome::NeedsOperator);

    let mut resumed = request(&cell, &folder);
    resumed.unattended = false;
    resumed.resume = Some(RunId(1));
    let mut confirmed = false;
    let mut again = Vec::new();
    let mut patient = Patient::default();
    let (outcome, events) = watch(start(resumed, &world), |event, handle| {
        patient.take(event, handle);
        let Event::PromptAsked { prompt } = event else { return };
        again.push(prompt.title.clone());
        match &prompt.kind {
            PromptKind::ConfirmPose { .. } => {
                confirmed = true;
                handle.send(answer(prompt, Answer::Confirmed));
            }
            PromptKind::JogTo { .. } => {
                let jogs =
                    [jog(prompt, "shoulder", 30.0), jog(prompt, "waist", 20.0), answer(prompt, Answer::Done)];
                patient.send(jogs, handle);
            }
            _ => {
                handle.send(Command::Abort);
            }
        }
    });
    assert!(confirmed, "{again:?}");
    assert_eq!(again[1], "Over the white");
    assert_eq!(outcome, RunOutcome::Passed, "{}", message_of(&events));
}

#[test]
fn nothing_is_moved_by_hand_while_a_device_is_lost_and_that_answer_is_refused() {
    let folder = folder();
    let cell =
        cell_with_steps(&folder, "steps:\n  - {id: turn, do: {move: {robot: arm, by_deg: {waist: 1}}}}\n");
    let world = World::new(ZERO_ERROR_DEG);
    world.lose_arm_at_move.store(1, std::sync::atomic::Ordering::SeqCst);
    let mut run = request(&cell, &folder);
    run.unattended = false;
    let (mut offered, mut refused) = (Vec::new(), Vec::new());
    let (outcome, _) = watch(start(run, &world), |event, handle| match event {
        Event::PromptAsked { prompt } => {
            offered = labels(prompt).into_iter().map(|(decision, _)| decision).collect();
            handle.send(answer(prompt, Answer::Decision { decision: Decision::Move }));
        }
        Event::AnswerRefused { reason, .. } => {
            refused.push(reason.clone());
            handle.send(Command::Abort);
        }
        _ => {}
    });
    assert_eq!(outcome, RunOutcome::Aborted);
    assert_eq!(offered, [Decision::Retry, Decision::Skip, Decision::Abort]);
    assert_eq!(refused, ["`move` is not to be chosen here"]);
}

/// What is found is how far the waist reads beyond 11 deg, where it truly is; the search then looks where there is nothing.
const CORRECTED: &str = "
steps:
  - {id: place, title: Over the white, do: {prompt: {text: There, jog_to: {robot: arm}}}}
  - {id: found, do: {compute: {values: {off_deg: 11 - arm.joints.waist_deg}}}}
  - {id: shift, do: {apply: {robot: arm, joint_zero: {waist: {shift_deg: found.off_deg, uncertainty_deg: 0.1}}}}}
  - {id: lower, do: {search: {robot: arm, joint: shoulder, travel_deg: -1, until: {sensor: eye, is: on}}}}
";

/// The zeros of the waist that were put in force and taken back, in order.
fn zeros_of_waist(events: &[Event]) -> Vec<(&'static str, f64)> {
    let rounded = |value: f64| (value * 1e6).round() / 1e6;
    let seen = events.iter().filter_map(|event| match event {
        Event::CorrectionApplied { correction, .. } => Some(("applied", rounded(correction.new))),
        Event::CorrectionUndone { correction, .. } => Some(("undone", rounded(correction.new))),
        Event::WentBack { .. } => Some(("back", 0.0)),
        _ => None,
    });
    seen.collect()
}

#[test]
fn going_back_past_a_correction_takes_it_back_and_what_is_found_then_is_applied_anew() {
    let operator = vec![
        Reply::Jog("elbow", 0.5),
        Reply::Accept,
        Reply::Decide(Decision::Back),
        // The first time the arm was led astray: by 2 deg.
        Reply::Jog("waist", -2.0),
        Reply::Accept,
        Reply::Decide(Decision::Skip),
    ];
    let (outcome, events, asked, folder, _) = run(CORRECTED, operator);
    assert_eq!(labels(&asked[2])[2], (Decision::Back, "Go back to \u{201c}Over the white\u{201d}"));
    let expected_text = "\nGoing back undoes the correction of joint zero of arm waist.";
    assert!(asked[2].text.ends_with(expected_text), "{}", asked[2].text);
    assert_eq!(outcome, RunOutcome::Failed, "the search was left out: {}", message_of(&events));
    assert!(
        asked[4].text.contains("zero of waist: 0.0000 -> 3.7000 deg"),
        "from what was in force: {}",
        asked[4].text
    );
    let expected = [("applied", 1.7), ("back", 0.0), ("undone", 0.0), ("applied", 3.7)];
    assert_eq!(zeros_of_waist(&events), expected);
    let record = Record::open(folder.path()).expect("the record");
    let in_force = record.corrections_in_force("teachmover", "arm").expect("the zeros");
    assert_eq!(in_force.iter().map(|one| (one.value * 1e6).round() / 1e6).collect::<Vec<_>>(), [3.7]);
    let found = record.corrections_of_run(RunId(1)).expect("what it found");
    let undone = record.undone_in_run(RunId(1)).expect("what it took back");
    assert_eq!((found.len(), undone), (2, vec![(found[0].id, 2)]));
    let why = &record.revisions("teachmover").expect("the revisions")[1].reason;
    assert_eq!(why, "run 1: the operator went back to `place`");
}

#[test]
fn a_correction_that_is_discarded_after_going_back_leaves_what_was_in_force_before_the_run() {
    let operator = vec![
        Reply::Jog("elbow", 0.5),
        Reply::Accept,
        Reply::Decide(Decision::Back),
        Reply::Jog("elbow", -0.5),
    ];
    let (_, events, _, folder, _) = run(CORRECTED, operator);
    assert_eq!(zeros_of_waist(&events)[..3], [("applied", 1.7), ("back", 0.0), ("undone", 0.0)]);
    let record = Record::open(folder.path()).expect("the record");
    let in_force = record.corrections_in_force("teachmover", "arm").expect("the zeros");
    assert_eq!(in_force.iter().map(|one| one.value).collect::<Vec<_>>(), [0.0]);
}
