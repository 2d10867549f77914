//! Linear axes through `plumb model`: waves of screws, maps of the positioning error, and how they leave for LinuxCNC.

use crate::lab::{CommandOutput, Lab};

/// One slide of 200 mm on a screw of 5 mm a turn, read along its travel.
const AXIS: &str = "arm: axis
convention: distal
joints: [{name: x, slides: true, limits_mm: [0, 200], screw_pitch_mm: 5}]
base: {xyz_mm: [0, 0, 0], rpy_deg: [0, 90, 0], free: false}
targets: {p1: {xyz_mm: [0, 0, 0], free: false}}
free: [joint_zero(x)]
noise: {p1_mm: 0.002}
";

/// Play of the axis, mm.
const PLAY: f64 = 0.024;

/// Its positioning error: wound unevenly, like no effect of the library, mm.
fn error(x: f64) -> f64 {
    0.03 * (x / 21.0).sin() + 0.02 * (x / 31.0 + 0.7).cos()
}

/// What looks like chance, between -1 and 1 and never the same twice.
fn scatter(number: u32) -> f64 {
    2.0 * ((f64::from(number) * 78.233).sin() * 43_758.545_3).fract()
}

/// Targets from 0 to 200 mm in a pattern, five cycles there and back.
fn iso_table(target: impl Fn(u32) -> f64, count: u32) -> String {
    let mut text = "q1_mm,approach_q1,repeat,p1_x_mm\n".to_owned();
    let mut number = 0;
    for _ in 0..5 {
        let there = (0..count).map(|index| (index, 1.0));
        for (index, side) in there.chain((0..count).rev().map(|index| (index, -1.0))) {
            number += 1;
            let x = target(index);
            let read = x + error(x) - side * PLAY / 2.0 + 0.0015 * scatter(number);
            text.push_str(&format!("{x},{side},t{index},{read:.5}\n"));
        }
    }
    text
}

/// Eleven targets, none a whole number of pitches from the next.
fn uneven(index: u32) -> f64 {
    let x = 20.0 * f64::from(index) + if (1..10).contains(&index) { 1.9 * scatter(100 + index) } else { 0.0 };
    (x * 100.0).round() / 100.0
}

fn lab(table: &str) -> Lab {
    let lab = Lab::of("ur5");
    lab.write("axis.yaml", AXIS);
    lab.write("axis.csv", table);
    lab
}

fn model(lab: &Lab, arguments: &[&str]) -> CommandOutput {
    lab.plumb(&[&["model"], arguments].concat())
}

/// The lines of a compensation file: nominal, forward, reverse.
fn lines(text: &str) -> Vec<[f64; 3]> {
    let line = |line: &str| -> [f64; 3] {
        line.split(' ').map(|word| word.parse().unwrap()).collect::<Vec<f64>>().try_into().unwrap()
    };
    text.lines().map(line).collect()
}

/// What LinuxCNC takes off at a position, by straight lines between the file's lines.
fn correction(lines: &[[f64; 3]], at: f64, side: usize) -> f64 {
    let pair = lines.windows(2).find(|pair| (pair[0][0]..=pair[1][0]).contains(&at)).unwrap();
    let of = |line: &[f64; 3]| line[side] - line[0];
    of(&pair[0]) + (of(&pair[1]) - of(&pair[0])) * (at - pair[0][0]) / (pair[1][0] - pair[0][0])
}

/// The compensated axis misses by so much at most, at the measured targets.
fn worst_after(text: &str) -> f64 {
    let lines = lines(text);
    let mut worst = 0.0_f64;
    for target in (0..11).map(uneven) {
        for (side, sign) in [(1, 1.0), (2, -1.0)] {
            let off = error(target) - sign * PLAY / 2.0;
            worst = worst.max((off - correction(&lines, target, side)).abs());
        }
    }
    worst
}

#[test]
fn an_axis_measured_after_iso_230_2_is_named_mapped_and_compensated_in_linuxcnc() {
    let lab = lab(&iso_table(uneven, 11));
    let grown = model(&lab, &["grow", "axis.yaml", "--data", "axis.csv"]);
    assert!(
        grown.out().contains("joint_backlash(x)") && grown.out().contains("residual_map"),
        "{}",
        grown.all()
    );
    let written = model(&lab, &["export", "axis.yaml", "--as", "linuxcnc"]);
    assert_eq!(written.code(), 0, "the map of one axis is its own positioning error: {}", written.all());
    let worst = worst_after(&written.out());
    assert!(worst < 0.004, "{worst} mm of 0.06 are left");
}

#[test]
fn the_positioning_error_is_added_by_name_and_leaves_as_the_same_table() {
    let lab = lab(&iso_table(uneven, 11));
    let added = model(&lab, &["add", "axis.yaml", "joint_backlash(x)", "--data", "axis.csv"]);
    assert_eq!(added.code(), 0, "{}", added.all());
    let added = model(&lab, &["add", "axis.yaml", "positioning_error(x, 10)", "--data", "axis.csv"]);
    assert_eq!(added.code(), 0, "{}", added.all());
    // From the least to the greatest of 0.03 sin + 0.02 cos at the knots.
    let errors: Vec<f64> = (0..=10).map(|knot| error(20.0 * f64::from(knot))).collect();
    let (least, greatest) =
        (errors.iter().copied().fold(1.0, f64::min), errors.iter().copied().fold(-1.0, f64::max));
    let size: f64 = added
        .out()
        .lines()
        .find_map(|line| {
            line.split("positioning_error(x, 10)").nth(1)?.split_whitespace().next()?.parse().ok()
        })
        .unwrap_or_else(|| panic!("a size: {}", added.out()));
    assert!((size - (greatest - least)).abs() < 0.004, "{size} of {}", greatest - least);
    let written = model(&lab, &["export", "axis.yaml", "--as", "linuxcnc", "--lines", "11"]);
    assert_eq!(written.code(), 0, "{}", written.all());
    let worst = worst_after(&written.out());
    assert!(worst < 0.004, "{worst} mm of 0.06 are left");
}

#[test]
fn a_wave_finer_than_a_compensation_files_lines_is_not_left_out_in_silence() {
    let lab = lab("");
    lab.write(
        "wave.yaml",
        &format!("{AXIS}effects: [{{effect: screw_wave, where: x, n: 1, values: {{sine_mm: 0.01, cosine_mm: 0.004}}}}]\n"),
    );
    let refused = model(&lab, &["export", "wave.yaml", "--as", "linuxcnc"]);
    assert_eq!((refused.code(), refused.out().as_str()), (2, ""));
    assert!(
        refused.err().contains("screw_wave(x, 1) (its period is 5 mm and the file's lines are 2.000 mm apart; 0.625 would do, and LinuxCNC takes at most 256 lines)"),
        "{}",
        refused.err()
    );
    lab.edit("wave.yaml", "limits_mm: [0, 200]", "limits_mm: [0, 100]");
    let written = model(&lab, &["export", "wave.yaml", "--as", "linuxcnc", "--lines", "201"]);
    assert_eq!(written.code(), 0, "{}", written.all());
    let at = lines(&written.out())[1];
    let angle = std::f64::consts::TAU * 0.1;
    assert!((at[1] - 0.5 - 0.01 * angle.sin() - 0.004 * angle.cos()).abs() < 2e-6, "{at:?}");
}

#[test]
fn positions_at_whole_pitches_are_said_to_hide_the_screws_wave() {
    let lab = lab(&iso_table(|index| 20.0 * f64::from(index), 11));
    let output = model(&lab, &["diagnose", "axis.yaml", "--data", "axis.csv"]);
    let note = "screw_wave(x, 1) cannot be identified: at the positions of x that were measured, whole pitches apart, it is the same everywhere";
    assert!(output.code() == 0 && output.out().contains(note), "{}", output.all());
    let refused = model(&lab, &["add", "axis.yaml", "screw_wave(x, 1)", "--data", "axis.csv"]);
    assert!(refused.code() == 2 && refused.err().contains(note), "{}", refused.all());
    assert!(refused.err().contains("1.25 mm apart over 10.0 mm"), "{}", refused.err());
}

#[test]
fn bad_pitches_maps_and_columns_are_refused_with_what_would_be_right() {
    let lab = lab(&iso_table(uneven, 6));
    let add = |lab: &Lab, effect: &str| model(lab, &["add", "axis.yaml", effect, "--data", "axis.csv"]);
    // Six targets end at 100 mm of 200.
    let hole = add(&lab, "positioning_error(x, 10)");
    assert!(
        hole.code() == 2
            && hole.err().contains("x was not measured near the middle of")
            && hole.err().contains("take fewer pieces"),
        "{}",
        hole.all()
    );
    let pieces = add(&lab, "positioning_error(x, 1.5)");
    assert!(
        pieces.code() == 2 && pieces.err().contains("number of straight pieces, 1 to 255"),
        "{}",
        pieces.all()
    );
    lab.edit("axis.yaml", ", screw_pitch_mm: 5", "");
    let unknown = add(&lab, "screw_wave(x, 1)");
    assert!(unknown.code() == 2 && unknown.err().contains("as in `screw_pitch_mm: 5`"), "{}", unknown.all());
    for (from, to, sentence) in [
        (
            "limits_mm: [0, 200]",
            "limits_mm: [0, 200], screw_pitch_mm: 0",
            "it is the travel for one turn of the screw, more than 0",
        ),
        ("screw_pitch_mm: 0", "screw_pitch_mm: -5", "a pitch of -5 mm cannot be"),
        (
            "slides: true, limits_mm: [0, 200], screw_pitch_mm: -5",
            "screw_pitch_mm: 5",
            "screw_pitch_mm is of a joint that slides",
        ),
    ] {
        lab.edit("axis.yaml", from, to);
        let refused = model(&lab, &["compare", "axis.yaml", "--data", "axis.csv"]);
        assert!(refused.code() == 2 && refused.err().contains(sentence), "{}", refused.all());
    }
    lab.write("axis.yaml", AXIS);
    lab.edit("axis.csv", "q1_mm", "q1_deg");
    let degrees = model(&lab, &["compare", "axis.yaml", "--data", "axis.csv"]);
    assert!(degrees.code() == 2 && degrees.err().contains("mm"), "{}", degrees.all());
}

#[test]
fn what_an_axis_of_ones_own_would_show_of_a_screw_out_of_true_is_tried_in_its_own_table() {
    let lab = lab(&iso_table(|index| f64::from(index) * 3.3 + scatter(index), 58));
    lab.edit("axis.csv", "repeat,", "note,");
    let tried = lab.plumb(&[
        "trial",
        "inject",
        "axis.yaml",
        "--data",
        "axis.csv",
        "--effect",
        "screw_wave(x, 1)",
        "--size",
        "0.02mm",
        "-o",
        "hidden",
    ]);
    assert_eq!(tried.code(), 0, "{}", tried.all());
    assert!(tried.out().contains("screw_wave"), "{}", tried.all());
    let made = lab.plumb(&["trial", "new", "--seed", "1", "--arm", "axis.yaml", "-o", "other"]);
    assert!(made.code() == 2 && made.err().contains("joint `x` slides"), "{}", made.all());
}

/// What looks like normal chance, of standard deviation about 1.
fn chance(number: u32) -> f64 {
    (scatter(number) + scatter(number + 1009) + scatter(number + 2003)) / 2.0
}

/// Eight positions, five cycles. Play differs from position to position, um.
fn uneven_play(play: [f64; 8]) -> String {
    let mut text = "q1_mm,approach_q1,repeat,p1_x_mm\n".to_owned();
    let mut number = 0;
    for _ in 0..5 {
        for (index, side) in (0..8).map(|index| (index, 1.0)).chain((0..8).rev().map(|index| (index, -1.0))) {
            number += 1;
            let x = 25.0 * f64::from(index);
            let read = x + error(x) - side * play[index as usize] / 2000.0 + 0.0015 * chance(number);
            text.push_str(&format!("{x},{side},t{index},{read:.5}\n"));
        }
    }
    text
}

#[test]
fn play_that_differs_from_position_to_position_is_not_called_settling() {
    // As on axis y of a muon target's positioner (ecmc_target_muts_logger, b02/y, 2022): smaller at both ends. There the row before is at the same position, so
    // by the rows alone settling would halve what play does.
    let lab = lab(&uneven_play([9.0, 12.0, 14.0, 13.0, 12.0, 20.0, 20.0, 8.0]));
    let output = model(&lab, &["diagnose", "axis.yaml", "--data", "axis.csv"]);
    assert_eq!(output.code(), 0, "{}", output.all());
    let sentence = "TIED. joint_settling(x) and joint_backlash(x) cannot be distinguished with these data: what depends on the direction of arrival differs from pose to pose by 0.002";
    assert!(output.out().contains(sentence), "{}", output.all());
    let grown = model(&lab, &["grow", "axis.yaml", "--data", "axis.csv"]);
    assert!(!grown.out().contains("+ joint_settling"), "{}", grown.all());
    let written = model(&lab, &["export", "axis.yaml", "--as", "linuxcnc"]);
    assert_eq!(written.code(), 0, "nothing has to be left out: {}", written.all());
}

#[test]
fn play_that_differs_but_is_play_at_the_ends_too_is_named_with_the_error_of_its_average() {
    let play = [33.0, 31.0, 22.0, 14.0, 20.0, 34.0, 29.0, 33.0];
    let lab = lab(&uneven_play(play));
    let output = model(&lab, &["diagnose", "axis.yaml", "--data", "axis.csv", "--json"]);
    assert_eq!(output.code(), 0, "{}", output.all());
    let output: serde_json::Value = serde_json::from_str(&output.out()).unwrap();
    assert_eq!(
        (&output["verdict"], &output["named"]["effect"]),
        (&"named".into(), &"joint_backlash".into()),
        "{output}"
    );
    assert!(output["sentence"].as_str().unwrap().contains("on the average of the poses"), "{output}");
    // The error of a mean of eight that scatter so: 7.4 um over the root of 8.
    let (size, se) = (output["named"]["size"].as_f64().unwrap(), output["named"]["se"].as_f64().unwrap());
    assert!((size - 0.027).abs() < 0.001 && (0.7..1.4).contains(&(se / 0.0026)), "{size} +- {se}");
}

#[test]
fn a_zero_that_jumped_is_an_event_that_a_compensation_file_goes_without() {
    let lab = lab("");
    let effects = "effects: [{effect: joint_backlash, where: x, values: {play_mm: 0.02}}, {effect: joint_step, where: x, searched: 100, values: {step_mm: 0.5}}]\n";
    lab.write("step.yaml", &format!("{AXIS}{effects}"));
    let written = model(&lab, &["export", "step.yaml", "--as", "linuxcnc"]);
    assert_eq!(written.code(), 0, "{}", written.all());
    // Half of the play behind, and nothing of the step.
    let first = lines(&written.out())[0];
    assert!(
        (first[1] - first[0] + 0.01).abs() < 1e-6 && (first[2] - first[0] - 0.01).abs() < 1e-6,
        "{first:?}"
    );
}
