//! The engine, carrying out the initializations that come with the program, with an arm in memory.

#![expect(clippy::expect_used, clippy::panic, reason = "a failed expectation is how a test fails")]

mod support;

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::Ordering;

use plumb_cell::command::Command;
use plumb_cell::engine::{RunRequest, StartError, start_run};
use plumb_cell::event::{DeviceState, Event, RunOutcome, StepOutcome};
use plumb_cell::prompt::{Answer, Decision, PromptKind};
use plumb_record::{Record, RunId};
use support::running::{
    ZERO_ERROR_DEG, message_of, operator, request, start, start_commanded, watch, workcell,
};
use support::{Devices, World};
use tempfile::TempDir;

fn zeros_in_force(record: &TempDir, cell: &str) -> BTreeMap<String, f64> {
    let record = Record::open(record.path()).expect("the record");
    let corrections = record.corrections_in_force(cell, "arm").expect("the corrections");
    corrections.into_iter().map(|one| (one.key.site, one.value)).collect()
}

fn assert_zeros_found(record: &TempDir) {
    let zeros = zeros_in_force(record, "teachmover");
    for (joint, truth) in ["waist", "shoulder", "elbow"].iter().zip(ZERO_ERROR_DEG) {
        let found = zeros.get(*joint).copied().unwrap_or(f64::NAN);
        assert!((found - truth).abs() < 1e-3, "{joint}: found {found}, true {truth}");
    }
}

/// A record of its own, and a run of the cell that somebody watches.
fn attended() -> (TempDir, RunRequest) {
    let record = tempfile::tempdir().expect("a directory");
    let run = RunRequest { unattended: false, ..request(&workcell("cell.yaml"), &record) };
    (record, run)
}

#[test]
fn an_unattended_initialization_finds_the_zeros_of_all_three_joints() {
    let (cell, record) = (workcell("cell.yaml"), tempfile::tempdir().expect("a directory"));
    let world = World::new(ZERO_ERROR_DEG);
    let (outcome, events) = watch(start(request(&cell, &record), &world), |_, _| {});
    assert_eq!((outcome, message_of(&events)), (RunOutcome::Passed, "all steps passed"));
    assert_zeros_found(&record);
    let triggers = Record::open(record.path()).expect("the record").triggers(RunId(1)).expect("the triggers");
    assert_eq!(
        triggers.iter().filter(|trigger| trigger.fine).count(),
        2 + 2 * 4,
        "two for the waist, two in each turn"
    );
}

#[test]
fn a_second_initialization_starts_from_the_zeros_of_the_first() {
    let (cell, record) = (workcell("cell.yaml"), tempfile::tempdir().expect("a directory"));
    for _ in 0..2 {
        let (outcome, events) = watch(start(request(&cell, &record), &World::new(ZERO_ERROR_DEG)), |_, _| {});
        assert_eq!((outcome, message_of(&events)), (RunOutcome::Passed, "all steps passed"));
    }
    assert_zeros_found(&record);
    let corrections =
        Record::open(record.path()).expect("the record").corrections_of_run(RunId(2)).expect("corrections");
    assert!(corrections.iter().all(|one| (one.new - one.old).abs() < 1e-3), "{corrections:?}");
}

#[test]
fn the_cycles_converge_as_the_papers_table_says() {
    let (cell, record) = (workcell("cell-paper.yaml"), tempfile::tempdir().expect("a directory"));
    let mut paper = request(&cell, &record);
    paper.answers = None;
    let (outcome, events) = watch(start(paper, &World::new([0.0; 3])), |_, _| {});
    assert_eq!((outcome, message_of(&events)), (RunOutcome::Passed, "all steps passed"));
    let readings = Record::open(record.path()).expect("the record").readings(RunId(1)).expect("the readings");
    let errors: Vec<f64> = readings.iter().filter(|r| r.name == "error").map(|r| r.value).collect();
    // Yang & Siegel, table 2-1, to its last digit; the fifth to seventh as recomputed (the print lost their exponents).
    let table = [-10138.0, 178.2, -5.635, 0.1766, -5.535e-3, 1.735e-4, -5.437e-6];
    let digits = [1.0, 0.1, 0.001, 0.0001, 1e-6, 1e-7, 1e-7];
    assert_eq!(errors.len(), table.len());
    for ((found, printed), digit) in errors.iter().zip(table).zip(digits) {
        assert!((found - printed).abs() <= digit, "found {found}, printed {printed}");
    }
}

#[test]
fn a_start_outside_the_tolerance_is_refused_with_the_reason_before_anything_is_searched() {
    let (cell, record) = (workcell("cell.yaml"), tempfile::tempdir().expect("a directory"));
    let mut run = request(&cell, &record);
    run.procedure = cell.procedure("shoulder-elbow-initialization").cloned().expect("the procedure");
    let world = World::new([0.0, 0.0, 10.0]);
    // The drive says -88; the zero in force makes it -70.
    let mut writer = Record::open(record.path()).expect("the record");
    let earlier = writer
        .start_run(&plumb_record::NewRun { cell: "teachmover".into(), ..Default::default() })
        .expect("a run");
    let key = plumb_record::CorrectionKey {
        device: "arm".into(),
        quantity: "joint_zero".into(),
        site: "elbow".into(),
    };
    let zero = plumb_record::NewCorrection {
        key,
        old: 0.0,
        new: 18.0,
        uncertainty: Some(0.1),
        budget: None,
        unit: "deg".into(),
    };
    let numbers = writer.propose_corrections(earlier, "test", "teachmover", &[zero]).expect("proposed");
    writer.apply_corrections("teachmover", "arm", &numbers, "test").expect("applied");
    let (outcome, events) = watch(start(run, &world), |_, _| {});
    assert_eq!(outcome, RunOutcome::Failed);
    let message = message_of(&events);
    assert!(message.contains("The forearm is at 290.00 degrees"), "{message}");
    assert!(message.contains("270 +- 17.25 degrees"), "{message}");
    assert_eq!(world.moves.load(Ordering::SeqCst), 0);
}

#[test]
fn an_unattended_run_without_an_answer_it_needs_does_not_start() {
    let (cell, record) = (workcell("cell.yaml"), tempfile::tempdir().expect("a directory"));
    let mut run = request(&cell, &record);
    if let Some(answers) = &mut run.answers {
        answers.entries.retain(|entry| entry.step != "hand");
    }
    let world = World::new(ZERO_ERROR_DEG);
    let devices = Devices(Arc::clone(&world));
    let error = start_run(run, |_| Ok(Box::new(devices))).err().expect("refused");
    assert!(matches!(error, StartError::NeedsOperator(_)), "{error}");
    assert!(error.to_string().contains("`hand`"), "{error}");
    assert_eq!(world.connections.load(Ordering::SeqCst), 0);
}

#[test]
fn a_robot_lost_in_mid_move_stops_the_run_keeps_all_and_a_retry_goes_on_from_where_the_arm_is() {
    for lost_at in [1, 12, 40, 90, 140] {
        let (cell, record) = (workcell("cell.yaml"), tempfile::tempdir().expect("a directory"));
        let world = World::new(ZERO_ERROR_DEG);
        world.lose_arm_at_move.store(lost_at, Ordering::SeqCst);
        let mut run = request(&cell, &record);
        run.unattended = false;
        let (outcome, events) = watch(start(run, &world), operator(Decision::Retry));
        assert_eq!(
            (outcome, message_of(&events)),
            (RunOutcome::Passed, "all steps passed"),
            "lost at move {lost_at}"
        );
        assert_zeros_found(&record);
        assert_eq!(
            world.connections.load(Ordering::SeqCst),
            3,
            "the arm was started a second time, nothing else was"
        );
        let asked = events.iter().find_map(|event| match event {
            Event::PromptAsked { prompt } => match &prompt.kind {
                PromptKind::Decision { error, .. } => Some(error.clone()),
                _ => None,
            },
            _ => None,
        });
        assert_eq!(asked.as_deref(), Some("arm is lost: the host of arm was ended by SIGKILL"));
        let interruptions =
            Record::open(record.path()).expect("the record").interruptions(RunId(1)).expect("interruptions");
        assert!(interruptions.iter().any(|one| one.kind == "device_lost"), "{interruptions:?}");
        // Connected again it is a device like the others: it is put away at the end.
        let last = events.iter().rev().find_map(|event| match event {
            Event::Device { device, state, .. } if device == "arm" => Some(*state),
            _ => None,
        });
        assert_eq!(last, Some(DeviceState::Finalized), "lost at move {lost_at}");
    }
}

#[test]
fn an_unattended_run_that_loses_its_robot_ends_with_an_error_and_can_be_resumed() {
    let (cell, record) = (workcell("cell.yaml"), tempfile::tempdir().expect("a directory"));
    let world = World::new(ZERO_ERROR_DEG);
    world.lose_arm_at_move.store(60, Ordering::SeqCst);
    let (outcome, events) = watch(start(request(&cell, &record), &world), |_, _| {});
    assert_eq!(outcome, RunOutcome::Error);
    assert!(
        message_of(&events).contains("arm is lost") && message_of(&events).contains("--resume 1"),
        "{}",
        message_of(&events)
    );
    let mut again = request(&cell, &record);
    again.resume = Some(RunId(1));
    let (outcome, events) = watch(start(again, &world), |_, _| {});
    assert_eq!((outcome, message_of(&events)), (RunOutcome::Passed, "all steps passed"));
    assert_zeros_found(&record);
    // What the steps that were done had found is shown again, once each.
    let waist = |event: &&Event| matches!(event, Event::CorrectionApplied { correction, .. } if correction.site == "waist");
    assert_eq!(events.iter().filter(waist).count(), 1);
    let shown =
        |event: &&Event| matches!(event, Event::TriggerFound { step, .. } if step.0.starts_with("waist."));
    assert_eq!(events.iter().filter(shown).count(), 2);
    let stored = Record::open(record.path()).expect("the record");
    let answered = stored.prompts(RunId(1)).expect("the prompts").iter().filter(|p| p.step == "hand").count();
    assert_eq!(answered, 1, "what was answered is not asked again");
}

/// Moves of an undisturbed initialization.
fn moves_of_a_run() -> usize {
    let (cell, record) = (workcell("cell.yaml"), tempfile::tempdir().expect("a directory"));
    let world = World::new(ZERO_ERROR_DEG);
    watch(start(request(&cell, &record), &world), |_, _| {});
    world.moves.load(Ordering::SeqCst)
}

#[test]
fn a_stop_at_any_move_and_a_resume_lead_to_the_same_zeros() {
    let moves = moves_of_a_run();
    for stop_at in (1..=moves).step_by(13) {
        let (cell, record) = (workcell("cell.yaml"), tempfile::tempdir().expect("a directory"));
        let world = World::new(ZERO_ERROR_DEG);
        let mut run = request(&cell, &record);
        run.unattended = false;
        let running = start_commanded(run, &world, move |number, handle| {
            if number == stop_at {
                handle.send(Command::Stop);
            }
        });
        let mut answer = operator(Decision::Abort);
        let mut moves_while_paused = None;
        let (outcome, events) = watch(running, |event, handle| {
            answer(event, handle);
            if matches!(event, Event::Paused { .. }) {
                moves_while_paused = Some(world.moves.load(Ordering::SeqCst));
                handle.send(Command::Resume);
            }
        });
        assert_eq!(
            (outcome, message_of(&events)),
            (RunOutcome::Passed, "all steps passed"),
            "stopped at move {stop_at}"
        );
        assert_eq!(moves_while_paused, Some(stop_at), "nothing moved between the stop and the resume");
        assert!(events.iter().any(|event| matches!(event, Event::Stopped { .. })));
        assert_zeros_found(&record);
    }
}

#[test]
fn an_aborted_run_says_so_and_applies_nothing() {
    let (record, run) = attended();
    let mut answer = operator(Decision::Abort);
    let (outcome, events) = watch(start(run, &World::new(ZERO_ERROR_DEG)), |event, handle| {
        if matches!(event, Event::TriggerFound { .. }) {
            handle.send(Command::Abort);
        }
        answer(event, handle);
    });
    assert_eq!(outcome, RunOutcome::Aborted);
    assert!(message_of(&events).contains("aborted by the operator"), "{}", message_of(&events));
    assert!(zeros_in_force(&record, "teachmover").is_empty());
}

#[test]
fn where_the_arm_rests_after_an_abort_in_mid_move_is_written_down() {
    let (record, run) = attended();
    let world = World::new(ZERO_ERROR_DEG);
    let running = start_commanded(run, &world, |number, handle| {
        if number == 30 {
            handle.send(Command::Abort);
        }
    });
    let (outcome, _) = watch(running, operator(Decision::Abort));
    assert_eq!(outcome, RunOutcome::Aborted);
    // The next run compares where it came to rest with what the drive reads then.
    let poses = Record::open(record.path()).expect("the record").poses(RunId(1)).expect("the poses");
    let noted: Vec<f64> = poses
        .iter()
        .flat_map(|pose| pose.joints.as_array().expect("joints"))
        .filter_map(|joint| joint["drive"].as_f64())
        .collect();
    let state = world.state();
    let rests = state.joints.as_slice().iter().zip(&noted);
    assert!(
        noted.len() >= 3 && rests.take(3).all(|(rests, noted)| (rests.to_degrees() - noted).abs() < 1e-9),
        "{noted:?}"
    );
}

#[test]
fn a_run_finished_early_passes_with_what_it_has() {
    let (record, run) = attended();
    let mut answer = operator(Decision::Abort);
    let (outcome, _) = watch(start(run, &World::new(ZERO_ERROR_DEG)), |event, handle| {
        if matches!(event, Event::CorrectionApplied { .. }) {
            handle.send(Command::Finish);
        }
        answer(event, handle);
    });
    assert_eq!(outcome, RunOutcome::Passed);
    assert_eq!(zeros_in_force(&record, "teachmover").keys().collect::<Vec<_>>(), ["waist"]);
}

#[test]
fn a_wrong_answer_is_refused_with_the_reason_and_the_first_right_one_is_kept() {
    let (record, run) = attended();
    let mut answer = operator(Decision::Abort);
    let mut reasons = Vec::new();
    let (outcome, _) = watch(start(run, &World::new(ZERO_ERROR_DEG)), |event, handle| {
        if let Event::PromptAsked { prompt } = event {
            let wrong = Answer::Confirmed;
            handle.send(Command::Answer { prompt: prompt.id, answer: wrong, by: "bob".to_owned() });
        }
        if let Event::AnswerRefused { reason, .. } = event {
            reasons.push(reason.clone());
        }
        answer(event, handle);
    });
    assert_eq!(outcome, RunOutcome::Passed);
    assert!(
        reasons.iter().all(|reason| reason.contains("another kind of answer")) && !reasons.is_empty(),
        "{reasons:?}"
    );
    let prompts = Record::open(record.path()).expect("the record").prompts(RunId(1)).expect("the prompts");
    assert!(prompts.iter().all(|prompt| prompt.answer.as_ref().is_some_and(|answer| answer.by == "ada")));
}

#[test]
fn two_programs_cannot_run_one_cell() {
    let (record, run) = attended();
    let world = World::new(ZERO_ERROR_DEG);
    let running = start(run, &world);
    let second = Devices(Arc::clone(&world));
    let error = start_run(request(&workcell("cell.yaml"), &record), |_| Ok(Box::new(second)))
        .err()
        .expect("refused")
        .to_string();
    assert!(error.contains("already run by another plumb"), "{error}");
    running.handle.send(Command::Abort);
    watch(running, |_, _| {});
}

#[test]
fn every_step_of_the_plan_is_known_beforehand_and_begins_and_ends() {
    let (cell, record) = (workcell("cell.yaml"), tempfile::tempdir().expect("a directory"));
    let (_, events) = watch(start(request(&cell, &record), &World::new(ZERO_ERROR_DEG)), |_, _| {});
    let planned: Vec<_> = events
        .iter()
        .find_map(|event| match event {
            Event::Planned { steps, .. } => Some(steps.iter().map(|step| step.step.clone()).collect()),
            _ => None,
        })
        .expect("a plan");
    let finished: Vec<_> = events
        .iter()
        .filter_map(|event| match event {
            Event::StepFinished { step, outcome, .. } => Some((step.clone(), *outcome)),
            _ => None,
        })
        .collect();
    for step in &planned {
        assert!(
            finished.iter().any(|(finished, _)| finished == step),
            "{step} was planned and never finished"
        );
    }
    assert_eq!(finished.len(), planned.len());
    let not_needed: Vec<_> =
        finished.iter().filter(|(_, outcome)| *outcome == StepOutcome::NotNeeded).collect();
    assert_eq!(not_needed.len(), 1, "only the last back rotation is not needed: {not_needed:?}");
}
