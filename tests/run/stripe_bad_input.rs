//! Rig files and pictures that no point may come from.

use std::fs;

use crate::lab::Lab;

/// What a scan says of a rig file with these changes; it must end in an error and leave no cloud.
fn message_of(changes: &[(&str, &str)]) -> String {
    let lab = Lab::of("light-stripe");
    for (from, to) in changes {
        lab.edit("rig.yaml", from, to);
    }
    let output = lab.plumb(&["run", "cell.yaml", "scan-pyramid", "--headless", "--record", "record"]);
    assert_eq!(output.code(), 2, "{}", output.all());
    assert!(!lab.path("record/run-1/pyramid.ply").exists(), "a false cloud");
    // The lab reads the same file, and refuses it in the same words.
    fs::create_dir(lab.path("scans")).unwrap();
    let lab_said = lab.plumb(&["stripe", "diagnose", "cell.yaml", "--scans", "scans"]);
    assert!(lab_said.code() == 2 && lab_said.err().contains("rig.yaml"), "{}", lab_said.all());
    output.all()
}

const D: &str = "d_mm: -85.381496824546";

#[test]
fn a_lens_in_the_sheet_is_no_calibration() {
    let message = message_of(&[(D, "d_mm: 9.486833")]);
    assert!(message.contains("rig.yaml") && message.contains("mm from the sheet of light"), "{message}");
    assert!(message.contains("camera and projector stand side by side"), "{message}");
}

#[test]
fn a_plane_of_the_other_convention_is_recognised_and_the_cure_is_reported() {
    let message = message_of(&[(D, "d_mm: 85.381496824546")]);
    assert!(message.contains("the plane is of the convention n.x = d"), "{message}");
    let message = message_of(&[("convention: n.x + d = 0", "convention: n.x = d")]);
    assert!(message.contains("for `n.x = d` change the sign of d_mm"), "{message}");
}

#[test]
fn a_rig_in_metres_or_a_focal_length_in_millimetres_is_reported_as_such() {
    let message = message_of(&[
        ("[-30, 0, 60]", "[-0.03, 0, 0.06]"),
        (D, "d_mm: -0.085381496824546"),
        ("[-30, 0, 360]", "[-0.03, 0, 0.36]"),
    ]);
    assert!(message.contains("a file in metres is to be multiplied by 1000"), "{message}");
    let message = message_of(&[("fx_px: 694.4", "fx_px: 25")]);
    assert!(
        message.contains("fx_px and fy_px count in pixels; 25 mm behind pixels of 0.036 mm are 694 px"),
        "{message}"
    );
}

#[test]
fn a_calibration_that_contradicts_its_own_test_point_is_refused() {
    let message = message_of(&[("rpy_deg: [0, 0, 0]", "rpy_deg: [0, 1, 0]")]);
    assert!(message.contains("do not belong together"), "{message}");
}

#[test]
fn a_picture_that_comes_too_late_to_know_where_the_arm_was_gives_no_point() {
    let lab = Lab::of("light-stripe");
    // The camera's clock is a second behind: of its first picture nobody knows where the arm was then.
    lab.edit("world.yaml", "light:\n", "light:\n  exposure_delay_ms: 1000\n");
    lab.write(
        "procedures/extra.yaml",
        "procedure: extra\nsteps:\n  - {id: look, do: {measure: {sensor: stripe, trigger: camera}}, on_error: abort}\n",
    );
    lab.edit("cell.yaml", "procedures: [", "procedures: [procedures/extra.yaml, ");
    let output = lab.plumb(&["run", "cell.yaml", "extra", "--headless"]);
    assert_eq!(output.code(), 2, "{}", output.all());
    let words = "so late that where the robot was at its exposure is no longer known: it is dated 1.000 s before the first pose that is remembered; it is left out";
    assert!(output.all().contains(words), "{}", output.all());
}

const SIDE: usize = 256;

/// A cell whose pictures come from files.
const FROM_FILES: &str = "\
cell: light-stripe
world: {file: world.yaml, pace: fast}
devices:
  arm: {plugin: simulated, config: {arm: puma560}}
  stripe: {plugin: light-stripe, config: {rig: rig.yaml, frames: {folder: frames}, threshold: {fixed: 60}}}
robots:
  arm:
    joints: {waist: deg, shoulder: deg, elbow: deg, wrist_roll: deg, wrist_bend: deg, flange: deg}
    model: ../arms/puma560.yaml
procedures: [procedures/look.yaml]
";

const LOOK: &str = "\
procedure: look
steps:
  - id: scan
    do: {scan: {robot: arm, sensor: stripe, from_mm: [60, 530, -280], to_mm: [60, 530, -280], step_mm: 5, aim_mm: [-30, 0, 360], save: seen}}
    on_error: abort
";

/// A picture that is lit where this says, by column and row.
fn lit(is_lit: impl Fn(usize, usize) -> bool) -> Vec<u8> {
    let pixel = |at: usize| if is_lit(at % SIDE, at / SIDE) { 200 } else { 8 };
    (0..SIDE * SIDE).map(pixel).collect()
}

fn pgm(side: usize, pixels: &[u8]) -> Vec<u8> {
    [format!("P5\n{side} {side}\n255\n").as_bytes(), pixels].concat()
}

/// Looks at one picture: what the program says, and the columns of the points it keeps.
fn look_at(file: &str, bytes: &[u8]) -> (i32, String, Vec<f64>) {
    let lab = Lab::of("light-stripe");
    lab.write("cell.yaml", FROM_FILES);
    lab.write("procedures/look.yaml", LOOK);
    fs::create_dir(lab.path("frames")).unwrap();
    fs::write(lab.path("frames").join(file), bytes).unwrap();
    let output = lab.plumb(&["run", "cell.yaml", "look", "--headless", "--record", "record"]);
    let table = fs::read_to_string(lab.path("record/run-1/seen.stripes.csv")).unwrap_or_default();
    let column = |line: &str| line.split(',').nth(1).unwrap().parse().unwrap();
    (output.code(), output.all(), table.lines().skip(1).map(column).collect())
}

#[test]
fn a_picture_that_shows_no_stripe_says_why_and_gives_no_point() {
    let stripe = |column: usize| move |x: usize, _: usize| x.abs_diff(column) <= 1;
    let whole = pgm(SIDE, &lit(stripe(102)));
    let cases: [(&str, &str, Vec<u8>, &str); 9] = [
        ("empty", "a.pgm", pgm(SIDE, &lit(|_, _| false)), "(1 dark): is the laser on"),
        (
            "all white",
            "a.pgm",
            pgm(SIDE, &lit(|_, _| true)),
            "(1 too bright): is the filter before the lens?",
        ),
        (
            "two of equal height",
            "a.pgm",
            pgm(SIDE, &lit(|x, y| stripe(80)(x, y) || stripe(160)(x, y))),
            "(1 ambiguous): what else shines there?",
        ),
        (
            "lying flat",
            "a.pgm",
            pgm(SIDE, &lit(|_, y| y.abs_diff(128) <= 4)),
            "(1 flat): turn the rig so that the stripe runs down the picture",
        ),
        ("too short", "a.pgm", pgm(SIDE, &lit(|x, y| stripe(102)(x, y) && y < 5)), "(1 too short)"),
        (
            "another size",
            "a.pgm",
            pgm(128, &[8; 128 * 128]),
            "a picture of 128 x 128 pixels came; the rig's camera has 256 x 256",
        ),
        (
            "cut short",
            "a.pgm",
            whole[..60_000].to_vec(),
            "a.pgm: it is cut short: 59985 of 65536 pixels are there",
        ),
        ("no picture", "a.png", b"<html>".to_vec(), "a.png: "),
        (
            "an empty folder",
            "notes.txt",
            Vec::new(),
            "the folder holds no pictures that end in .pgm, .png or .raw",
        ),
    ];
    std::thread::scope(|scope| {
        for (what, file, bytes, expected) in &cases {
            scope.spawn(move || {
                let (code, message, points) = look_at(file, bytes);
                assert!(code == 2 && message.contains(expected), "{what}: {message}");
                assert!(points.is_empty(), "{what}: false points");
            });
        }
    });
}

#[test]
fn a_stripe_that_is_broken_or_has_a_spur_gives_the_points_of_the_stripe_alone() {
    let stripe = |x: usize| x.abs_diff(102) <= 1;
    let broken = lit(|x, y| stripe(x) && !(130..170).contains(&y));
    let (code, message, columns) = look_at("a.pgm", &pgm(SIDE, &broken));
    assert!(code == 0 && columns.len() == 130, "its taller piece: {} points, {message}", columns.len());
    let spur = lit(|x, y| stripe(x) || ((100..103).contains(&y) && (103..180).contains(&x)));
    let (code, message, columns) = look_at("a.pgm", &pgm(SIDE, &spur));
    assert!(code == 0 && columns.len() > 240, "{message}");
    assert!(columns.iter().all(|column| (column - 102.0).abs() < 1.0), "{columns:?}");
}

#[test]
fn a_scan_of_more_positions_than_there_are_pictures_says_so() {
    let lab = Lab::of("light-stripe");
    lab.write("cell.yaml", FROM_FILES);
    lab.write("procedures/look.yaml", &LOOK.replace("to_mm: [60,", "to_mm: [70,"));
    fs::create_dir(lab.path("frames")).unwrap();
    fs::write(lab.path("frames/a.pgm"), pgm(SIDE, &lit(|x, _| x == 102))).unwrap();
    let output = lab.plumb(&["run", "cell.yaml", "look", "--headless"]);
    assert!(
        output.code() == 2 && output.all().contains("frames: its only picture has been taken"),
        "{}",
        output.all()
    );
}
