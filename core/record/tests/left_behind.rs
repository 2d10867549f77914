//! What runs leave behind for later ones: poses, logs, files, losses of zeros, corrected sites, a copy.

#![expect(clippy::expect_used, reason = "a failed expectation is how a test fails")]

use plumb_record::{
    AppliedCorrection, CorrectionKey, LoadedFile, NewCorrection, NewQueueEntry, NewRun, PlannedRow, Record,
    RecordError, RunEnd, RunId, RunState, StepEnd,
};
use serde_json::{Value, json};

const CELL: &str = "bench";

fn record() -> (tempfile::TempDir, Record) {
    let directory = tempfile::tempdir().expect("a directory");
    let record = Record::open(directory.path()).expect("a record");
    (directory, record)
}

fn run_of(record: &mut Record, cell: &str) -> RunId {
    record.start_run(&NewRun { cell: cell.into(), ..NewRun::default() }).expect("a run")
}

/// Puts a zero of a joint in force, as found by that run; its revision.
fn apply(record: &mut Record, run: RunId, cell: &str, site: &str, new: f64) -> i64 {
    let key = CorrectionKey { device: "arm".into(), quantity: "joint_zero".into(), site: site.into() };
    let one = NewCorrection { key, old: 0.0, new, uncertainty: None, budget: None, unit: "deg".into() };
    let numbers = record.propose_corrections(run, "found", cell, &[one]).expect("proposed");
    record.apply_corrections(cell, "arm", &numbers, "test").expect("applied")
}

fn waist_in_force(record: &Record) -> AppliedCorrection {
    let mut all = record.corrections_in_force(CELL, "arm").expect("read");
    all.retain(|one| one.key.site == "waist");
    all.pop().expect("a waist")
}

#[test]
fn a_run_that_is_resumed_runs_again_and_keeps_its_world() {
    let (_directory, mut record) = record();
    let run = run_of(&mut record, CELL);
    record.set_world(run, Some("/tmp/world")).expect("noted");
    record.end_run(run, RunEnd::Error, "lost").expect("ended");
    record.reopen_run(run).expect("resumed");
    let found = record.run(run).expect("the run");
    assert_eq!((found.state, found.ended, found.message), (RunState::Running, None, None));
    assert_eq!(found.world.as_deref(), Some("/tmp/world"));
    record.set_world(run, None).expect("noted");
    assert_eq!(record.run(run).expect("the run").world, None);
}

#[test]
fn every_end_of_a_run_is_read_back_as_it_was_written() {
    let (_directory, mut record) = record();
    for end in [RunEnd::Passed, RunEnd::Failed, RunEnd::Error, RunEnd::Aborted, RunEnd::NeedsOperator] {
        let run = run_of(&mut record, CELL);
        record.end_run(run, end, "said").expect("ended");
        let found = record.run(run).expect("the run");
        assert_eq!((found.state, found.message.as_deref()), (RunState::Ended(end), Some("said")));
    }
}

#[test]
fn the_last_pose_of_each_robot_is_kept_and_that_of_the_last_run_found() {
    let (_directory, mut record) = record();
    let (first, second) = (run_of(&mut record, CELL), run_of(&mut record, CELL));
    record.note_pose(first, "arm", &json!([1])).expect("noted");
    record.note_pose(first, "arm", &json!([2])).expect("noted");
    record.note_pose(first, "lift", &json!([3])).expect("noted");
    let poses = record.poses(first).expect("read");
    let listed: Vec<_> = poses.iter().map(|pose| (pose.device.as_str(), &pose.joints)).collect();
    assert_eq!(listed, [("arm", &json!([2])), ("lift", &json!([3]))]);
    assert!(record.poses(second).expect("read").is_empty());
    let last = record.last_pose(CELL, "arm").expect("read").expect("a pose");
    assert_eq!((last.run, last.joints, last.intent), (first, json!([2]), None));
    assert_eq!(record.last_pose("elsewhere", "arm").expect("read"), None);
}

/// The intent that goes with the last pose after a step ended so, or was cut off.
fn intent_after(outcome: Option<&str>) -> Option<Value> {
    let (_directory, mut record) = record();
    let run = run_of(&mut record, CELL);
    record.note_pose(run, "arm", &json!([0])).expect("noted");
    let (step, _) = record.start_step(run, "out").expect("begun");
    record.note_intent(step, &json!({"robot": "arm"})).expect("noted");
    if let Some(outcome) = outcome {
        record.end_step(step, &StepEnd { outcome, message: "", result: &json!(null) }).expect("ended");
    }
    record.last_pose(CELL, "arm").expect("read").expect("a pose").intent
}

#[test]
fn a_robot_may_be_on_its_way_unless_the_step_that_moved_it_passed() {
    assert_eq!(intent_after(None), Some(json!({"robot": "arm"})));
    assert_eq!(intent_after(Some("error")), Some(json!({"robot": "arm"})));
    assert_eq!(intent_after(Some("passed")), None);
}

#[test]
fn a_zero_holds_again_once_a_run_has_found_it_after_the_loss() {
    let (_directory, mut record) = record();
    let run = run_of(&mut record, CELL);
    assert_eq!(record.zero_loss(CELL, "arm").expect("read"), None);
    let first = apply(&mut record, run, CELL, "waist", 1.0);
    record.note_zero_loss(CELL, "arm", run, "switched off").expect("noted");
    let loss = record.zero_loss(CELL, "arm").expect("read").expect("a loss");
    assert_eq!((loss.run, loss.revision, loss.reason.as_str()), (run, first, "switched off"));
    assert_eq!(record.zero_loss(CELL, "lift").expect("read"), None);
    assert!(!record.was_found_since(CELL, &waist_in_force(&record), &loss).expect("read"));
    apply(&mut record, run, CELL, "waist", 2.0);
    assert!(record.was_found_since(CELL, &waist_in_force(&record), &loss).expect("read"));
}

#[test]
fn a_zero_brought_back_holds_only_where_it_was_found_after_the_loss() {
    let (_directory, mut record) = record();
    let run = run_of(&mut record, CELL);
    let before = apply(&mut record, run, CELL, "waist", 1.0);
    record.note_zero_loss(CELL, "arm", run, "switched off").expect("noted");
    let loss = record.zero_loss(CELL, "arm").expect("read").expect("a loss");
    let after = apply(&mut record, run, CELL, "waist", 2.0);
    apply(&mut record, run, CELL, "waist", 3.0);
    record.roll_back(CELL, "arm", after, "worse").expect("back to the second");
    let back = waist_in_force(&record);
    assert_eq!((back.value, back.run), (2.0, None));
    assert!(record.was_found_since(CELL, &back, &loss).expect("read"), "a run found it since");
    record.roll_back(CELL, "arm", before, "worse still").expect("back to the first");
    let back = waist_in_force(&record);
    assert_eq!(back.value, 1.0);
    assert!(!record.was_found_since(CELL, &back, &loss).expect("read"), "that was before the loss");
}

#[test]
fn a_log_line_is_read_back_with_who_said_it_and_where() {
    let (_directory, mut record) = record();
    let (run, other) = (run_of(&mut record, CELL), run_of(&mut record, CELL));
    record.note_log(run, "warning", "arm", Some("lower"), "slow").expect("noted");
    record.note_log(run, "info", "engine", None, "done").expect("noted");
    let log = record.log(run).expect("read");
    let listed: Vec<_> = log
        .iter()
        .map(|line| (line.level.as_str(), line.source.as_str(), line.step.as_deref(), line.message.as_str()))
        .collect();
    assert_eq!(listed, [("warning", "arm", Some("lower"), "slow"), ("info", "engine", None, "done")]);
    assert!(record.log(other).expect("read").is_empty());
}

fn file(role: &str, path: &str, sha256: &str) -> LoadedFile {
    LoadedFile { role: role.into(), path: path.into(), sha256: sha256.into(), content: None }
}

/// A run with these files; one that was `planned` has started its devices.
fn run_with(record: &mut Record, planned: bool, files: &[LoadedFile]) -> RunId {
    let run = NewRun { cell: CELL.into(), loaded: files.to_vec(), ..NewRun::default() };
    let run = record.start_run(&run).expect("a run");
    if planned {
        let row = PlannedRow {
            step: "a".into(),
            title: "A".into(),
            kind: "check".into(),
            depth: 0,
            estimate_s: None,
        };
        record.note_plan(run, &[row]).expect("a plan");
    }
    run
}

#[test]
fn a_plugin_that_differs_from_the_one_run_last_is_named_with_both_hashes() {
    let (_directory, mut record) = record();
    let there = [
        file("plugin", "/old/arm/plugin.yaml", "m1"),
        file("plugin", "/old/arm/libarm.so", "a1"),
        file("plugin", "/old/eye/driver.py", "d1"),
        file("plugin", "/old/leg/driver.py", "g1"),
        file("cell", "/old/cell.yaml", "c1"),
    ];
    let first = run_with(&mut record, true, &there);
    assert_eq!(record.loaded(first).expect("read"), there);
    // A run that never started its devices has run with nothing.
    run_with(&mut record, false, &[file("plugin", "/old/arm/libarm.so", "a9")]);
    let now = [
        file("plugin", "/new/arm/plugin.yaml", "m2"),
        file("plugin", "/new/arm/libarm.so", "a2"),
        file("plugin", "/new/eye/driver.py", "d2"),
        file("plugin", "/new/leg/driver.py", "g1"),
        file("plugin", "/new/fresh/libfresh.so", "f1"),
        file("cell", "/new/cell.yaml", "c2"),
    ];
    let changed = record.changed_libraries(CELL, &now).expect("looked");
    let listed: Vec<_> = changed
        .iter()
        .map(|one| (one.path.as_str(), one.before.as_str(), one.sha256.as_str(), one.run))
        .collect();
    assert_eq!(
        listed,
        [("/new/arm/libarm.so", "a1", "a2", first), ("/new/eye/driver.py", "d1", "d2", first)]
    );
    assert!(record.changed_libraries(CELL, &there).expect("looked").is_empty());
    assert!(record.changed_libraries("elsewhere", &now).expect("looked").is_empty(), "it ran nothing yet");
}

#[test]
fn what_was_corrected_and_where_is_listed_once_each() {
    let (_directory, mut record) = record();
    assert!(record.corrected_cells().expect("read").is_empty());
    assert!(record.corrected_sites().expect("read").is_empty());
    let run = run_of(&mut record, CELL);
    for (cell, site) in [(CELL, "waist"), (CELL, "waist"), (CELL, "elbow"), ("attic", "waist")] {
        apply(&mut record, run, cell, site, 1.0);
    }
    assert_eq!(record.corrected_cells().expect("read"), ["attic", CELL]);
    assert_eq!(record.corrected_sites().expect("read"), ["arm.elbow", "arm.waist"]);
}

#[test]
fn a_queued_entry_waits_until_it_runs_or_is_taken_away() {
    let (_directory, mut record) = record();
    let entry = NewQueueEntry {
        cell: CELL.into(),
        cell_file: "/cell.yaml".into(),
        procedure: "a".into(),
        ..NewQueueEntry::default()
    };
    let waits = |record: &Record| -> Vec<bool> {
        record.queue(None).expect("read").iter().map(|entry| entry.is_waiting()).collect()
    };
    let first = record.add_to_queue(&entry).expect("queued");
    assert_eq!(waits(&record), [true]);
    let run = NewRun { cell: CELL.into(), queue_entry: Some(first), ..NewRun::default() };
    record.start_run(&run).expect("a run");
    assert!(!record.queue_entry(first).expect("read").is_waiting(), "its run has begun");
    let second = record.add_to_queue(&entry).expect("queued");
    record.remove_from_queue(second).expect("taken away");
    assert!(!record.queue_entry(second).expect("read").is_waiting(), "it was taken away");
}

#[test]
fn a_backup_is_a_whole_record_and_overwrites_nothing() {
    let (directory, mut record) = record();
    let run = run_of(&mut record, CELL);
    let folder = directory.path().join("copy");
    std::fs::create_dir(&folder).expect("a folder");
    let to = folder.join("plumb.sqlite3");
    record.back_up(&to).expect("copied");
    let copy = Record::open(&folder).expect("opened");
    assert_eq!(copy.run(run).expect("the run").cell, CELL);
    let again = record.back_up(&to).expect_err("it is there");
    assert!(matches!(&again, RecordError::BackupExists { path } if *path == to), "{again}");
}

#[test]
fn the_outbox_counts_its_rows_from_the_first() {
    let (_directory, mut record) = record();
    assert_eq!(record.newest_outbox_row().expect("read"), 0);
    run_of(&mut record, CELL);
    let newest = record.newest_outbox_row().expect("read");
    let row = record.outbox_row(newest).expect("read").expect("it is there");
    assert_eq!(row.sequence, newest);
    assert!(newest > 0 && record.outbox_row(newest + 1).expect("read").is_none());
}
