//! `plumb run --dry-run`: what a run would do, with nothing started.

use std::collections::BTreeMap;

use plumb_cell::device::{CellResources, Occupancy};
use serde_json::Value;

use crate::lab::Lab;

#[test]
fn the_plan_says_what_each_step_would_move_within_what_limits_and_starts_nothing() {
    let lab = Lab::new();
    lab.edit("cell.yaml", "    initialize:", "    limits_deg: {waist: [-80, 70.5]}\n    initialize:");
    let plan = lab.plumb(&["run", "cell.yaml", "--dry-run", "--set", "cycles=1"]);
    assert_eq!(plan.code(), 0, "{}", plan.all());
    for line in [
        "initialize in teachmover: Initialize the arm over a T target",
        "cycles = 1",
        ", prompts left out; nothing was started",
        "waist.find_a: Turn the waist until line A is found (search, about",
        "moves arm waist by at most -30 deg until eye is off, at 60 % of full speed, within -80 to 70.5 deg, and the robot's own",
        "moves arm shoulder by 5 deg, at 50 % of full speed, within the robot's own, -35 to 144 deg",
        "only when cycle.turn <= cycles",
        "place: Bring the hand over the white quadrant (prompt, asks)",
        "its keep-out planes (the table) are not watched while this finds its zeros",
    ] {
        assert!(plan.out().contains(line), "{line}: {}", plan.out());
    }
    assert!(
        plan.out().contains("shoulder_elbow.cycle[2].edge") && !plan.out().contains("cycle[3]"),
        "{}",
        plan.out()
    );
    assert!(lab.plumb(&["history"]).out().contains("no runs"));
    assert_eq!(CellResources::of_cell(&lab.path("cell.yaml")).unwrap().state(), Occupancy::Empty);
}

#[test]
fn a_plan_as_json_has_the_same_steps_as_the_run() {
    let lab = Lab::new();
    let plan = lab.plumb(&["run", "cell.yaml", "--dry-run", "--json"]);
    let plan: Value = serde_json::from_str(&plan.out()).unwrap();
    let planned: Vec<&Value> = plan["steps"].as_array().unwrap().iter().map(|step| &step["step"]).collect();
    assert_eq!(lab.plumb(&["run", "cell.yaml"]).code(), 0);
    let shown = lab.shown("1");
    let ran: Vec<&Value> = shown["plan"].as_array().unwrap().iter().map(|step| &step["step"]).collect();
    assert_eq!(planned, ran);
    assert!(plan["estimate_s"].as_f64().unwrap() > 5.0, "{}", plan["estimate_s"]);
}

#[test]
fn a_plan_and_its_run_count_the_same_steps_and_leave_out_no_number() {
    let lab = Lab::new();
    let plan = lab.plumb(&["run", "cell.yaml", "--dry-run"]).out();
    let run = lab.plumb(&["run", "cell.yaml"]).out();
    for output in [&plan, &run] {
        assert!(output.contains("34 steps, "), "as many as the screen counts: {output}");
        assert_eq!(numbers(output), (1..=34).collect::<Vec<usize>>(), "{output}");
    }
}

/// The numbers of the lines that begin as `[ 3/34]`, in their order.
fn numbers(text: &str) -> Vec<usize> {
    let number = |line: &str| line.strip_prefix('[')?.split_once('/')?.0.trim().parse().ok();
    text.lines().filter_map(number).collect()
}

#[test]
fn a_plan_that_would_have_to_ask_is_shown_and_ends_with_four() {
    let lab = Lab::new();
    lab.edit("answers.yaml", "  hand: done\n", "");
    let plan = lab.plumb(&["run", "cell.yaml", "--dry-run"]);
    assert_eq!(plan.code(), 4, "{}", plan.all());
    assert!(
        plan.out().contains("waist.lower") && plan.err().contains("no answers are given for `hand`"),
        "{}",
        plan.all()
    );
}

#[test]
fn a_mistake_ends_a_dry_run_as_it_ends_a_run() {
    let lab = Lab::new();
    let plan = lab.plumb(&["run", "cell.yaml", "--dry-run", "--set", "Br_deg=200"]);
    assert_eq!(plan.code(), 2, "{}", plan.all());
    assert!(plan.err().contains("`Br_deg` is 200; it lies between 1 and 15"), "{}", plan.err());
}

#[test]
fn a_position_beyond_the_limits_is_found_before_anything_moves_written_out_or_by_a_parameter() {
    let lab = Lab::new();
    lab.edit("cell.yaml", "    initialize:", "    limits_deg: {waist: [-40, 40]}\n    initialize:");
    let plan = lab.plumb(&["run", "cell.yaml", "--dry-run", "--set", "line_a_deg=35"]);
    assert_eq!(plan.code(), 2, "{}", plan.all());
    assert!(plan.out().contains("waist to 43 deg") && plan.out().contains(": BEYOND THEM"), "{}", plan.out());
    let expected = "step `waist.aside` would send arm waist to 43 deg, beyond its limits: -40 to 40 deg";
    assert!(plan.err().contains(expected), "{}", plan.err());

    let written = "to_deg: {waist: line_a_deg + offset_deg}";
    lab.edit("procedures/waist-initialization.yaml", written, "to_deg: {waist: 60}");
    let check = lab.plumb(&["check", "cell.yaml"]);
    assert_eq!(check.code(), 2, "{}", check.all());
    for words in ["waist-initialization.yaml:", "waist cannot go to 60 deg", "within -40 to 40 deg"] {
        assert!(check.all().contains(words), "{words}: {}", check.all());
    }
    // Just as far as it may go is not beyond.
    lab.edit("procedures/waist-initialization.yaml", "to_deg: {waist: 60}", "to_deg: {waist: 40}");
    assert_eq!(lab.plumb(&["check", "cell.yaml"]).code(), 0);
}

#[test]
fn a_position_beyond_the_robots_own_limits_is_found_without_starting_it() {
    // The world's arm; the driver's manifest; the joints in a driver's settings. A zero that is corrected may make up for a little.
    for (folder, cell, procedure, joint, (from, within, beyond), expected) in [
        (
            "teachmover",
            "cell.yaml",
            "waist-initialization.yaml",
            "waist",
            ("line_a_deg + offset_deg", "105", "115"),
            "goes from -90 to 90 deg, and its zero is corrected by at most 20 deg",
        ),
        (
            "teachmover",
            "cell-serial.yaml",
            "waist-initialization.yaml",
            "waist",
            ("line_a_deg + offset_deg", "105", "115"),
            "goes from -90 to 90 deg, and its zero is corrected by at most 20 deg",
        ),
        (
            "so101",
            "cell.yaml",
            "verify.yaml",
            "shoulder_pan",
            ("-12", "-110", "-110.5"),
            "the robot itself goes from -110 to 110 deg: give a place there",
        ),
    ] {
        let lab = Lab::of(folder);
        let file = format!("procedures/{procedure}");
        let written = |position: &str| format!("{joint}: {position}");
        lab.edit(&file, &written(from), &written(within));
        assert_eq!(lab.plumb(&["check", cell]).code(), 0, "{}", lab.plumb(&["check", cell]).all());
        lab.edit(&file, &written(within), &written(beyond));
        for checked in [cell, &file] {
            let check = lab.plumb(&["check", checked]);
            assert_eq!(check.code(), 2, "{checked}: {}", check.all());
            let cannot = format!("{joint} cannot go to {beyond} deg");
            assert!(
                check.all().contains(&cannot) && check.all().contains(expected),
                "{checked}: {}",
                check.all()
            );
        }
        // What only the plan works out, the dry run finds.
        lab.edit(&file, &written(beyond), &written(&format!("2 * {beyond} / 2")));
        assert_eq!(lab.plumb(&["check", cell]).code(), 0);
        let name = if folder == "so101" { "verify" } else { "initialize" };
        let plan = lab.plumb(&["run", cell, name, "--dry-run"]);
        assert_eq!(plan.code(), 2, "{}", plan.all());
        let sent = format!("would send arm {joint} to {beyond} deg, beyond its limits: the robot itself");
        assert!(plan.err().contains(&sent), "{}", plan.err());
    }
}

/// A procedure that goes near and then somewhere by all joints, in a cell that has it.
fn sent(lab: &Lab, there: &str) {
    let near = "{id: near, do: {move: {robot: arm, to_deg: {shoulder: -50, elbow: elbow_deg, wrist: 0}, to_mm: {slide: 100}}}}";
    let parameters = "z_mm: {default: 200}, elbow_deg: {default: 90}";
    let text = format!(
        "procedure: reach\nparameters: {{{parameters}}}\nsteps:\n  - {near}\n  - {{id: there, do: {{{there}}}}}\n"
    );
    lab.write("procedures/reach.yaml", &text);
}

#[test]
fn a_point_whose_joints_would_be_beyond_their_limits_is_found_before_anything_moves() {
    let lab = Lab::of("scara");
    lab.edit("cell.yaml", "procedures: [", "procedures: [procedures/reach.yaml, ");
    sent(
        &lab,
        "move: {robot: arm, to_point: {x_mm: 400, y_mm: 0, z_mm: z_mm, by: [shoulder, elbow, slide]}}",
    );
    let plan = |set: &str| lab.plumb(&["run", "cell.yaml", "reach", "--dry-run", "--set", set]);
    assert_eq!(plan("z_mm=200").code(), 0, "{}", plan("z_mm=200").all());
    let low = plan("z_mm=20");
    assert_eq!(low.code(), 2, "{}", low.all());
    let expected = "step `there` would send arm's tip to [400, 0, 20] mm: slide would be at ";
    assert!(low.err().contains(expected) && low.err().contains(" mm, beyond its limits: "), "{}", low.err());
    // From an elbow that is nearly stretched the nearest way is beyond the cell's limits; the run takes the other one, and so does the plan.
    lab.edit("cell.yaml", "    model:", "    limits_deg: {elbow: [-130, 20]}\n    model:");
    assert_eq!(plan("elbow_deg=10").code(), 0, "{}", plan("elbow_deg=10").all());
    lab.edit("cell.yaml", "elbow: [-130, 20]", "elbow: [-20, 20]");
    let neither = plan("elbow_deg=10");
    assert!(neither.err().contains("elbow would be at "), "{}", neither.all());
}

#[test]
fn a_hand_whose_joints_would_be_beyond_their_limits_is_found_where_the_run_would_end_for_it() {
    let lab = Lab::of("light-stripe");
    let near = "to_deg: {waist: 64.3, shoulder: -66.8, elbow: 196.4, wrist_roll: 0, wrist_bend: 50.4, flange: -115.7}";
    let there = "to_hand: {at_mm: [330, 380, 0], aim_mm: [-30, 0, 60]}";
    let steps = format!(
        "procedure: reach\nsteps:\n  - {{id: near, do: {{move: {{robot: arm, {near}}}}}}}\n  - {{id: there, do: {{move: {{robot: arm, {there}}}}}}}\n"
    );
    lab.write("procedures/reach.yaml", &steps);
    lab.edit("cell.yaml", "procedures: [", "procedures: [procedures/reach.yaml]\n#  [");
    lab.edit("cell.yaml", "\n             procedures", "\n#  procedures");
    lab.edit("cell.yaml", "answers: answers.yaml", "");
    let cell = ["run", "cell.yaml", "reach"];
    let plan = || lab.plumb(&[&cell[..], &["--dry-run"]].concat());
    assert_eq!(plan().code(), 0, "{}", plan().all());
    lab.edit("cell.yaml", "    model:", "    limits_deg: {waist: [40, 90]}\n    model:");
    let expected = "step `there` would send arm's hand to [330, 380, 0] mm: waist would be at 30 deg, beyond its limits: 40 to 90 deg";
    assert!(plan().code() == 2 && plan().err().contains(expected), "{}", plan().all());
    let run = lab.plumb(&cell);
    assert!(
        run.err().contains("waist would go to 30.000 deg")
            || run.out().contains("waist would go to 30.000 deg"),
        "{}",
        run.all()
    );
}

#[test]
fn bounds_of_a_jog_that_no_joint_can_keep_are_found_before_anybody_is_asked() {
    let lab = Lab::new();
    lab.edit("cell.yaml", "    initialize:", "    limits_deg: {waist: [-40, 40]}\n    initialize:");
    lab.edit("cell.yaml", "procedures: [", "procedures: [procedures/there.yaml, ");
    let asked = |bounds: &str| {
        let step = format!(
            "{{id: by_hand, do: {{prompt: {{text: There, jog_to: {{robot: arm, within_deg: {{{bounds}}}}}}}}}}}"
        );
        lab.write("procedures/there.yaml", &format!("procedure: there\nsteps:\n  - {step}\n"));
        lab.plumb(&["check", "cell.yaml"])
    };
    for bounds in ["waist: [30, 60]", "waist: [-90, 90]", "shoulder: [-60, -50]", "waist: [20 + 30, 60]"] {
        assert_eq!(asked(bounds).code(), 0, "{}", asked(bounds).all());
    }
    let plan = lab.plumb(&["run", "cell.yaml", "there", "--dry-run"]);
    assert_eq!(plan.code(), 2, "{}", plan.all());
    let expected = "step `by_hand` would have arm where the operator jogs it: waist has to come between 50 and 60 deg, beyond its limits: -40 to 40 deg";
    assert!(plan.err().contains(expected), "{}", plan.err());
    for (bounds, expected, help) in [
        (
            "waist: [50, 60]",
            "waist cannot come between 50 and 60 deg",
            "the cell keeps it within -40 to 40 deg",
        ),
        (
            "shoulder: [-80, -60]",
            "shoulder cannot come between -80 and -60 deg",
            "the robot itself goes from -35 to 144",
        ),
        ("waist: [60, 50]", "no place of waist is between 60 and 50 deg", "write the lesser one first"),
    ] {
        let check = asked(bounds);
        assert!(
            check.code() == 2 && check.all().contains(expected) && check.all().contains(help),
            "{}",
            check.all()
        );
    }
}

/// A step kind's time in plan and run, s.
type Times = BTreeMap<String, (f64, f64)>;

/// What a dry run says of a procedure.
fn planned(lab: &Lab, cell: &str, procedure: &str) -> Value {
    let plan = lab.plumb(&["run", cell, procedure, "--dry-run", "--json"]);
    serde_json::from_str(&plan.out()).unwrap()
}

/// What each step takes in a run at the world's own pace, s.
fn taken(lab: &Lab, cell: &str, procedure: &str) -> BTreeMap<String, f64> {
    let run = lab.plumb(&["run", cell, procedure, "--pace", "real", "--json", "--events", "step_finished"]);
    assert_eq!(run.code(), 0, "{}", run.all());
    let mut taken = BTreeMap::new();
    for line in run.out().lines() {
        let event: Value = serde_json::from_str(line).unwrap();
        if let (Some(step), Some(seconds)) = (event["step"].as_str(), event["seconds"].as_f64()) {
            *taken.entry(step.to_owned()).or_default() += seconds;
        }
    }
    taken
}

/// The times of a plan's kinds of steps as it guesses them and as they were taken, with the whole.
fn by_kind(plan: &Value, taken: &BTreeMap<String, f64>) -> (Times, (f64, f64)) {
    let mut times = Times::new();
    for step in plan["steps"].as_array().unwrap() {
        // A person sets the pace of prompts; repetitions and calls take what their steps take.
        let kind = step["kind"].as_str().unwrap();
        if ["prompt", "repeat", "call"].contains(&kind) {
            continue;
        }
        let (guess, sum) = times.entry(kind.to_owned()).or_default();
        *guess += step["estimate_s"].as_f64().unwrap_or(0.0);
        *sum += taken.get(step["step"].as_str().unwrap()).copied().unwrap_or(0.0);
    }
    let whole = times.values().fold((0.0, 0.0), |all, one| (all.0 + one.0, all.1 + one.1));
    (times, whole)
}

/// Kinds of steps that take less than this altogether make no difference to anybody, s.
const NOTICED_S: f64 = 0.5;

/// Other tests keep the processor from a step now and then, which makes it longer and never shorter: of so many runs the least time of each step counts.
const RUNS: usize = 3;

/// Whether a guess is off by more than a factor of two, and anybody notices.
fn is_off((_, (guess, taken)): &(String, (f64, f64))) -> bool {
    let (less, more) = (guess.min(*taken), guess.max(*taken));
    more >= 2.0 * less && more >= NOTICED_S
}

#[test]
fn a_plan_guesses_the_time_of_its_run_and_of_every_kind_of_step_within_a_factor_of_two() {
    for (folder, cell, procedure) in [
        ("teachmover", "cell.yaml", "initialize"),
        ("light-stripe", "cell.yaml", "scan-pyramid"),
        ("light-stripe", "cell.yaml", "exposure-delay"),
        ("light-stripe", "cell.yaml", "calibrate-rig"),
        ("light-stripe", "cup.yaml", "scan-cup"),
        ("so101", "cell.yaml", "calibrate"),
    ] {
        let plan = planned(&Lab::of(folder), cell, procedure);
        let (mut least, mut off) = (BTreeMap::new(), Vec::new());
        for _ in 0..RUNS {
            for (step, seconds) in taken(&Lab::of(folder), cell, procedure) {
                let known = least.entry(step).or_insert(seconds);
                *known = known.min(seconds);
            }
            let (times, whole) = by_kind(&plan, &least);
            off = times.into_iter().chain([("the whole".to_owned(), whole)]).filter(is_off).collect();
            if off.is_empty() {
                break;
            }
        }
        assert_eq!(off, [], "{folder}/{cell} {procedure}: kinds of steps, s guessed and taken");
    }
}

#[test]
fn what_a_condition_known_before_the_run_leaves_out_takes_no_time() {
    let lab = Lab::new();
    let plan = |cycles: &str| -> Value {
        let output = lab.plumb(&["run", "cell.yaml", "--dry-run", "--json", "--set", cycles]);
        serde_json::from_str(&output.out()).unwrap()
    };
    let plan = plan("cycles=1");
    let mut steps = plan["steps"].as_array().unwrap().iter();
    let last = steps.rfind(|step| step["step"] == "shoulder_elbow.cycle[2].back").unwrap();
    assert_eq!(
        (&last["is_left_out"], &last["estimate_s"]),
        (&Value::Bool(true), &Value::from(0.0)),
        "{last}"
    );
    let output = lab.plumb(&["run", "cell.yaml", "--dry-run", "--set", "cycles=1"]);
    assert!(output.out().contains("only when cycle.turn <= cycles, which does not hold"), "{}", output.out());
}

#[test]
fn a_plan_says_where_a_hand_would_go_and_uses_values_that_are_worked_out() {
    let lab = Lab::of("light-stripe");
    let plan = lab.plumb(&["run", "cell.yaml", "exposure-delay", "--dry-run"]);
    assert_eq!(plan.code(), 0, "{}", plan.all());
    assert!(plan.out().contains("moves arm's hand along a line from ["), "{}", plan.out());
    assert!(!plan.out().contains("known in the run"), "{}", plan.out());
}

#[test]
fn a_plan_whose_repetition_ends_nobody_knows_when_gives_the_least_time_and_the_most() {
    let lab = Lab::new();
    let plan = planned(&lab, "cell.yaml", "oscillating-initialization");
    let (least, most) = (plan["least_s"].as_f64().unwrap(), plan["estimate_s"].as_f64().unwrap());
    let (_, (_, taken)) = by_kind(&plan, &taken(&lab, "cell.yaml", "oscillating-initialization"));
    assert!(least < taken && taken < most, "{least:.1} s to {most:.1} s guessed, {taken:.1} s taken");
    let output = lab.plumb(&["run", "cell.yaml", "oscillating-initialization", "--dry-run"]);
    let turns = &plan["repetitions"][0];
    assert!(turns["turns"].as_u64().unwrap() > 1 && turns["turn_s"].as_f64().unwrap() > 1.0, "{turns}");
    for words in [", by how soon a repetition ends (", ": 1 to ", " turns of about ", "), prompts left out"] {
        assert!(output.out().contains(words), "{words}: {}", output.out());
    }
    // Where every turn is known, there is one time.
    let output = lab.plumb(&["run", "cell.yaml", "--dry-run"]);
    assert!(output.out().contains("; about ") && !output.out().contains("by how soon"), "{}", output.out());
}
