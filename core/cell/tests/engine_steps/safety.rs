//! Safety where two conditions meet: limits and a zero, planes and zeros in question, a resume and an arm that was moved or a file that was changed.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use plumb_cell::command::Command;
use plumb_cell::engine::{RunRequest, StartError, start_run};
use plumb_cell::event::RunOutcome;
use plumb_cell::expression::Calculator;
use plumb_cell::workcell::{Workcell, load_workcell};
use plumb_record::RunId;
use tempfile::TempDir;

use super::{folder, lost_at_its_second_move};
use crate::support::running::{
    cell_with_steps, message_of, request, start, start_commanded, watch, workcell,
};
use crate::support::{Devices, World};

/// Applies a zero of the waist, and then moves it to where the numbers say `to`.
fn shifted_then_sent(zero: f64, to: f64) -> (RunOutcome, String, Arc<World>) {
    let folder = folder();
    let steps = format!("
steps:
  - {{id: shift, do: {{apply: {{robot: arm, ask: false, joint_zero: {{waist: {{shift_deg: {zero}, uncertainty_deg: 0.1}}}}}}}}}}
  - {{id: out, do: {{move: {{robot: arm, to_deg: {{waist: {to} + 0}}}}}}}}
");
    let cell = with_limits(&folder, &steps);
    let world = World::new([0.0; 3]);
    let (outcome, events) = watch(start(request(&cell, &folder), &world), |_, _| {});
    (outcome, message_of(&events).to_owned(), world)
}

/// The cell with these steps, its waist held between -40 and 40 deg.
fn with_limits(folder: &TempDir, steps: &str) -> Arc<Workcell> {
    drop(cell_with_steps(folder, steps));
    let file = folder.path().join("cell.yaml");
    let text = std::fs::read_to_string(&file).expect("the cell file");
    let text = text.replace("    initialize:", "    limits_deg: {waist: [-40, 40]}\n    initialize:");
    assert!(text.contains("limits_deg"), "{text}");
    std::fs::write(&file, text).expect("written");
    Arc::new(load_workcell(&file, &Calculator::new()).unwrap_or_else(|_| panic!("the cell is in order")))
}

#[test]
fn the_cells_limits_hold_for_the_corrected_joint_whatever_its_zero() {
    for zero in [-6.0, 0.0, 6.0] {
        for (to, allowed) in [(39.0, true), (41.0, false), (-39.0, true), (-41.0, false)] {
            let (outcome, message, world) = shifted_then_sent(zero, to);
            assert_eq!(outcome == RunOutcome::Passed, allowed, "zero {zero}, to {to}: {message}");
            if allowed {
                let truth = world.truth_deg()[0];
                assert!(
                    (truth - (to - zero)).abs() < 1e-9,
                    "zero {zero}, to {to}: the drive goes to {truth}"
                );
            } else {
                let expected = format!("waist would go to {to:.3} deg; it goes from -40.000 to 40.000 deg");
                assert!(message.contains(&expected), "{message}");
                assert_eq!(world.moves.load(Ordering::SeqCst), 0);
            }
        }
    }
}

#[test]
fn planes_are_not_trusted_while_a_run_is_finding_the_zeros_although_all_are_known() {
    let record = folder();
    let world = World::new([0.0; 3]);
    let whole = workcell("cell.yaml");
    assert_eq!(watch(start(request(&whole, &record), &world), |_, _| {}).0, RunOutcome::Passed);
    let down = "steps:\n  - {id: down, do: {move: {robot: arm, by_deg: {shoulder: -30}}}}\n";
    for (head, ended) in [("", RunOutcome::Error), ("finds_zeros: [arm]\n", RunOutcome::Passed)] {
        let steps = folder();
        let cell = cell_with_steps(&steps, &format!("{head}{down}"));
        let world = World::new([0.0; 3]);
        let (outcome, events) = watch(start(request(&cell, &record), &world), |_, _| {});
        assert_eq!(outcome, ended, "{}", message_of(&events));
        let guards = world.guards.lock().expect("no test panicked").clone();
        let planes = guards.iter().map(|guard| guard["planes"].as_array().map_or(0, Vec::len));
        let expected = if head.is_empty() { cell.keep_out.len() } else { 0 };
        assert_eq!(
            planes.collect::<Vec<_>>(),
            [expected],
            "the host checks by planes of zeros that are trusted: {guards:?}"
        );
    }
}

#[test]
fn an_unattended_resume_sees_an_arm_that_was_moved_by_a_hundredth_of_a_degree() {
    for (moved, ended) in
        [(0.01, RunOutcome::NeedsOperator), (5.0, RunOutcome::NeedsOperator), (0.0, RunOutcome::Passed)]
    {
        let folder = folder();
        let (_cell, world, again) = lost_at_its_second_move(&folder);
        world.push_deg(1, moved);
        let (outcome, events) = watch(start(again, &world), |_, _| {});
        assert_eq!(outcome, ended, "moved by {moved} deg: {}", message_of(&events));
    }
}

#[test]
fn a_run_is_not_resumed_once_a_file_of_its_cell_was_changed() {
    for file in ["cell.yaml", "extra.yaml", "teachmover.model.yaml"] {
        let folder = folder();
        let (_cell, world, _) = lost_at_its_second_move(&folder);
        let path = folder.path().join(file);
        let text = std::fs::read_to_string(&path).expect("the file");
        std::fs::write(&path, format!("{text}\n# changed\n")).expect("written");
        let changed = load_workcell(&folder.path().join("cell.yaml"), &Calculator::new());
        let changed = Arc::new(changed.unwrap_or_else(|_| panic!("a comment changes nothing")));
        let again = RunRequest { resume: Some(RunId(1)), ..request(&changed, &folder) };
        let devices = Devices(Arc::clone(&world));
        let refused = start_run(again, |_| Ok(Box::new(devices))).err().expect("refused");
        assert!(matches!(refused, StartError::NotResumable { .. }), "{refused}");
        assert!(
            refused.to_string().contains(file) && refused.to_string().contains("was changed since it began"),
            "{refused}"
        );
    }
    let folder = folder();
    let (_cell, world, again) = lost_at_its_second_move(&folder);
    assert_eq!(watch(start(again, &world), |_, _| {}).0, RunOutcome::Passed, "an unchanged one is");
}

#[test]
fn a_run_that_is_finished_in_the_middle_of_a_search_makes_no_further_move() {
    let steps = "
steps:
  - {id: lower, do: {search: {robot: arm, joint: shoulder, travel_deg: -40, until: {sensor: eye, is: on}}}}
  - {id: after, do: {move: {robot: arm, by_deg: {waist: 1}}}}
";
    for command in [Command::Finish, Command::Keep, Command::Abort] {
        let folder = folder();
        let cell = cell_with_steps(&folder, steps);
        let world = World::new([0.0; 3]);
        let sent = command.clone();
        let mut run = request(&cell, &folder);
        run.unattended = false;
        let running = start_commanded(run, &world, move |number, handle| {
            if number == 3 {
                handle.send(sent.clone());
            }
        });
        let (outcome, events) = watch(running, |_, _| {});
        assert_eq!(world.moves.load(Ordering::SeqCst), 3, "{command:?}: {}", message_of(&events));
        let expected = match command {
            Command::Finish => RunOutcome::Passed,
            Command::Keep => RunOutcome::NeedsOperator,
            _ => RunOutcome::Aborted,
        };
        assert_eq!(outcome, expected, "{command:?}");
    }
}

#[test]
fn a_move_may_take_three_times_its_time_and_ten_seconds_or_what_is_left_of_its_step() {
    let steps = |more: &str| {
        format!(
            "\nsteps:\n  - {{id: out, do: {{move: {{robot: arm, by_deg: {{waist: 20}}, speed: 0.5}}}}{more}}}\n"
        )
    };
    let limit = |more: &str| {
        let folder = folder();
        let cell = cell_with_steps(&folder, &steps(more));
        let world = World::new([0.0; 3]);
        let (outcome, events) = watch(start(request(&cell, &folder), &world), |_, _| {});
        assert_eq!(outcome, RunOutcome::Passed, "{}", message_of(&events));
        let limits = world.limits.lock().expect("the limits").clone();
        assert_eq!(limits.len(), 1);
        limits[0].as_secs_f64()
    };
    // 20 degrees at half of 0.4 rad/s take 1.745 s.
    let expected = 3.0 * 20.0_f64.to_radians() / 0.2 + 10.0;
    assert!((limit("") - expected).abs() < 1e-6, "{}", limit(""));
    let left = limit(", time_limit_s: 6");
    assert!(left > 1.0 && left <= 6.0, "{left}");
}
