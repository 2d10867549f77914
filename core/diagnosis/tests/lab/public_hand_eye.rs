//! A camera on the wrist of a real arm, from a public set (`tests/data/hand_eye/README.md`), beside least squares by another program.
//!
//! The wrist was published as poses, not as joints: an arm of three slides and three turns carries them out.

use plumb_diagnosis::laboratory::Options;
use plumb_diagnosis::split::Holdout;
use plumb_estimation::Progress;

use super::made_up::laboratory;

const TABLE: &str = include_str!("../data/hand_eye/robot_cal_tools.csv");

/// Its flange is the wrist turned by 90 deg about z.
const POSES: &str = "
arm: poses
convention: distal
joints:
  - {name: z, slides: true, alpha_deg: 90, theta_deg: 90}
  - {name: x, slides: true, alpha_deg: 90, theta_deg: 90}
  - {name: y, slides: true, alpha_deg: 90, theta_deg: 90}
  - {name: yaw, alpha_deg: -90}
  - {name: pitch, theta_deg: 90, alpha_deg: 90}
  - {name: roll, theta_deg: 90, alpha_deg: -90}
base: {free: false}
targets: {p1: {}}
board: {seen_by: p1}
free: []
noise: NOISE
";

/// By scipy 1.17 `least_squares` on the same residuals with these sigmas, started from OpenCV's Park and Martin: the camera on the wrist and the board in
/// the base, mm, with their standard errors.
const NOISE: &str = "{board_mm: 4.461199, board_deg: 1.438619}";
const CAMERA: ([f64; 3], [f64; 3]) = ([-56.8987, 35.7781, 71.2785], [5.778, 6.862, 3.264]);
const BOARD: ([f64; 3], [f64; 3]) = ([705.7143, 4.1326, 16.1805], [4.535, 4.474, 3.478]);

#[test]
fn a_public_set_gives_what_another_program_finds_and_as_sure() {
    let mut options = Options { holdout: Holdout::None, ..Options::default() };
    options.fit.robust = false;
    let lab = laboratory(&POSES.replace("NOISE", NOISE), TABLE, options);
    let found = lab.compare(&Progress::unwatched()).unwrap();
    let placed = |name: &str| found.placed.iter().find(|placed| placed.name == name).unwrap();
    let (camera, board) = (placed("p1"), placed("board"));
    // From the flange's axes back to the wrist's.
    let [x, y, z] = camera.xyz_mm;
    let [se_x, se_y, se_z] = camera.se_mm.map(Option::unwrap);
    for (found, (place, errors)) in
        [(([-y, x, z], [se_y, se_x, se_z]), CAMERA), ((board.xyz_mm, board.se_mm.map(Option::unwrap)), BOARD)]
    {
        for axis in 0..3 {
            assert!((found.0[axis] - place[axis]).abs() < 0.02, "{found:?} {place:?}");
            assert!((found.1[axis] / errors[axis] - 1.0).abs() < 0.3, "{found:?} {errors:?}");
        }
    }
}

#[test]
fn a_public_set_without_declared_noise_is_as_sure_as_it_scatters() {
    let lab = laboratory(
        &POSES.replace("NOISE", "{}"),
        TABLE,
        Options { holdout: Holdout::None, ..Options::default() },
    );
    let found = lab.compare(&Progress::unwatched()).unwrap();
    // Closed forms of OpenCV on these pictures lie 30 mm apart from each other.
    let camera = found.placed.iter().find(|placed| placed.name == "p1").unwrap();
    let [x, y, z] = camera.xyz_mm;
    let se = camera.se_mm.map(Option::unwrap);
    for (found, other) in [-y, x, z].iter().zip(CAMERA.0) {
        assert!((found - other).abs() < 20.0, "{camera:?}");
    }
    assert!(se.iter().all(|se| (0.3..12.0).contains(se)), "{camera:?}");
    assert!(
        found.noise.iter().any(|noise| noise.reading == "board_deg" && noise.sigma < 1.6),
        "{:?}",
        found.noise
    );
}
