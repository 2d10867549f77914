//! Corrections: proposed, put in force together or not at all, and brought back.

#![expect(clippy::expect_used, reason = "a failed expectation is how a test fails")]

use plumb_record::{
    Budget, CONTROLLER_ZERO, CorrectionKey, NewCorrection, NewRun, Record, RunId, StepEnd, StoredCorrection,
};
use serde_json::json;

const CELL: &str = "teachmover";

fn record() -> (tempfile::TempDir, Record, RunId) {
    let directory = tempfile::tempdir().expect("a directory");
    let mut record = Record::open(directory.path()).expect("a record");
    let run = record.start_run(&NewRun { cell: CELL.into(), ..NewRun::default() }).expect("a run");
    (directory, record, run)
}

fn correction(quantity: &str, site: &str, old: f64, new: f64) -> NewCorrection {
    let key = CorrectionKey { device: "arm".into(), quantity: quantity.into(), site: site.into() };
    let budget = Some(Budget::of_one("search half-width", "this run", Some(0.01), "deg"));
    NewCorrection { key, old, new, uncertainty: Some(0.01), budget, unit: "deg".into() }
}

fn zero(site: &str, old: f64, new: f64) -> NewCorrection {
    correction("joint_zero", site, old, new)
}

/// Proposes and applies; gives the revision.
fn put_in_force(record: &mut Record, run: RunId, step: &str, corrections: &[NewCorrection]) -> i64 {
    let numbers = record.propose_corrections(run, step, CELL, corrections).expect("proposals");
    record.apply_corrections(CELL, "arm", &numbers, step).expect("a revision")
}

fn in_force(record: &Record) -> Vec<(String, f64)> {
    let corrections = record.corrections_in_force(CELL, "arm").expect("corrections");
    let mut values: Vec<_> = corrections.into_iter().map(|one| (one.key.site, one.value)).collect();
    values.sort_by(|a, b| a.0.cmp(&b.0));
    values
}

fn proposals(record: &Record, run: RunId) -> Vec<StoredCorrection> {
    record.corrections_of_run(run).expect("corrections")
}

#[test]
fn rolling_back_over_two_later_values_gives_the_value_before_the_first_of_them() {
    let (_directory, mut record, run) = record();
    let first = put_in_force(&mut record, run, "first", &[zero("waist", 0.0, 1.0)]);
    put_in_force(&mut record, run, "second", &[zero("elbow", -0.5, -2.0)]);
    put_in_force(&mut record, run, "third", &[zero("elbow", -2.0, -3.0)]);
    let back = record.roll_back(CELL, "arm", first, "worse").expect("a rollback");
    assert_eq!(in_force(&record), vec![("elbow".to_owned(), -0.5), ("waist".to_owned(), 1.0)]);
    let [elbow] = back.changed.as_slice() else { panic!("{:?}", back.changed) };
    assert_eq!((elbow.old, elbow.new), (-3.0, -0.5));
    assert_eq!(elbow.uncertainty, None, "nobody determined the value it began with");
}

#[test]
fn a_rollback_brings_the_uncertainty_and_its_budget_back_with_the_value() {
    let (_directory, mut record, run) = record();
    let first = put_in_force(&mut record, run, "first", &[zero("waist", 0.0, 1.0)]);
    put_in_force(&mut record, run, "second", &[zero("waist", 1.0, 5.0)]);
    let back = record.roll_back(CELL, "arm", first, "bad zero").expect("a rollback");
    assert_eq!(back.changed, [zero("waist", 5.0, 1.0)]);
    let error = record.roll_back(CELL, "arm", first, "again").expect_err("as it is").to_string();
    assert!(error.contains("nothing to bring back"), "{error}");
    assert_eq!(record.revisions(CELL).expect("revisions").len(), 3, "and no empty revision was made");
}

#[test]
fn what_was_taken_back_while_a_run_went_on_is_listed_with_the_revision_that_did_so() {
    let (_directory, mut record, run) = record();
    let first = put_in_force(&mut record, run, "first", &[zero("waist", 0.0, 1.0)]);
    assert_eq!(record.undone_in_run(run).expect("nothing yet"), vec![]);
    put_in_force(&mut record, run, "second", &[zero("waist", 1.0, 5.0), zero("elbow", 0.0, -2.0)]);
    let back = record.roll_back(CELL, "arm", first, "went back").expect("a rollback").revision;
    // Both of the second step's corrections, not the first step's: that is in force again.
    let taken_back = proposals(&record, run).into_iter().filter(|one| one.step == "second");
    let taken_back: Vec<(i64, i64)> = taken_back.map(|one| (one.id, back)).collect();
    assert_eq!(taken_back.len(), 2);
    assert_eq!(record.undone_in_run(run).expect("what was taken back"), taken_back);
    // Another run has taken nothing back.
    let other = record.start_run(&NewRun { cell: CELL.into(), ..NewRun::default() }).expect("a run");
    assert_eq!(record.undone_in_run(other).expect("nothing"), vec![]);
}

#[test]
fn revision_0_is_what_was_before_anything_was_corrected() {
    let (_directory, mut record, run) = record();
    put_in_force(&mut record, run, "first", &[zero("waist", 0.25, 1.0)]);
    record.roll_back(CELL, "arm", 0, "all wrong").expect("a rollback");
    assert_eq!(in_force(&record), vec![("waist".to_owned(), 0.25)]);
    for (cell, device) in [("puma", "arm"), (CELL, "other")] {
        let error = record.roll_back(cell, device, 0, "").expect_err("nothing known of it").to_string();
        assert!(error.contains("there is no revision 0"), "{error}");
    }
}

#[test]
fn a_zero_that_the_controller_keeps_is_not_said_to_be_brought_back() {
    let (_directory, mut record, run) = record();
    let first = put_in_force(&mut record, run, "first", &[zero("waist", 0.0, 1.0)]);
    put_in_force(&mut record, run, "second", &[correction(CONTROLLER_ZERO, "elbow", 90.0, 91.0)]);
    let error = record.roll_back(CELL, "arm", first, "").expect_err("nothing else changed").to_string();
    assert!(error.contains("its controller keeps"), "{error}");
    put_in_force(&mut record, run, "third", &[zero("waist", 1.0, 2.0)]);
    let back = record.roll_back(CELL, "arm", first, "").expect("the waist's zero");
    assert_eq!(back.left.iter().map(|key| key.site.as_str()).collect::<Vec<_>>(), ["elbow"]);
    assert_eq!(in_force(&record), vec![("elbow".to_owned(), 91.0), ("waist".to_owned(), 1.0)]);
}

#[test]
fn a_correction_comes_into_force_once() {
    let (_directory, mut record, run) = record();
    let numbers = record.propose_corrections(run, "apply", CELL, &[zero("waist", 0.0, 1.0)]).expect("noted");
    let first = record.apply_corrections(CELL, "arm", &numbers, "accepted").expect("a revision");
    let error = record.apply_corrections(CELL, "arm", &numbers, "again").expect_err("in force already");
    assert!(error.to_string().contains("in force already"), "{error}");
    assert_eq!(proposals(&record, run)[0].revision, Some(first), "the revision that put it in force stays");
    assert_eq!(record.revisions(CELL).expect("revisions").len(), 1);
}

#[test]
fn corrections_come_into_force_together_or_not_at_all() {
    let (_directory, mut record, run) = record();
    let two = [zero("waist", 0.0, 1.0), zero("elbow", 0.0, 2.0)];
    let numbers = record.propose_corrections(run, "apply", CELL, &two).expect("noted");
    let with_an_unknown = [numbers[0], 999, numbers[1]];
    record.apply_corrections(CELL, "arm", &with_an_unknown, "half").expect_err("no correction 999");
    assert_eq!(in_force(&record), vec![], "not the first one either");
    assert!(record.revisions(CELL).expect("revisions").is_empty());
    let error = record.apply_corrections(CELL, "other", &numbers, "").expect_err("another device's");
    assert!(error.to_string().contains("never proposed for this device"), "{error}");
    record.apply_corrections(CELL, "arm", &numbers, "whole").expect("both");
    assert_eq!(in_force(&record).len(), 2);
}

#[test]
fn what_an_interrupted_step_proposes_again_is_noted_once() {
    let (_directory, mut record, run) = record();
    let first = record.propose_corrections(run, "apply", CELL, &[zero("waist", 0.0, 1.0)]).expect("noted");
    let again = record.propose_corrections(run, "apply", CELL, &[zero("waist", 0.0, 1.0)]).expect("noted");
    assert_eq!(first, again);
    let other = record.propose_corrections(run, "apply", CELL, &[zero("waist", 0.0, 1.5)]).expect("noted");
    assert_ne!(first, other, "another value is another finding");
    assert_eq!(proposals(&record, run).len(), 2);
}

#[test]
fn an_uncertainty_of_nothing_is_none() {
    let (_directory, mut record, run) = record();
    for (uncertainty, kept) in [(Some(0.0), None), (Some(f64::INFINITY), None), (Some(-0.5), Some(0.5))] {
        let one = NewCorrection { uncertainty, ..zero("waist", 0.0, 1.0) };
        record.propose_corrections(run, &format!("{uncertainty:?}"), CELL, &[one]).expect("noted");
        assert_eq!(proposals(&record, run).last().and_then(|one| one.uncertainty), kept);
    }
}

#[test]
fn of_what_was_found_for_a_joint_only_the_newest_is_in_force() {
    let (_directory, mut record, run) = record();
    put_in_force(&mut record, run, "first", &[zero("waist", 0.0, 1.0)]);
    put_in_force(&mut record, run, "second", &[zero("waist", 1.0, 2.0)]);
    record.propose_corrections(run, "third", CELL, &[zero("waist", 2.0, 3.0)]).expect("a proposal");
    let trend = record.trend("arm", "waist", Some(CELL)).expect("the trend");
    let shown: Vec<_> = trend.iter().map(|one| (one.new, one.revision.is_some(), one.in_force)).collect();
    assert_eq!(shown, [(1.0, true, false), (2.0, true, true), (3.0, false, false)]);
}

#[test]
fn a_step_that_was_skipped_is_reported_with_its_run_unless_it_was_done_later() {
    let (_directory, mut record, run) = record();
    for (step, outcomes) in [("lower", vec!["error", "skipped"]), ("find", vec!["skipped", "passed"])] {
        for outcome in outcomes {
            let (row, _) = record.start_step(run, step).expect("a step");
            record.end_step(row, &StepEnd { outcome, message: "", result: &json!(null) }).expect("its end");
        }
    }
    assert_eq!(record.run(run).expect("the run").skipped, ["lower"]);
}
