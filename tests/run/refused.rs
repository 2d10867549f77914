//! Runs that do not start, or end before anything moves.

use crate::lab::Lab;

#[test]
fn a_start_outside_the_tolerance_is_refused_with_the_reason() {
    let lab = Lab::new();
    lab.edit("answers.yaml", "place: done", "place: {pose_deg: {shoulder: 50, elbow: -65}}");
    let run = lab.plumb(&["run", "cell.yaml"]);
    assert_eq!(run.code(), 1, "{}", run.all());
    assert!(run.out().contains("The forearm is at 295.00 degrees"), "{}", run.out());
    assert!(run.out().contains("270 +- 17.25 degrees"), "{}", run.out());
    assert!(!run.out().contains("waist.lower"), "nothing was searched");
}

#[test]
fn a_hand_that_does_not_point_straight_down_is_noticed_before_anything_moves() {
    let lab = Lab::new();
    lab.edit("world-ideal.yaml", "wrist_pitch_deg: -90", "wrist_pitch_deg: -83");
    let run = lab.plumb(&["run", "cell.yaml"]);
    assert_eq!(run.code(), 1, "{}", run.all());
    assert!(
        run.out().contains("The hand points 7.00 degrees from straight down, more than 1"),
        "{}",
        run.out()
    );
    assert!(!run.out().contains("waist.lower"), "nothing was searched");
}

#[test]
fn a_step_over_its_time_limit_by_the_clock_of_a_world_that_runs_ahead_ends_the_run() {
    let lab = Lab::new();
    lab.edit("procedures/waist-initialization.yaml", "time_limit_s: 300", "time_limit_s: 0.2");
    let run = lab.plumb(&["run", "cell.yaml", "--pace", "fast"]);
    assert_eq!(run.code(), 2, "{}", run.all());
    assert!(run.out().contains("its time limit of 0.2 s has passed by the cell's clock"), "{}", run.out());
    // A step that holds others has no number, and no brackets for one.
    let frame = run.out();
    let frame = frame.lines().find(|line| line.contains(" waist: ERROR")).unwrap_or_default();
    assert!(!frame.is_empty() && !frame.contains('['), "{}", run.out());
}

#[test]
fn nobody_runs_a_taught_program_unattended() {
    let lab = Lab::new();
    let run = lab.plumb(&["run", "cell-taught.yaml", "--headless"]);
    assert_eq!(run.code(), 4, "{}", run.all());
    assert!(run.err().contains("no answers are given for `run`"), "{}", run.err());
}

#[test]
fn a_missing_answer_ends_with_four_before_anything_starts() {
    let lab = Lab::new();
    lab.edit("answers.yaml", "  hand: done\n", "");
    let run = lab.plumb(&["run", "cell.yaml"]);
    assert_eq!(run.code(), 4, "{}", run.all());
    assert!(run.err().contains("no answers are given for `hand`"), "{}", run.err());
    assert!(lab.plumb(&["history"]).out().contains("no runs"));
}

#[test]
fn an_answer_of_the_wrong_kind_is_shown_where_it_is_written_and_ends_with_two() {
    let lab = Lab::new();
    lab.edit("answers.yaml", "hand: done", "hand: 12");
    let run = lab.plumb(&["run", "cell.yaml"]);
    assert_eq!(run.code(), 2, "{}", run.all());
    assert!(run.err().contains("this is no answer to the prompt of step `hand`"), "{}", run.err());
    assert!(run.err().contains("    5 |   hand: 12"), "{}", run.err());
}

#[test]
fn an_answer_out_of_range_ends_with_two_and_says_the_range() {
    let lab = Lab::new();
    let step =
        "  - {id: gauge, do: {prompt: {text: How high?, number: {unit: mm, minimum: 2, maximum: 20}}}}\n";
    lab.write("procedures/gauge.yaml", &format!("procedure: gauge\nsteps:\n{step}"));
    lab.edit("cell.yaml", "procedures: [", "procedures: [procedures/gauge.yaml, ");
    lab.write("gauge-answers.yaml", "answers: {gauge: 25}\n");
    let run = lab.plumb(&["run", "cell.yaml", "gauge", "--answers", "gauge-answers.yaml"]);
    assert_eq!(run.code(), 2, "{}", run.all());
    let output = "25 mm is out of range: it lies between 2 and 20 mm";
    assert!(run.err().contains("gauge-answers.yaml:1:18: ") && run.err().contains(output), "{}", run.err());
    // A range that is worked out is known in the run.
    lab.edit("procedures/gauge.yaml", "maximum: 20", "maximum: 4 * 5");
    let run = lab.plumb(&["run", "cell.yaml", "gauge", "--answers", "gauge-answers.yaml"]);
    assert_eq!(run.code(), 2, "{}", run.all());
    assert!(run.out().contains(output), "{}", run.out());
}

#[test]
fn a_pose_out_of_the_joints_range_is_refused_and_nothing_moves() {
    let lab = Lab::new();
    lab.edit("answers.yaml", "place: done", "place: {pose_deg: {waist: 120}}");
    let run = lab.plumb(&["run", "cell.yaml"]);
    assert_eq!(run.code(), 2, "{}", run.all());
    assert!(
        run.out().contains("waist would go to 120.000 deg; it goes from -90.000 to 90.000 deg"),
        "{}",
        run.out()
    );
}

#[test]
fn mistakes_in_any_file_end_with_two_and_nothing_is_written_down() {
    let lab = Lab::new();
    lab.edit("procedures/initialize.yaml", "Br_deg: Br_deg", "Br_deg: Brr_deg");
    let run = lab.plumb(&["run", "cell.yaml"]);
    assert_eq!(run.code(), 2, "{}", run.all());
    assert!(run.err().contains("there is no value `Brr_deg` here"), "{}", run.err());
    assert!(run.err().contains("did you mean `Br_deg`?"), "{}", run.err());
    assert!(lab.plumb(&["history"]).out().contains("no runs"));
}

#[test]
fn an_unknown_plugin_or_stream_is_shown_in_the_cell_file() {
    let lab = Lab::new();
    lab.edit("cell.yaml", "{line: arm/inputs}", "{line: arm/input}");
    lab.edit("cell.yaml", "plugin: ir-proximity", "plugin: ir-proximty");
    let check = lab.plumb(&["check", "cell.yaml"]);
    assert_eq!(check.code(), 2, "{}", check.all());
    assert!(check.err().contains("there is no plugin 'ir-proximty'"), "{}", check.err());
    lab.edit("cell.yaml", "plugin: ir-proximty", "plugin: ir-proximity");
    let check = lab.plumb(&["check", "cell.yaml"]);
    assert!(check.err().contains("device `arm` has no stream `input`"), "{}", check.err());
    assert!(check.err().contains("did you mean `inputs`?"), "{}", check.err());
}

#[test]
fn an_unknown_parameter_or_procedure_or_run_is_named_with_what_there_is() {
    let lab = Lab::new();
    let run = lab.plumb(&["run", "cell.yaml", "--set", "Br_dge=5"]);
    assert_eq!(run.code(), 2, "{}", run.all());
    assert!(run.err().contains("no parameter `Br_dge`: did you mean `Br_deg`?"), "{}", run.err());
    let run = lab.plumb(&["run", "cell.yaml", "initialise"]);
    assert_eq!(run.code(), 2, "{}", run.all());
    assert!(run.err().contains("no procedure `initialise`: did you mean `initialize`?"), "{}", run.err());
    let show = lab.plumb(&["show", "7"]);
    assert_eq!(show.code(), 2, "{}", show.all());
    assert!(show.err().contains("there is no run 7"), "{}", show.err());
    let resume = lab.plumb(&["run", "--resume"]);
    assert_eq!(resume.code(), 2, "{}", resume.all());
    assert!(resume.err().contains("no interrupted run to resume"), "{}", resume.err());
    let set = lab.plumb(&["run", "cell.yaml", "--set", "Br_deg=200"]);
    assert_eq!(set.code(), 2, "{}", set.all());
    assert!(set.err().contains("`Br_deg` is 200; it lies between 1 and 15"), "{}", set.err());
}

#[test]
fn a_world_file_with_a_mistake_is_reported_by_the_check_and_by_the_run() {
    let lab = Lab::new();
    lab.edit("world-ideal.yaml", "solid: true", "sollid: true");
    for command in ["check", "run"] {
        let output = lab.plumb(&[command, "cell.yaml"]);
        assert_eq!(output.code(), 2, "{}", output.all());
        assert!(output.err().contains("sollid"), "{}", output.err());
    }
}
