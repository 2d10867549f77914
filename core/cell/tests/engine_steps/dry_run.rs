//! What a run would do, without a start: what needs an operator, what is left out, and how long it takes at most and at least.

use plumb_cell::engine::{DryRun, dry_run};

use super::place;
use crate::support::running::{cell_with_steps, request};

fn planned(steps: &str, unattended: bool) -> DryRun {
    let place = place();
    let mut run = request(&cell_with_steps(&place, steps), &place);
    run.unattended = unattended;
    dry_run(&run).expect("a plan")
}

#[test]
fn a_run_with_somebody_there_needs_nobody_else() {
    let steps = "steps:\n  - {id: there, do: {prompt: {text: Drive it there., jog_to: {robot: arm}}}}\n";
    assert_eq!(planned(steps, false).needs_operator, None);
    let alone = planned(steps, true).needs_operator.expect("nobody answers");
    assert!(alone.contains("there"), "{alone}");
}

#[test]
fn a_step_that_is_left_out_takes_no_time() {
    let steps = "steps:
  - {id: never, when: 1 > 2, do: {move: {robot: arm, by_deg: {waist: 30}}}}
  - {id: way, do: {move: {robot: arm, by_deg: {waist: 30}}}}
";
    let plan = planned(steps, true);
    let [never, way] = plan.steps.as_slice() else { panic!("{:?}", plan.steps) };
    assert!(never.is_left_out && never.estimate_s == Some(0.0), "{never:?}");
    let way_s = way.estimate_s.expect("a time");
    assert!(!way.is_left_out && way_s > 1.0, "{way:?}");
    assert!((plan.estimate_s - way_s).abs() < 1e-9, "{}", plan.estimate_s);
    assert_eq!(plan.least_s, None, "it takes as long as it takes");
}

#[test]
fn the_least_time_is_that_of_the_first_turn_of_what_may_end_early() {
    let steps = "steps:
  - id: turns
    do:
      repeat:
        times: 4
        until: there.joints.waist_deg > 1000
        steps:
          - {id: there, do: {move: {robot: arm, by_deg: {waist: 10}}}}
";
    let plan = planned(steps, true);
    let least = plan.least_s.expect("it may end with any turn");
    let turn = plan.steps.iter().find(|step| step.step.ends_with("there")).and_then(|step| step.estimate_s);
    assert!((least - turn.expect("a time")).abs() < 1e-9, "{least}");
    assert!(plan.estimate_s > 3.5 * least, "{} {least}", plan.estimate_s);
    assert_eq!(plan.repetitions.iter().map(|one| one.turns).collect::<Vec<_>>(), [4]);
}

#[test]
fn a_correction_of_a_sensor_takes_one_exchange_with_it() {
    let steps = "steps:
  - {id: scale, do: {correct: {sensor: eye, ask: false, parameters: {gain: {factor: 1.01, uncertainty: 0.001, plausible: 0.1}}}}}
";
    let plan = planned(steps, true);
    assert_eq!(plan.steps.iter().map(|step| step.estimate_s).collect::<Vec<_>>(), [Some(0.02)]);
}
