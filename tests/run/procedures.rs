//! Every procedure of the TeachMover's cells, run as its user would, in the simulated cell.

use crate::lab::Lab;

/// Corrections a run put in force: joint and value.
fn found(lab: &Lab, cell: &str, procedure: &str, within_deg: f64) {
    let run = lab.plumb(&["run", cell, procedure]);
    assert_eq!(run.code(), 0, "{procedure}: {}", run.all());
    for (joint, truth) in [("waist", 1.7), ("shoulder", -2.4), ("elbow", 1.3)] {
        let zeros = lab.zeros("1");
        let zero = zeros.iter().find(|(name, _)| name == joint).map_or(f64::NAN, |(_, value)| *value);
        assert!((zero - truth).abs() < within_deg, "{procedure}, {joint}: found {zero}, true {truth}");
    }
}

#[test]
fn the_reviewers_way_finds_the_true_zeros_of_an_ideal_arm() {
    found(&Lab::new(), "cell.yaml", "height-and-radius-initialization", 1e-6);
}

#[test]
fn the_way_at_constant_height_finds_them_as_well_as_its_strokes_allow() {
    found(&Lab::new(), "cell.yaml", "oscillating-initialization", 0.05);
}

#[test]
fn the_manuals_grid_finds_them_when_the_operators_eye_is_perfect() {
    found(&Lab::new(), "cell.yaml", "grid-initialization", 1e-6);
}

#[test]
fn an_eye_that_is_half_a_millimetre_off_shows_in_the_waist() {
    let lab = Lab::new();
    lab.edit("world-ideal.yaml", "sensor:\n", "instruments: {eye: {error_mm: 0.5}}\nsensor:\n");
    let run = lab.plumb(&["run", "cell.yaml", "grid-initialization"]);
    assert_eq!(run.code(), 0, "{}", run.all());
    let waist =
        lab.zeros("1").into_iter().find(|(name, _)| name == "waist").map_or(f64::NAN, |(_, value)| value);
    assert!((1e-3..2.0).contains(&(waist - 1.7).abs()), "waist: found {waist}");
}

#[test]
fn the_waist_found_at_a_constant_radius_is_the_true_one() {
    let lab = Lab::new();
    let run = lab.plumb(&["run", "cell.yaml", "waist-initialization-precise"]);
    assert_eq!(run.code(), 0, "{}", run.all());
    let zeros = lab.zeros("1");
    assert!((zeros[0].1 - 1.7).abs() < 1e-6, "{zeros:?}");
}

#[test]
fn what_is_set_by_hand_is_asked_for_and_a_tilted_hand_is_sent_back() {
    let lab = Lab::new();
    let run = lab.plumb(&["run", "cell-worn.yaml", "pre-initialization"]);
    assert_eq!(run.code(), 0, "{}", run.all());
    assert!(run.out().contains("Hand vertical: answered: "), "{}", run.out());
    lab.edit("world-worn.yaml", "wrist_pitch_deg: -90,", "wrist_pitch_deg: -87,");
    let run = lab.plumb(&["run", "cell-worn.yaml", "pre-initialization"]);
    assert_eq!(run.code(), 1, "{}", run.all());
    assert!(
        run.all().contains("The hand is 3.00 degrees from vertical, more than 1: bring it upright"),
        "{}",
        run.all()
    );
}

/// A level that is read by itself in a simulated cell has to be read on a real arm: no number is offered there that Enter would take.
#[test]
fn no_procedure_offers_a_number_where_an_instrument_has_to_be_read() {
    let lab = Lab::new();
    let mut read = 0;
    for file in std::fs::read_dir(lab.path("procedures")).unwrap() {
        let path = file.unwrap().path();
        let text = std::fs::read_to_string(&path).unwrap();
        for prompt in text.split("prompt:").skip(1).filter(|prompt| prompt.contains("simulated: {read_")) {
            let offered = prompt.lines().find(|line| line.trim_start().starts_with("number:"));
            assert!(offered.is_none_or(|line| !line.contains("default")), "{}: {offered:?}", path.display());
            read += 1;
        }
    }
    assert!(read >= 2, "{read} prompts read an instrument");
}

#[test]
fn the_sensor_is_trimmed_to_the_gauge_and_distinguishes_white_from_table_and_black() {
    let lab = Lab::new();
    // Somebody has turned the trim: it would fire at 10 mm.
    lab.edit("world-worn.yaml", "trimmed_to_fire_at_mm: 8", "trimmed_to_fire_at_mm: 10");
    let run = lab.plumb(&["run", "cell-worn.yaml", "sensor-set-up"]);
    assert_eq!(run.code(), 0, "{}", run.all());
    let shown = lab.shown("1").to_string();
    let reading = |name: &str| {
        let at =
            shown.find(&format!("\"name\":\"{name}\"")).unwrap_or_else(|| panic!("no {name} in {shown}"));
        let rest = shown[at..].split_once("\"value\":").map_or("", |(_, rest)| rest);
        rest.split([',', '}']).next().and_then(|number| number.parse::<f64>().ok()).unwrap_or(f64::NAN)
    };
    assert!((reading("fires") - 8.0).abs() < 0.3, "fires at {}", reading("fires"));
    assert!((0.3..1.5).contains(&reading("hysteresis")), "hysteresis {}", reading("hysteresis"));
    assert!((0.3..4.0).contains(&reading("table_lower_by")), "table {}", reading("table_lower_by"));
    assert!(run.out().contains("eye stayed OFF"), "over the black: {}", run.out());
}

#[test]
fn ink_that_is_not_black_is_found_out_before_anything_relies_on_it() {
    let lab = Lab::new();
    lab.edit("world-worn.yaml", "black: 0.06", "black: 0.85");
    let run = lab.plumb(&["run", "cell-worn.yaml", "sensor-set-up"]);
    assert_eq!(run.code(), 1, "{}", run.all());
    assert!(run.all().contains("it fires over the black as well"), "{}", run.all());
}

#[test]
fn an_ideal_sensor_has_nothing_to_trim_and_the_run_says_so() {
    let lab = Lab::new();
    lab.edit("cell-worn.yaml", "world-worn.yaml", "world-ideal.yaml");
    let run = lab.plumb(&["run", "cell-worn.yaml", "sensor-set-up"]);
    assert_eq!(run.code(), 2, "{}", run.all());
    assert!(
        run.all()
            .contains("the simulated operator cannot do `trim_to_fire`: this sensor has no trim resistor"),
        "{}",
        run.all()
    );
}

#[test]
fn the_same_initialization_file_initializes_an_arm_of_other_lengths() {
    let lab = Lab::new();
    let run = lab.plumb(&["run", "cell-other-arm.yaml"]);
    assert_eq!(run.code(), 0, "{}", run.all());
    lab.assert_zeros_found("1");
}

#[test]
fn a_worn_arm_without_half_steps_is_led_past_its_trigger_until_the_sensor_is_sure() {
    // Noise without half-steps: back at its trigger pose the sensor is as likely off as on.
    let lab = Lab::new();
    lab.edit("world-worn.yaml", "resolution: half_step", "resolution: continuous");
    for seed in [3, 5, 7] {
        lab.edit(
            "world-worn.yaml",
            &format!("seed: {}", if seed == 3 { 1 } else { seed - 2 }),
            &format!("seed: {seed}"),
        );
        let run = lab.plumb(&["run", "cell-worn.yaml"]);
        assert_eq!(run.code(), 0, "seed {seed}: {}", run.all());
    }
}

#[test]
fn a_search_that_ends_between_two_half_steps_ends() {
    let lab = Lab::new();
    // 0.98 degrees are 19.25 half-steps of the shoulder: the last quarter of one is never made.
    lab.write(
        "procedures/short.yaml",
        "procedure: short\nsteps:\n  - id: lower\n    do: {search: {robot: arm, joint: shoulder, travel_deg: -0.98, until: {sensor: eye, is: \"on\"}}}\n    \
         time_limit_s: 60\n    on_error: abort\n",
    );
    lab.edit("cell-worn.yaml", "procedures: [", "procedures: [procedures/short.yaml, ");
    let run = lab.plumb(&["run", "cell-worn.yaml"]);
    assert_eq!(run.code(), 1, "{}", run.all());
    assert!(run.all().contains("eye stayed OFF while shoulder went from"), "{}", run.all());
}

#[test]
fn cycles_that_do_not_settle_are_refused_and_put_no_zeros_in_force() {
    // Trimmed on brighter paper, the sensor fires late and lets go of the paper itself on the way to line B.
    let lab = Lab::new();
    lab.edit(
        "world-ideal.yaml",
        "    zero_error",
        "    start_within: {waist_deg: 3, shoulder_deg: 3, elbow_deg: 5}\n    zero_error",
    );
    lab.edit("world-ideal.yaml", "world: TeachMover", "seed: 20\nworld: TeachMover");
    lab.edit("world-ideal.yaml", "sensor:\n", "    reflectance: {white: 0.81}\nsensor:\n");
    lab.edit(
        "world-ideal.yaml",
        "ideal: {height_mm: 8, release_height_mm: 10}",
        "spot: {diameter_mm: 4, peak_mm: 5, trimmed_to_fire_at_mm: 7.2, hysteresis_percent: 10}",
    );
    let run = lab.plumb(&["run", "cell.yaml"]);
    assert_eq!(run.code(), 1, "{}", run.all());
    assert!(run.all().contains("degrees of the elbow apart and do not settle"), "{}", run.all());
    assert!(lab.zeros("1").iter().all(|(joint, _)| joint == "waist"), "{:?}", lab.zeros("1"));
}
