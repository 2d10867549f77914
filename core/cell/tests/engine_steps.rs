//! Single kinds of steps, and what is decided about those that fail, with an arm in memory.

#![expect(clippy::expect_used, clippy::panic, reason = "a failed expectation is how a test fails")]

#[path = "engine_steps/arrival.rs"]
mod arrival;
#[path = "engine_steps/correct.rs"]
mod correct;
#[path = "engine_steps/dry_run.rs"]
mod dry_run;
#[path = "engine_steps/jogging.rs"]
mod jogging;
#[path = "engine_steps/level_and_photo.rs"]
mod level_and_photo;
#[path = "engine_steps/lying_devices.rs"]
mod lying_devices;
#[path = "engine_steps/motors.rs"]
mod motors;
#[path = "engine_steps/power_cycle.rs"]
mod power_cycle;
#[path = "engine_steps/readings.rs"]
mod readings_of_sensors;
#[path = "engine_steps/resuming.rs"]
mod resuming;
#[path = "engine_steps/safety.rs"]
mod safety;
#[path = "engine_steps/searching.rs"]
mod searching;
#[path = "engine_steps/simulated_operator.rs"]
mod simulated_operator;
mod support;
#[path = "engine_steps/uncertainties.rs"]
mod uncertainties;
#[path = "engine_steps/unsteady_light.rs"]
mod unsteady_light;
#[path = "engine_steps/ways_out.rs"]
mod ways_out;

use std::sync::Arc;
use std::sync::atomic::Ordering;

use plumb_cell::RunHandle;
use plumb_cell::answers::load_answers;
use plumb_cell::command::{Command, PauseWhen};
use plumb_cell::engine::{RunRequest, StartError, start_run};
use plumb_cell::event::{Event, RunOutcome, StepOutcome};
use plumb_cell::prompt::{Answer, Decision, PromptKind};
use plumb_cell::workcell::Workcell;
use plumb_record::{Record, RunId};
use support::running::{
    ZERO_ERROR_DEG, cell_with_steps, message_of, operator, request, start, start_commanded, watch, workcell,
};
use support::{Devices, PendantHas, World};
use tempfile::TempDir;

fn folder() -> TempDir {
    tempfile::tempdir().expect("a directory")
}

/// Runs the steps with somebody there who answers by `watcher`.
fn run_attended(
    steps: &str,
    mut watcher: impl FnMut(&Event, &RunHandle),
) -> (RunOutcome, Vec<Event>, TempDir, Arc<World>) {
    let folder = folder();
    let cell = cell_with_steps(&folder, steps);
    let world = World::new(ZERO_ERROR_DEG);
    let mut run = request(&cell, &folder);
    run.unattended = false;
    let (outcome, events) = watch(start(run, &world), |event, handle| watcher(event, handle));
    (outcome, events, folder, world)
}

fn readings(folder: &TempDir) -> Vec<(String, f64)> {
    let readings = Record::open(folder.path()).expect("the record").readings(RunId(1)).expect("the readings");
    readings.into_iter().map(|reading| (reading.name, reading.value)).collect()
}

fn outcomes(events: &[Event]) -> Vec<(String, StepOutcome)> {
    let finished = events.iter().filter_map(|event| match event {
        Event::StepFinished { step, outcome, .. } => Some((step.0.clone(), *outcome)),
        _ => None,
    });
    finished.collect()
}

#[test]
fn answers_are_there_for_later_expressions_and_texts() {
    let steps = "
parameters: {h_mm: 8}
steps:
  - {id: paper, do: {prompt: {text: Which?, choice: {light: Light, dark: Dark}}}}
  - {id: gauge, do: {prompt: {text: 'How high, near {h_mm}?', number: {unit: mm, minimum: h_mm - 2, maximum: h_mm + 2}}}}
  - id: sums
    do:
      compute:
        script: let twice = 2 * gauge.value;
        values: {twice_mm: twice, half: gauge.value / 2, is_light: 'paper.choice == \"light\"'}
  - {id: expected, do: {check: {that: 'sums.is_light && sums.twice_mm > 17', otherwise: never}}}
";
    let mut texts = Vec::new();
    let (outcome, events, folder, _) = run_attended(steps, |event, handle| {
        let Event::PromptAsked { prompt } = event else { return };
        texts.push(prompt.text.clone());
        let answer = match &prompt.kind {
            PromptKind::Choice { .. } => Answer::Choice { key: "light".to_owned() },
            PromptKind::Number { minimum, maximum, .. } => {
                assert_eq!((*minimum, *maximum), (Some(6.0), Some(10.0)));
                Answer::Number { value: 8.75 }
            }
            other => panic!("{other:?} was not expected"),
        };
        handle.send(Command::Answer { prompt: prompt.id, answer, by: "ada".to_owned() });
    });
    assert_eq!((outcome, message_of(&events)), (RunOutcome::Passed, "all steps passed"));
    assert_eq!(texts, ["Which?", "How high, near 8?"]);
    assert_eq!(readings(&folder), [("twice".to_owned(), 17.5), ("half".to_owned(), 4.375)]);
}

#[test]
fn a_repetition_ends_when_its_condition_holds_and_says_which_turns_were_not_needed() {
    let steps = "
steps:
  - id: again
    do:
      repeat:
        times: 5
        until: count.n >= 2
        steps:
          - {id: count, do: {compute: {values: {n: again.turn}}}}
          - {id: odd, when: again.turn != 2, do: {compute: {values: {m: all.count.len()}}}}
";
    let (outcome, events, folder, _) = run_attended(steps, |_, _| {});
    assert_eq!(outcome, RunOutcome::Passed);
    assert_eq!(readings(&folder), [("n".to_owned(), 1.0), ("m".to_owned(), 1.0), ("n".to_owned(), 2.0)]);
    let not_needed = outcomes(&events).into_iter().filter(|(_, outcome)| *outcome == StepOutcome::NotNeeded);
    assert_eq!(not_needed.count(), 1 + 2 * 3);
}

#[test]
fn a_failed_check_that_is_left_out_still_fails_the_run_at_its_end() {
    let steps = "
steps:
  - {id: first, do: {check: {that: 1 > 2, otherwise: one is not more than two}}, on_error: skip}
  - {id: second, do: {compute: {values: {x: 1}}}}
";
    let (outcome, events, folder, _) = run_attended(steps, |_, _| {});
    assert_eq!((outcome, message_of(&events)), (RunOutcome::Failed, "one is not more than two"));
    assert_eq!(readings(&folder).len(), 1, "the run went on to its end");
}

#[test]
fn a_retry_decided_beforehand_is_tried_as_often_as_said_and_no_oftener() {
    let steps = "
steps:
  - {id: never, do: {check: {that: false, otherwise: never}}, on_error: retry, retries: 2}
";
    let (outcome, events, _, _) = run_attended(steps, |_, _| {});
    assert_eq!((outcome, message_of(&events)), (RunOutcome::Failed, "step `never`: never"));
    assert_eq!(outcomes(&events).len(), 3, "once, and two retries");
}

#[test]
fn a_prompt_that_nobody_answers_fails_at_its_time_limit() {
    let steps = "
steps:
  - {id: ready, do: {prompt: {text: Ready?}}, time_limit_s: 0.05, on_error: abort}
";
    let (outcome, events, _, _) = run_attended(steps, |_, _| {});
    assert_eq!(outcome, RunOutcome::Error);
    assert!(message_of(&events).contains("nobody answered within its time limit"), "{}", message_of(&events));
    assert!(events.iter().any(|event| matches!(event, Event::PromptWithdrawn { .. })));
}

#[test]
fn a_pause_before_the_next_step_lets_the_step_in_hand_end() {
    let steps = "
steps:
  - {id: first, do: {move: {robot: arm, by_deg: {waist: 1}}}}
  - {id: second, do: {move: {robot: arm, by_deg: {waist: 1}}}}
";
    let folder = folder();
    let cell = cell_with_steps(&folder, steps);
    let world = World::new(ZERO_ERROR_DEG);
    let mut run = request(&cell, &folder);
    run.unattended = false;
    let running = start_commanded(run, &world, |number, handle| {
        if number == 1 {
            handle.send(Command::Pause { when: PauseWhen::BeforeNextStep });
        }
    });
    let mut order = Vec::new();
    let (outcome, _) = watch(running, |event, handle| match event {
        Event::StepFinished { step, outcome, .. } => order.push(format!("{step} {outcome:?}")),
        Event::Paused { step, .. } => {
            order.push(format!("paused before {}", step.as_ref().expect("a step")));
            handle.send(Command::Resume);
        }
        _ => {}
    });
    assert_eq!(outcome, RunOutcome::Passed);
    assert_eq!(order, ["first Passed", "paused before second", "second Passed"]);
}

#[test]
fn an_interrupted_relative_move_ends_where_it_was_to_end_at_first() {
    let steps = "
steps:
  - {id: turn, do: {move: {robot: arm, by_deg: {waist: 10}}}}
";
    let folder = folder();
    let cell = cell_with_steps(&folder, steps);
    let world = World::new([0.0; 3]);
    let mut run = request(&cell, &folder);
    run.unattended = false;
    let running = start_commanded(run, &world, |number, handle| {
        if number <= 2 {
            handle.send(Command::Stop);
        }
    });
    let (outcome, _) = watch(running, |event, handle| {
        if matches!(event, Event::Paused { .. }) {
            handle.send(Command::Resume);
        }
    });
    assert_eq!(outcome, RunOutcome::Passed);
    assert_eq!(world.moves.load(Ordering::SeqCst), 3);
    assert!((world.truth_deg()[0] - 21.0).abs() < 1e-9, "{:?}", world.truth_deg());
}

#[test]
fn the_operator_jogs_within_limits_and_is_held_to_the_goal() {
    let steps = "
steps:
  - {id: place, do: {prompt: {text: There, jog_to: {robot: arm, within_deg: {waist: [12, 14]}}}}}
";
    let (mut stage, mut jogged_in, mut settled) = (0, None, Vec::new());
    let mut refused = Vec::new();
    let folder = folder();
    let cell = cell_with_steps(&folder, steps);
    let world = World::new([0.0; 3]);
    let mut run = request(&cell, &folder);
    run.unattended = false;
    let (outcome, _) = watch(start(run, &world), |event, handle| {
        let send_done =
            |prompt| handle.send(Command::Answer { prompt, answer: Answer::Done, by: "ada".to_owned() });
        match event {
            Event::PromptAsked { prompt } => {
                send_done(prompt.id);
            }
            Event::AnswerRefused { prompt, reason } => {
                refused.push(reason.clone());
                stage += 1;
                let jog = |joint: &str, by: f64| {
                    handle.send(Command::Jog { prompt: *prompt, joint: joint.to_owned(), by })
                };
                match stage {
                    1 => jog("wasit", 1.0),
                    2 => jog("waist", 500.0),
                    _ => jog("waist", 2.0),
                };
                jogged_in = (stage == 3).then_some(*prompt);
            }
            Event::Joints { moving: false, joints, .. } if joints[0].value > 12.5 => {
                if let Some(prompt) = jogged_in.take() {
                    settled.push(prompt);
                } else if let Some(prompt) = settled.pop() {
                    send_done(prompt);
                }
            }
            _ => {}
        }
    });
    assert_eq!(outcome, RunOutcome::Passed);
    assert!(
        refused[0].contains("waist is at 11.00 deg; it has to be between 12.00 and 14.00 deg"),
        "{refused:?}"
    );
    assert!(refused[1].contains("did you mean `waist`?"), "{refused:?}");
    assert!(refused[2].contains("waist would go to 511.000 deg"), "{refused:?}");
    assert!((world.truth_deg()[0] - 13.0).abs() < 1e-9);
}

#[test]
fn an_arm_that_only_its_pendant_gives_back_is_handed_over_on_request_and_not_moved_until_then() {
    let steps = "
steps:
  - {id: place, do: {prompt: {text: There, jog_to: {robot: arm}}}}
";
    let folder = folder();
    let cell = cell_with_steps(&folder, steps);
    let world = World::new([0.0; 3]);
    world.only_pendant_ends_jog.store(true, Ordering::SeqCst);
    let mut run = request(&cell, &folder);
    run.unattended = false;
    let mut reported = Vec::new();
    let mut last = None;
    let (outcome, _) = watch(start(run, &world), |event, handle| {
        let jog = |prompt| handle.send(Command::Jog { prompt, joint: "waist".to_owned(), by: 2.0 });
        let mut send_last = |command: Command| {
            handle.send(command.clone());
            last = Some(command);
        };
        match event {
            Event::PromptAsked { prompt } => {
                assert!(matches!(prompt.kind, PromptKind::JogTo { hand_over: true, .. }));
                // It moves from here before anybody has asked for the pendant.
                jog(prompt.id);
                send_last(Command::HandOver { prompt: prompt.id });
            }
            // Depending on which thread is quicker.
            Event::AnswerRefused { reason, .. } if reason.contains("still moving") => {
                handle.send(last.clone().expect("something was sent"));
            }
            Event::AnswerRefused { prompt, reason } => {
                reported.push(reason.clone());
                match reported.len() {
                    1 => {
                        jog(*prompt);
                    }
                    2 => *world.pendant.lock().expect("the pendant") = PendantHas::GivenItBack,
                    _ => {
                        jog(*prompt);
                        let answer = Answer::Done;
                        send_last(Command::Answer { prompt: *prompt, answer, by: "ada".to_owned() });
                    }
                }
            }
            _ => {}
        }
    });
    assert_eq!(outcome, RunOutcome::Passed);
    assert_eq!(
        reported,
        [
            "the pendant has the arm: only STOP on the pendant stops it, and gives it back",
            "arm: press STOP on the pendant",
            "the pendant has given the arm back",
        ]
    );
    assert_eq!(world.moves.load(Ordering::SeqCst), 2, "the jog under hand control moved nothing");
}

#[test]
fn once_its_zeros_are_known_no_part_of_the_arm_is_sent_through_the_table() {
    let folder = folder();
    let steps = "
steps:
  - {id: down, do: {move: {robot: arm, by_deg: {shoulder: -30}}}}
";
    let without_zeros = {
        let cell = cell_with_steps(&folder, steps);
        let world = World::new([0.0; 3]);
        let mut run = request(&cell, &folder);
        run.unattended = true;
        watch(start(run, &world), |_, _| {}).0
    };
    assert_eq!(without_zeros, RunOutcome::Passed, "where it is cannot be known: limits alone are watched");

    let initialized = tempfile::tempdir().expect("a directory");
    let whole = workcell("cell.yaml");
    assert_eq!(
        watch(start(request(&whole, &initialized), &World::new(ZERO_ERROR_DEG)), |_, _| {}).0,
        RunOutcome::Passed
    );
    let cell = cell_with_steps(&folder, steps);
    let world = World::new(ZERO_ERROR_DEG);
    let (outcome, events) = watch(start(request(&cell, &initialized), &world), |_, _| {});
    assert_eq!(outcome, RunOutcome::Error);
    let message = message_of(&events);
    assert!(
        message.contains("the end of link wrist_roll would come") && message.contains("past the table"),
        "{message}"
    );
    assert_eq!(world.moves.load(Ordering::SeqCst), 0);
}

#[test]
fn an_implausible_correction_is_an_error_and_is_not_applied() {
    let steps = "
steps:
  - {id: shift, do: {apply: {robot: arm, joint_zero: {waist: {shift_deg: 40, uncertainty_deg: 0.1, plausible_deg: 20}}}}, on_error: abort}
";
    let (outcome, events, folder, _) = run_attended(steps, |_, _| {});
    assert_eq!(outcome, RunOutcome::Error);
    assert!(
        message_of(&events).contains("more than the 20 deg that are plausible"),
        "{}",
        message_of(&events)
    );
    let record = Record::open(folder.path()).expect("the record");
    assert!(record.corrections_in_force("teachmover", "arm").expect("corrections").is_empty());
}

#[test]
fn a_rejected_correction_stays_a_proposal() {
    let steps = "
steps:
  - {id: shift, do: {apply: {robot: arm, joint_zero: {waist: {shift_deg: 4, uncertainty_deg: 0.1}}}}}
  - {id: expected, do: {check: {that: '!shift.applied', otherwise: never}}}
";
    let (outcome, _, folder, _) = run_attended(steps, |event, handle| {
        if let Event::PromptAsked { prompt } = event {
            let answer = Answer::Choice { key: "reject".to_owned() };
            handle.send(Command::Answer { prompt: prompt.id, answer, by: "ada".to_owned() });
        }
    });
    assert_eq!(outcome, RunOutcome::Passed);
    let record = Record::open(folder.path()).expect("the record");
    assert!(record.corrections_in_force("teachmover", "arm").expect("corrections").is_empty());
    assert_eq!(record.corrections_of_run(RunId(1)).expect("corrections").len(), 1);
}

#[test]
fn an_unattended_run_refuses_a_step_that_would_ask_what_to_do() {
    let folder = folder();
    let steps = "
steps:
  - {id: lower, do: {move: {robot: arm, by_deg: {waist: 1}}}, on_error: ask}
";
    let cell = cell_with_steps(&folder, steps);
    let world = World::new([0.0; 3]);
    let devices = Devices(Arc::clone(&world));
    let error = start_run(request(&cell, &folder), |_| Ok(Box::new(devices))).err().expect("refused");
    assert!(matches!(error, StartError::NeedsOperator(_)), "{error}");
    assert!(error.to_string().contains("step `lower` says `on_error: ask`"), "{error}");

    std::fs::write(folder.path().join("answers.yaml"), "answers: {}\non_error: {lower: abort}\n")
        .expect("written");
    let mut decided = request(&cell, &folder);
    let procedures: Vec<_> = cell.procedures.iter().map(AsRef::as_ref).collect();
    decided.answers =
        Some(load_answers(&folder.path().join("answers.yaml"), &procedures, &[]).expect("good answers"));
    assert_eq!(watch(start(decided, &world), |_, _| {}).0, RunOutcome::Passed);
}

/// A run whose arm was lost on its second move, and the request that resumes it.
fn lost_at_its_second_move(folder: &TempDir) -> (Arc<Workcell>, Arc<World>, RunRequest) {
    let steps = "
steps:
  - {id: first, do: {move: {robot: arm, by_deg: {waist: 1}}}}
  - {id: second, do: {move: {robot: arm, by_deg: {waist: 1}}}}
";
    let cell = cell_with_steps(folder, steps);
    let world = World::new([0.0; 3]);
    world.lose_arm_at_move.store(2, Ordering::SeqCst);
    let (outcome, _) = watch(start(request(&cell, folder), &world), |_, _| {});
    assert_eq!(outcome, RunOutcome::Error);
    let again = RunRequest { resume: Some(RunId(1)), ..request(&cell, folder) };
    (cell, world, again)
}

#[test]
fn a_resumed_run_asks_a_person_whether_the_arm_is_where_it_was_left() {
    let folder = folder();
    let (_cell, world, mut again) = lost_at_its_second_move(&folder);
    again.unattended = false;
    let mut asked = 0;
    let moves = world.moves.load(Ordering::SeqCst);
    let mut answer = operator(Decision::Abort);
    let (outcome, events) = watch(start(again, &world), |event, handle| {
        if let Event::PromptAsked { prompt } = event {
            assert!(matches!(prompt.kind, PromptKind::ConfirmPose { .. }), "{:?}", prompt.kind);
            assert_eq!(world.moves.load(Ordering::SeqCst), moves, "nothing moves before somebody has looked");
            asked += 1;
        }
        answer(event, handle);
    });
    assert_eq!((outcome, message_of(&events)), (RunOutcome::Passed, "all steps passed"));
    assert_eq!(asked, 1);
    assert!((world.truth_deg()[0] - 13.0).abs() < 1e-9, "{:?}", world.truth_deg());
}

#[test]
fn an_unattended_resume_with_an_arm_that_was_moved_needs_an_operator() {
    let folder = folder();
    let (_cell, _world, again) = lost_at_its_second_move(&folder);
    let another = World::new([0.0, 3.0, 0.0]);
    another.is_new.store(false, Ordering::SeqCst);
    let (outcome, events) = watch(start(again, &another), |_, _| {});
    assert_eq!(outcome, RunOutcome::NeedsOperator);
    assert!(
        message_of(&events).contains("arm reports its shoulder at 38.000; the run left it at 41.000"),
        "{}",
        message_of(&events)
    );
    assert_eq!(another.moves.load(Ordering::SeqCst), 0);
}

const DECLARE: &str = "
steps:
  - {id: there, do: {move: {robot: arm, to_deg: {waist: 12}}}}
  - {id: declare, do: {declare: {robot: arm, as_deg: {waist: 10}, uncertainty_deg: {waist: 0.1}, plausible: 5}}}
  - {id: holds, do: {check: {that: abs(declare.joints.waist_deg - 10) < 1e-9 && declare.declared, otherwise: no}}}
";

#[test]
fn a_controller_takes_over_what_is_declared_once_that_is_accepted() {
    for (keys, outcome) in [("accept", RunOutcome::Passed), ("reject", RunOutcome::Failed)] {
        let folder = folder();
        let cell = cell_with_steps(&folder, DECLARE);
        let mut run = request(&cell, &folder);
        run.unattended = false;
        let mut asked = String::new();
        let (ended, events) = watch(start(run, &World::new([0.0; 3])), |event, handle| {
            if let Event::PromptAsked { prompt } = event {
                let answer = match &prompt.kind {
                    PromptKind::Decision { .. } => Answer::Decision { decision: Decision::Abort },
                    _ => {
                        asked = prompt.text.clone();
                        Answer::Choice { key: keys.to_owned() }
                    }
                };
                handle.send(Command::Answer { prompt: prompt.id, answer, by: "test".to_owned() });
            }
        });
        assert_eq!(ended, outcome);
        assert!(asked.contains("waist: reads 12.000, shall read 10.000 deg (± 0.10 deg)"), "{asked}");
        let applied = events.iter().any(|event| matches!(event, Event::CorrectionApplied { .. }));
        assert_eq!(applied, keys == "accept");
    }
}

#[test]
fn a_declaration_that_is_not_plausible_or_not_taken_over_is_an_error() {
    for (steps, deaf, message) in [
        (
            DECLARE.replace("plausible: 5", "plausible: 1"),
            false,
            "a shift of more than the 1 deg that are plausible",
        ),
        (
            DECLARE.to_owned(),
            true,
            "waist was to read 10.000 deg and reads 12.000 deg: the controller did not take the pose over",
        ),
    ] {
        let folder = folder();
        let cell = cell_with_steps(&folder, &steps.replace("plausible", "ask: false, plausible"));
        let world = World::new([0.0; 3]);
        world.keeps_its_zeros.store(deaf, Ordering::SeqCst);
        let (ended, events) = watch(start(request(&cell, &folder), &world), |_, _| {});
        assert_eq!(ended, RunOutcome::Error);
        let is_reported = events
            .iter()
            .any(|event| matches!(event, Event::RunEnded { message: end, .. } if end.contains(message)));
        assert!(is_reported, "{message}: {:?}", events.last());
    }
}

#[test]
fn a_drawing_of_the_arm_is_under_a_prompt_that_asks_for_one() {
    let steps = "
steps:
  - {id: look, do: {prompt: {text: Look at the arm., draw: arm}}}
";
    let folder = folder();
    let cell = cell_with_steps(&folder, steps);
    let mut run = request(&cell, &folder);
    run.unattended = false;
    let mut asked = String::new();
    let (ended, _) = watch(start(run, &World::new([0.0; 3])), |event, handle| {
        if let Event::PromptAsked { prompt } = event {
            asked = prompt.text.clone();
            handle.send(Command::Answer { prompt: prompt.id, answer: Answer::Done, by: "test".to_owned() });
        }
    });
    assert_eq!(ended, RunOutcome::Passed);
    assert!(asked.starts_with("Look at the arm.") && asked.contains("from the side"), "{asked}");
}

#[test]
fn anyone_who_decides_about_a_failed_step_may_take_longer_than_the_step_had() {
    const TIME_LIMIT_S: f64 = 0.05;
    let steps = format!(
        "
steps:
  - {{id: ready, do: {{prompt: {{text: Ready?}}}}, time_limit_s: {TIME_LIMIT_S}}}
  - {{id: after, do: {{compute: {{values: {{x: 1}}}}}}}}
"
    );
    let (outcome, events, folder, _) = run_attended(&steps, |event, handle| {
        let Event::PromptAsked { prompt } = event else { return };
        if let PromptKind::Decision { .. } = &prompt.kind {
            // Longer than the step had, however long that takes here.
            let asked = std::time::Instant::now();
            while asked.elapsed().as_secs_f64() <= 2.0 * TIME_LIMIT_S {
                std::thread::yield_now();
            }
            let answer = Answer::Decision { decision: Decision::Skip };
            handle.send(Command::Answer { prompt: prompt.id, answer, by: "ada".to_owned() });
        }
    });
    assert_eq!(readings(&folder).len(), 1, "the run went on: {outcome:?} {}", message_of(&events));
}
