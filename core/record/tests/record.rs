//! The record as its users meet it.

#![expect(clippy::expect_used, reason = "a failed expectation is how a test fails")]

use plumb_record::{
    CorrectionKey, Instrument, Interruption, NewCorrection, NewRun, PlannedRow, Record, RunEnd, RunState,
    StepEnd, Trigger,
};
use serde_json::json;

fn new_run(record: &mut Record) -> plumb_record::RunId {
    let run = NewRun {
        cell: "teachmover".into(),
        procedure: "initialize".into(),
        parameters: json!({"K_mm": 140.0}),
        ..NewRun::default()
    };
    record.start_run(&run).expect("a run")
}

fn zero(site: &str, old: f64, new: f64) -> NewCorrection {
    let key = CorrectionKey { device: "arm".into(), quantity: "joint_zero".into(), site: site.into() };
    NewCorrection { key, old, new, uncertainty: Some(0.01), budget: None, unit: "deg".into() }
}

fn in_force(record: &Record) -> Vec<(String, f64)> {
    let corrections = record.corrections_in_force("teachmover", "arm").expect("corrections");
    let mut values: Vec<_> = corrections.into_iter().map(|c| (c.key.site, c.value)).collect();
    values.sort_by(|a, b| a.0.cmp(&b.0));
    values
}

#[test]
fn what_one_program_wrote_another_reads_although_the_first_never_closed_it() {
    let directory = tempfile::tempdir().expect("a directory");
    let mut writer = Record::open(directory.path()).expect("a record");
    let run = new_run(&mut writer);
    let row = PlannedRow {
        step: "lower".into(),
        title: "Lower".into(),
        kind: "search".into(),
        depth: 0,
        estimate_s: Some(2.0),
    };
    writer.note_plan(run, std::slice::from_ref(&row)).expect("a plan");
    let (first, attempt) = writer.start_step(run, "lower").expect("a step");
    assert_eq!(attempt, 1);
    writer.note_intent(first, &json!({"start": [0.1, 1.0 / 3.0]})).expect("an intent");
    writer
        .end_step(first, &StepEnd { outcome: "error", message: "nothing found", result: &json!(null) })
        .expect("its end");
    let (_, attempt) = writer.start_step(run, "lower").expect("again");
    assert_eq!(attempt, 2);
    let trigger = Trigger {
        device: "arm",
        sensor: "eye",
        fired: true,
        fine: true,
        time_ns: 5,
        surface: Some("table"),
        height_mm: Some(8.0),
        direction: -1,
        sides: &json!({"shoulder": -1, "elbow": 0}),
        joint: "shoulder",
        joints: &json!([{"name": "shoulder", "drive": 1.0, "value": 1.5, "unit": "deg"}]),
        half_width: 0.02,
        unit: "deg",
    };
    writer.note_trigger(run, "lower", &trigger).expect("a trigger");
    writer.note_interruption(run, Interruption::Paused, Some("lower"), "operator").expect("a pause");

    let reader = Record::open(directory.path()).expect("the same record");
    assert_eq!(reader.run(run).expect("the run").state, RunState::Running);
    assert_eq!(reader.plan(run).expect("the plan"), vec![row]);
    let steps = reader.steps(run).expect("the steps");
    assert_eq!(steps.len(), 2);
    let intent = reader.intent(run, "lower").expect("a look").expect("an intent");
    assert_eq!(intent["start"][1].as_f64(), Some(1.0 / 3.0), "numbers come back to the last bit");
    assert_eq!(steps[0].outcome.as_deref(), Some("error"));
    assert_eq!(steps[1].ended, None, "the second attempt was never ended");
    assert_eq!(reader.triggers(run).expect("the triggers")[0].joints[0]["value"], json!(1.5));
    assert_eq!(reader.triggers(run).expect("the triggers")[0].sides["shoulder"], json!(-1));
    assert_eq!(reader.interruptions(run).expect("the interruptions")[0].kind, "paused");
}

#[test]
fn the_first_answer_to_a_prompt_stays() {
    let directory = tempfile::tempdir().expect("a directory");
    let mut record = Record::open(directory.path()).expect("a record");
    let run = new_run(&mut record);
    let prompt = record.ask_prompt(run, "ready", |id| json!({"id": id, "text": "ready?"})).expect("a prompt");
    assert!(record.answer_prompt(prompt, &json!("done"), "ada").expect("an answer"));
    assert!(!record.answer_prompt(prompt, &json!("no"), "bob").expect("a second answer"));
    let stored = &record.prompts(run).expect("the prompts")[0];
    assert_eq!(stored.description["id"], json!(prompt));
    let answer = stored.answer.as_ref().expect("an answer");
    assert_eq!((answer.by.as_str(), &answer.answer), ("ada", &json!("done")));
}

#[test]
fn a_withdrawn_prompt_takes_no_answer() {
    let directory = tempfile::tempdir().expect("a directory");
    let mut record = Record::open(directory.path()).expect("a record");
    let run = new_run(&mut record);
    let prompt = record.ask_prompt(run, "ready", |_| json!(null)).expect("a prompt");
    record.withdraw_prompt(prompt).expect("withdrawn");
    assert!(!record.answer_prompt(prompt, &json!("done"), "ada").expect("too late"));
}

#[test]
fn a_proposal_is_not_in_force_and_a_rollback_is_a_new_revision() {
    let directory = tempfile::tempdir().expect("a directory");
    let mut record = Record::open(directory.path()).expect("a record");
    let run = new_run(&mut record);
    let proposed = record
        .propose_corrections(run, "apply", "teachmover", &[zero("waist", 0.0, 1.0), zero("elbow", 0.0, -2.0)])
        .expect("proposals");
    assert_eq!(in_force(&record), vec![]);
    let first =
        record.apply_corrections("teachmover", "arm", &proposed[..1], "accepted").expect("a revision");
    assert_eq!(in_force(&record), vec![("waist".to_owned(), 1.0)]);

    let again = record.propose_corrections(
        run,
        "apply",
        "teachmover",
        &[zero("waist", 1.0, 1.25), zero("elbow", 0.0, -2.5)],
    );
    let second = record
        .apply_corrections("teachmover", "arm", &again.expect("proposals"), "accepted")
        .expect("a revision");
    assert!(second > first);
    assert_eq!(in_force(&record), vec![("elbow".to_owned(), -2.5), ("waist".to_owned(), 1.25)]);

    let third = record.roll_back("teachmover", "arm", first, "worse").expect("a rollback");
    assert!(third.revision > second);
    assert_eq!(in_force(&record), vec![("elbow".to_owned(), 0.0), ("waist".to_owned(), 1.0)]);
    let key = CorrectionKey { device: "arm".into(), quantity: "joint_zero".into(), site: "waist".into() };
    let corrected = record.corrected().expect("what was corrected");
    assert_eq!(
        corrected.first(),
        Some(&("teachmover".to_owned(), key.clone())),
        "waist came into force first"
    );
    assert_eq!(corrected.len(), 2);
    let values: Vec<f64> =
        record.correction_history("teachmover", &key).expect("history").iter().map(|c| c.new).collect();
    assert_eq!(values, vec![1.0, 1.25, 1.0], "nothing was overwritten");
    let error = record.roll_back("teachmover", "arm", 99, "").expect_err("no such revision").to_string();
    assert!(error.contains("no revision 99"), "{error}");
}

#[test]
fn an_unfinished_run_is_found_until_it_ends() {
    let directory = tempfile::tempdir().expect("a directory");
    let mut record = Record::open(directory.path()).expect("a record");
    let run = new_run(&mut record);
    assert_eq!(record.unfinished_run("teachmover").expect("a look").map(|found| found.run), Some(run));
    record.end_run(run, RunEnd::Failed, "a check failed").expect("the end");
    assert_eq!(record.unfinished_run("teachmover").expect("a look"), None);
    assert_eq!(record.run(run).expect("the run").state, RunState::Ended(RunEnd::Failed));
    let error = record.run(plumb_record::RunId(77)).expect_err("none").to_string();
    assert!(error.contains("no run 77"), "{error}");
}

#[test]
fn a_model_is_noted_once_until_it_changes() {
    let directory = tempfile::tempdir().expect("a directory");
    let mut record = Record::open(directory.path()).expect("a record");
    let first = record.note_model("teachmover", "arm", None, "arm: a", "loaded").expect("noted");
    assert_eq!(record.note_model("teachmover", "arm", None, "arm: a", "loaded").expect("noted"), first);
    assert_ne!(record.note_model("teachmover", "arm", None, "arm: b", "loaded").expect("noted"), first);
    assert_eq!(record.model_revisions("teachmover", "arm").expect("models").len(), 2);
}

/// A record as plumb 0.1.0 wrote it before there were instruments, notes and answers from elsewhere, as SQL.
const OLDER: &str = include_str!("older/schema-1.sql");

#[test]
fn a_record_of_an_older_program_is_brought_up_to_date_and_keeps_everything() {
    let directory = tempfile::tempdir().expect("a directory");
    let older = rusqlite::Connection::open(directory.path().join("plumb.sqlite3")).expect("a file");
    // A dump fills its tables in the order of their names, not of their references.
    older.pragma_update(None, "foreign_keys", false).expect("answered");
    older.execute_batch(OLDER).expect("the older record");
    older.pragma_update(None, "user_version", 1).expect("its version");
    drop(older);

    let mut record = Record::open(directory.path()).expect("brought up to date");
    assert!(record.damage().expect("checked").is_empty());
    let run = record.history(10).expect("the runs").remove(0);
    assert_eq!((run.operator.as_str(), run.state), ("ada", RunState::Ended(RunEnd::Passed)));
    let trigger = record.triggers(run.run).expect("trigger poses").pop().expect("one");
    assert_eq!((trigger.joint.as_str(), trigger.surface, trigger.direction), ("waist", None, None));
    let zero = record.corrections_in_force("teachmover", "arm").expect("corrections").remove(0);
    assert!((zero.value - 1.7).abs() < 1e-6, "{zero:?}");

    record.add_note(run.run, "bob", "written years later").expect("a note");
    let gauge = Instrument { name: "gauge".into(), what: "gauge block".into(), ..Instrument::default() };
    let newer =
        NewRun { instruments: vec![gauge.clone()], notes: vec!["a new one".into()], ..NewRun::default() };
    let newer = record.start_run(&newer).expect("a run");
    drop(record);
    let again = Record::open(directory.path()).expect("opened again");
    assert_eq!(again.notes(run.run).expect("notes").remove(0).text, "written years later");
    assert_eq!(again.instruments(newer).expect("instruments"), [gauge]);
}

#[test]
fn an_answer_from_elsewhere_waits_until_it_is_taken_or_refused() {
    let directory = tempfile::tempdir().expect("a directory");
    let mut asking = Record::open(directory.path()).expect("a record");
    let run = new_run(&mut asking);
    let prompt = asking.ask_prompt(run, "hand", |id| json!({"id": id})).expect("a prompt");
    let mut elsewhere = Record::open(directory.path()).expect("the same record");
    assert_eq!(elsewhere.open_prompt(run).expect("read").map(|prompt| prompt.id), Some(prompt));
    let first = elsewhere.offer_answer(prompt, &json!(25), "bob").expect("offered");
    let second = elsewhere.offer_answer(prompt, &json!(8), "bob").expect("offered");
    assert_eq!(
        asking.offer_to(prompt).expect("read").map(|offer| offer.id),
        Some(first),
        "the first comes first"
    );
    asking.refuse_offer(first, "out of range").expect("refused");
    assert_eq!(elsewhere.why_refused(first).expect("read").as_deref(), Some("out of range"));
    let offer = asking.offer_to(prompt).expect("read").expect("the second");
    assert_eq!((offer.id, offer.answer.clone()), (second, json!(8)));
    assert!(asking.answer_prompt(prompt, &offer.answer, &offer.by).expect("answered"));
    assert_eq!(elsewhere.open_prompt(run).expect("read"), None);
}
