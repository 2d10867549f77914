//! A camera on the wrist of a real arm, from a public set (`tests/data/hand_eye/README.md`), beside least squares by another program.
//!
//! The wrist was published as poses, not as joints: the model `poses` carries them out.

use plumb_calibration::template::Template;
use plumb_diagnosis::laboratory::Options;
use plumb_diagnosis::split::Holdout;
use plumb_estimation::Progress;

use super::made_up::laboratory;

const TABLE: &str = include_str!("../data/hand_eye/robot_cal_tools.csv");

/// By scipy 1.17 `least_squares` on the same residuals with these sigmas, started from OpenCV's Park and Martin: the camera on the wrist and the board in
/// the base, mm, with their standard errors.
const NOISE: &str = "{board_mm: 4.461199, board_deg: 1.438619}";
const CAMERA: ([f64; 3], [f64; 3]) = ([-56.8987, 35.7781, 71.2785], [5.778, 6.862, 3.264]);
const BOARD: ([f64; 3], [f64; 3]) = ([705.7143, 4.1326, 16.1805], [4.535, 4.474, 3.478]);

/// The template, with a board that its point sees, and this noise.
fn model(noise: &str) -> String {
    let template = Template::of("poses").unwrap().model;
    let camera = template.replace("# board: {seen_by: p1}", "board: {seen_by: p1}");
    assert!(camera.contains("\nboard: {seen_by: p1}"));
    format!("{camera}noise: {noise}\n")
}

#[test]
fn a_public_set_gives_what_another_program_finds_and_as_sure() {
    let mut options = Options { holdout: Holdout::None, ..Options::default() };
    options.fit.robust = false;
    let lab = laboratory(&model(NOISE), TABLE, options);
    let found = lab.compare(&Progress::unwatched()).unwrap();
    for (name, (position, errors)) in [("p1", CAMERA), ("board", BOARD)] {
        let placed = found.placed.iter().find(|placed| placed.name == name).unwrap();
        let se = placed.se_mm.map(Option::unwrap);
        let near = |axis: usize| (placed.xyz_mm[axis] - position[axis]).abs() < 0.02;
        assert!((0..3).all(near), "{placed:?} {position:?}");
        let as_sure = |axis: usize| (se[axis] / errors[axis] - 1.0).abs() < 0.3;
        assert!((0..3).all(as_sure), "{placed:?} {errors:?}");
    }
}

#[test]
fn a_public_set_without_declared_noise_is_as_sure_as_it_scatters() {
    let options = Options { holdout: Holdout::None, ..Options::default() };
    let found = laboratory(&model("{}"), TABLE, options).compare(&Progress::unwatched()).unwrap();
    // The closed forms of OpenCV on these pictures lie 30 mm apart from each other.
    let camera = found.placed.iter().find(|placed| placed.name == "p1").unwrap();
    for (found, other) in camera.xyz_mm.iter().zip(CAMERA.0) {
        assert!((found - other).abs() < 20.0, "{camera:?}");
    }
    assert!(camera.se_mm.iter().all(|se| (0.3..12.0).contains(&se.unwrap())), "{camera:?}");
    let noise = found.noise.iter().find(|noise| noise.reading == "board_deg").unwrap();
    assert!(noise.sigma < 1.6, "{noise:?}");
}
