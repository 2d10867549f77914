//! What runs say of how far off their corrections may be.

use plumb_cell::event::{Correction, Event, LogLevel, RunOutcome};
use plumb_cell::prompt::Answer;
use plumb_record::{CorrectionKey, NewCorrection, NewRun, Record, RunId};

use super::{folder, run_attended};
use crate::support::World;
use crate::support::running::{ZERO_ERROR_DEG, cell_with_steps, request, start, watch};

/// Accepts every prompt.
fn accept(event: &Event, handle: &plumb_cell::RunHandle) {
    if let Event::PromptAsked { prompt } = event {
        let answer = Answer::Choice { key: "accept".to_owned() };
        handle.send(plumb_cell::command::Command::Answer { prompt: prompt.id, answer, by: "ada".to_owned() });
    }
}

fn proposed(events: &[Event]) -> Vec<Correction> {
    let found = events.iter().filter_map(|event| match event {
        Event::CorrectionProposed { correction } => Some(correction.clone()),
        _ => None,
    });
    found.collect()
}

/// A lever of 100 mm: an offset of 1 mm at its end turns it by 0.573 deg. The cell's target lies within 1 mm, its level is good to 0.25 deg.
const LEVER: &str = "
steps:
  - id: found
    do:
      compute:
        script: let turned = to_deg((5 + offset_mm) / 100.0) + level_deg;
        values: {shift_deg: turned, other_deg: -turned}
        errors:
          offset_mm: {half_width: tolerances.target_mm, about: the target off its place}
          level_deg: {standard: instruments.level.uncertainty_deg}
  - id: put_right
    do:
      apply:
        robot: arm
        joint_zero:
          shoulder: {shift_deg: found.shift_deg, uncertainty_deg: found.budget.shift_deg}
          elbow: {shift_deg: found.other_deg, uncertainty_deg: found.budget.other_deg}
          waist: {shift_deg: 1 + play_deg, errors: {play_deg: {half_width: 0.3}}}
";

#[test]
fn errors_go_through_the_equations_into_a_budget_that_is_kept() {
    let (outcome, events, folder, _) = run_attended(LEVER, accept);
    assert_eq!(outcome, RunOutcome::Passed, "{events:?}");
    let record = Record::open(folder.path()).expect("the record");
    let kept = record.corrections_of_run(RunId(1)).expect("corrections");
    let of = |joint: &str| kept.iter().find(|one| one.key.site == joint).expect("corrected");
    let by_hand = ((100.0_f64.recip().to_degrees() / 3.0_f64.sqrt()).powi(2) + 0.25_f64.powi(2)).sqrt();
    for (joint, sign) in [("shoulder", 1.0), ("elbow", -1.0)] {
        let budget = of(joint).budget.as_ref().expect("a budget");
        let [offset, level] = budget.components.as_slice() else { panic!("{budget:?}") };
        assert_eq!((offset.name.as_str(), offset.unit.as_str()), ("the target off its place", "mm"));
        assert!(offset.source.contains("tolerances.target_mm"), "{}", offset.source);
        assert!((offset.sensitivity - sign * 0.01_f64.to_degrees()).abs() < 1e-9);
        assert!((level.sensitivity - sign).abs() < 1e-9);
        assert!((of(joint).uncertainty.expect("known") - by_hand).abs() < 1e-9);
    }
    let correlation = of("shoulder").budget.as_ref().zip(of("elbow").budget.as_ref());
    let correlation = correlation.and_then(|(one, other)| one.correlation(other)).expect("both are known");
    assert!((correlation + 1.0).abs() < 1e-9, "one is the other turned round: {correlation}");
    assert!((of("waist").uncertainty.expect("known") - 0.3 / 3.0_f64.sqrt()).abs() < 1e-9);
    assert_eq!(proposed(&events)[0].budget, of("shoulder").budget, "anyone who watches sees it as well");
}

#[test]
fn what_the_cell_file_does_not_say_is_not_determined_and_the_prompt_names_it() {
    let steps = LEVER.replace("tolerances.target_mm", "tolerances.ruler_mm");
    let mut asked = String::new();
    let (outcome, _, folder, _) = run_attended(&steps, |event, handle| {
        if let Event::PromptAsked { prompt } = event {
            asked.clone_from(&prompt.text);
        }
        accept(event, handle);
    });
    assert_eq!(outcome, RunOutcome::Passed);
    assert!(asked.contains("zero of shoulder: 0.0000 -> 2.8648 deg (± not determined)"), "{asked}");
    let open = "not determined: the target off its place (the cell file gives no `tolerances.ruler_mm`); the rest comes to ± 0.25 deg";
    assert!(asked.contains(open), "{asked}");
    let record = Record::open(folder.path()).expect("the record");
    let in_force = record.corrections_in_force("teachmover", "arm").expect("corrections");
    let of = |joint: &str| in_force.iter().find(|one| one.key.site == joint).expect("corrected").uncertainty;
    assert_eq!(of("shoulder"), None);
    assert!(of("waist").is_some(), "the waist does not depend on it");
}

#[test]
fn no_uncertainty_is_nothing() {
    let steps = "
steps:
  - {id: shift, do: {apply: {robot: arm, joint_zero: {waist: {shift_deg: 4, uncertainty_deg: 0}}}}}
  - {id: declare, do: {declare: {robot: arm, as_deg: {elbow: arm.joints.elbow_deg + 1}, plausible: 5}}}
";
    let mut asked = Vec::new();
    let (_, events, _, _) = run_attended(steps, |event, handle| {
        if let Event::PromptAsked { prompt } = event {
            asked.push(prompt.text.clone());
        }
        accept(event, handle);
    });
    assert!(asked.iter().all(|text| text.contains("(± not determined)")), "{asked:?}");
    assert_eq!(proposed(&events).iter().map(|one| one.uncertainty).collect::<Vec<_>>(), [None, None]);
}

#[test]
fn an_error_that_its_equations_cannot_bear_ends_the_step_with_its_name() {
    let steps = "
steps:
  - id: found
    do:
      compute:
        values: {a_deg: acos_deg(0.999 + x_mm)}
        errors: {x_mm: {standard: 0.5}}
    on_error: abort
";
    let (outcome, events, _, _) = run_attended(steps, |_, _| {});
    assert_eq!(outcome, RunOutcome::Error);
    let message = super::message_of(&events);
    assert!(message.contains("the uncertainty by `x_mm` (0.500 mm) cannot be worked out"), "{message}");
}

/// A shift far beyond those that runs found before, or most of what is plausible, is reported before it is accepted.
#[test]
fn an_unusual_correction_is_pointed_out_before_it_is_accepted() {
    let folder = folder();
    let mut record = Record::open(folder.path()).expect("a record");
    for value in [0.10, 0.12, 0.11] {
        let run = NewRun { cell: "teachmover".into(), ..NewRun::default() };
        let run = record.start_run(&run).expect("a run");
        let key = CorrectionKey { device: "arm".into(), quantity: "joint_zero".into(), site: "waist".into() };
        let zero = NewCorrection {
            key,
            old: 0.0,
            new: value,
            uncertainty: Some(0.01),
            budget: None,
            unit: "deg".into(),
        };
        let numbers = record.propose_corrections(run, "apply", "teachmover", &[zero]).expect("noted");
        record.apply_corrections("teachmover", "arm", &numbers, "test").expect("in force");
    }
    drop(record);
    let steps = "
steps:
  - id: shift
    do:
      apply:
        robot: arm
        joint_zero:
          waist: {shift_deg: 2, uncertainty_deg: 0.1}
          elbow: {shift_deg: 17, uncertainty_deg: 0.1, plausible_deg: 20}
";
    let cell = cell_with_steps(&folder, steps);
    let mut run = request(&cell, &folder);
    run.unattended = false;
    let mut asked = String::new();
    let (_, events) = watch(start(run, &World::new(ZERO_ERROR_DEG)), |event, handle| {
        if let Event::PromptAsked { prompt } = event {
            asked.clone_from(&prompt.text);
        }
        accept(event, handle);
    });
    let waist = "LOOK AT THIS FIRST: the zero of waist would be 2.110 deg; 3 earlier runs found 0.110 deg";
    let elbow = "LOOK AT THIS FIRST: the zero of elbow shifts by +17.000 deg, most of the 20 deg";
    assert!(asked.contains(waist) && asked.contains(elbow), "{asked}");
    let warned = |event: &Event| matches!(event, Event::Log { level: LogLevel::Warning, source, .. } if source == "apply");
    assert_eq!(events.iter().filter(|event| warned(event)).count(), 2, "and it is in the log");
}
