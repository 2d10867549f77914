//! Orientations beside positions, and a camera on the hand that sees a board: joint zeros that positions cannot show, hand-eye from no start at all, slips of
//! convention, and motions that do not determine anything. The arm is worked out here by plain products of rotations and shifts.

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};
use plumb_calibration::arm_model::Model;
use plumb_calibration::file::model_text;
use plumb_diagnosis::Requested;
use plumb_diagnosis::laboratory::{Comparison, Laboratory, Options};
use plumb_diagnosis::split::Holdout;
use plumb_estimation::Progress;
use plumb_report::diagnosis_sentence;

use super::made_up::{Xorshift, laboratory, try_laboratory};

/// Length, twist (deg) and offset of each row: an arm of six joints whose last three axes meet.
const ROWS: [(f64, f64, f64); 6] = [
    (0.0, 90.0, 400.0),
    (350.0, 0.0, 0.0),
    (0.0, 90.0, 0.0),
    (0.0, -90.0, 300.0),
    (0.0, 90.0, 0.0),
    (0.0, 0.0, 80.0),
];

/// What the arm's zeros really are, deg.
const ZEROS: [f64; 6] = [0.0, 0.2, -0.15, 0.3, -0.25, 0.4];

pub(super) const ARM: &str = "
arm: six
convention: distal
joints:
  - {name: j1, alpha_deg: 90, d_mm: 400, limits_deg: [-170, 170]}
  - {name: j2, a_mm: 350, limits_deg: [-120, 120]}
  - {name: j3, alpha_deg: 90, limits_deg: [-150, 150]}
  - {name: j4, alpha_deg: -90, d_mm: 300, limits_deg: [-170, 170]}
  - {name: j5, alpha_deg: 90, limits_deg: [-120, 120]}
  - {name: j6, d_mm: 80, limits_deg: [-175, 175]}
";

pub(super) type Pose = Isometry3<f64>;

pub(super) fn flange(q: &[f64; 6], zeros: &[f64; 6]) -> Pose {
    let mut pose = Pose::identity();
    for ((a, alpha, d), (q, zero)) in ROWS.iter().zip(q.iter().zip(zeros)) {
        let about_z = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), (q + zero).to_radians());
        let about_x = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), alpha.to_radians());
        pose *= Pose::from_parts(Translation3::identity(), about_z)
            * Pose::from_parts(Translation3::new(*a, 0.0, *d), about_x);
    }
    pose
}

pub(super) fn pose(xyz: [f64; 3], rpy_deg: [f64; 3]) -> Pose {
    let [roll, pitch, yaw] = rpy_deg.map(f64::to_radians);
    Pose::from_parts(Translation3::from(xyz), UnitQuaternion::from_euler_angles(roll, pitch, yaw))
}

/// With noise of so many mm and degrees an axis.
fn noisy(truth: &Pose, (mm, deg): (f64, f64), rng: &mut Xorshift) -> Pose {
    let mut three = |sigma: f64| Vector3::from_fn(|_, _| rng.noise(sigma));
    let turn = UnitQuaternion::from_scaled_axis(three(deg.to_radians()));
    Pose::from_parts(Translation3::from(truth.translation.vector + three(mm)), truth.rotation * turn)
}

fn anywhere(rng: &mut Xorshift) -> [f64; 6] {
    [[-100.0, 100.0], [10.0, 80.0], [-80.0, 20.0], [-120.0, 120.0], [-90.0, 90.0], [-150.0, 150.0]]
        .map(|[low, high]| rng.between(low, high))
}

fn cells(numbers: impl IntoIterator<Item = f64>) -> String {
    numbers.into_iter().map(|number| format!("{number}")).collect::<Vec<_>>().join(",")
}

fn quaternion(turn: &UnitQuaternion<f64>) -> [f64; 4] {
    [turn.w, turn.i, turn.j, turn.k]
}

pub(super) const HEADER: &str = "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,";

/// A tracker's readings of a body on the flange; `written` makes the numbers of an orientation.
fn tracked(
    rows: usize,
    body: &Pose,
    noise: (f64, f64),
    seed: u64,
    written: impl Fn(&UnitQuaternion<f64>) -> Vec<f64>,
) -> String {
    let mut rng = Xorshift::seeded(seed);
    let base = pose([1500.0, -700.0, 300.0], [2.0, -3.0, 120.0]);
    let mut text = String::new();
    for _ in 0..rows {
        let q = anywhere(&mut rng);
        let seen = noisy(&(base * flange(&q, &ZEROS) * body), noise, &mut rng);
        let position = seen.translation.vector;
        text +=
            &format!("{},{},{}\n", cells(q), cells(position.iter().copied()), cells(written(&seen.rotation)));
    }
    text
}

fn of_positions() -> String {
    format!("{HEADER}p1_x_mm,p1_y_mm,p1_z_mm")
}

fn plain(turn: &UnitQuaternion<f64>) -> Vec<f64> {
    quaternion(turn).to_vec()
}

pub(super) fn compared(lab: &Laboratory) -> Comparison {
    lab.compare(&Progress::unwatched()).unwrap()
}

pub(super) fn without_holdout() -> Options {
    Options { holdout: Holdout::None, ..Options::default() }
}

/// The first row does not move: its zero is a turn of the base.
const FREE: &str = "free: [joint_zero(j2), joint_zero(j3), joint_zero(j4), joint_zero(j5), joint_zero(j6)]\n";

fn tracked_model(target: &str, noise: &str) -> String {
    format!("{ARM}base: {{free: true}}\ntargets: {{p1: {target}}}\n{FREE}noise: {noise}\n")
}

#[test]
fn orientations_show_zeros_that_one_target_at_the_flange_cannot() {
    let rows = tracked(80, &Pose::identity(), (0.02, 0.01), 3, plain);
    let model = tracked_model("{xyz_mm: [0, 0, 0], free: false}", "{p1_mm: 0.02, p1_deg: 0.01}");
    let both = format!("{},p1_qw,p1_qx,p1_qy,p1_qz\n{rows}", of_positions());
    let alone: String =
        rows.lines().map(|line| line.splitn(14, ',').take(9).collect::<Vec<_>>().join(",") + "\n").collect();
    let alone = compared(&laboratory(&model, &format!("{}\n{alone}", of_positions()), without_holdout()));
    let held: Vec<&str> =
        alone.effects.iter().filter(|effect| effect.held).map(|effect| effect.label.as_str()).collect();
    assert_eq!(held, ["joint_zero(j6)"], "the flange's origin stands on its axis");
    let found = compared(&laboratory(&model, &both, without_holdout()));
    assert!(found.gauges.is_empty(), "{:?}", found.gauges);
    for (effect, truth) in found.effects.iter().zip(&ZEROS[1..]) {
        assert!((effect.size - truth).abs() < 3.5 * effect.se && effect.se < 0.01, "{effect:?} {truth}");
    }
    // Where both show it, it is known better by both.
    let lever = |comparison: &Comparison| comparison.effects[3].se;
    assert!(lever(&found) < 0.7 * lever(&alone), "{} {}", lever(&found), lever(&alone));
    let errors = found.orientation_error_deg.unwrap();
    assert!((errors.fit.rms / (0.01 * 3.0_f64.sqrt()) - 1.0).abs() < 0.15, "{errors:?}");
    assert!(found.placed.iter().any(|placed| placed.name == "base" && placed.se_deg[2].unwrap() < 0.01));
}

#[test]
fn standard_errors_are_those_of_repeated_fits_and_an_undeclared_noise_is_estimated() {
    let model = tracked_model(
        "{xyz_mm: [30, -10, 50], rpy_deg: [0, 90, 0], free: false, free_rpy: true}",
        "{p1_mm: 0.05}",
    );
    let body = pose([30.0, -10.0, 50.0], [4.0, 80.0, -15.0]);
    let (mut squares, mut count) = (0.0, 0.0);
    for seed in 0..12 {
        let rows =
            tracked(50, &body, (0.05, 0.03), 100 + seed, |turn| turn.scaled_axis().iter().copied().collect());
        let text = format!("{},p1_rx_rad,p1_ry_rad,p1_rz_rad\n{rows}", of_positions());
        let found = compared(&laboratory(&model, &text, without_holdout()));
        let noise = found.noise.iter().find(|one| one.reading == "p1_deg").unwrap();
        assert!((noise.sigma / 0.03 - 1.0).abs() < 0.25, "{noise:?}");
        // The body's turn about the last axis and that joint's zero are one: the others are reported.
        for (effect, truth) in
            found.effects.iter().zip(&ZEROS[1..]).filter(|(effect, _)| effect.label != "joint_zero(j6)")
        {
            assert!(!effect.held, "{effect:?}");
            squares += ((effect.size - truth) / effect.se).powi(2);
            count += 1.0;
        }
        assert!(
            found.gauges.iter().all(|gauge| format!("{gauge:?}").contains("p1 rotation about z")),
            "{:?}",
            found.gauges
        );
    }
    let ratio = f64::sqrt(squares / count);
    assert!((0.75..1.3).contains(&ratio), "errors over standard errors: {ratio}");
}

#[test]
fn orientations_of_another_convention_are_recognized_and_reported() {
    let body = pose([10.0, 20.0, 60.0], [30.0, -40.0, 100.0]);
    let quaternions = |written: fn(&UnitQuaternion<f64>) -> Vec<f64>| {
        format!("{},p1_qw,p1_qx,p1_qy,p1_qz\n{}", of_positions(), tracked(30, &body, (0.1, 0.05), 5, written))
    };
    let vectors = |unit: &str, written: fn(&UnitQuaternion<f64>) -> Vec<f64>| {
        let rows = tracked(30, &body, (0.1, 0.05), 5, written);
        format!("{},p1_rx_{unit},p1_ry_{unit},p1_rz_{unit}\n{rows}", of_positions())
    };
    let model = tracked_model("{free: true}", "{}");
    let refused = |text: &str| match try_laboratory(&model, text, Options::default()) {
        Ok(lab) => format!("taken: {:?}", lab.table().warnings),
        Err(message) => message,
    };
    let mirrored = |turn: &UnitQuaternion<f64>| vec![turn.w, -turn.i, -turn.j, turn.k];
    for (text, expected) in [
        (
            quaternions(|turn| vec![turn.i, turn.j, turn.k, turn.w]),
            "with w last, in the order x, y, z, w (change",
        ),
        (quaternions(|turn| plain(&turn.inverse())), "inverted, as the rotation from the measuring frame"),
        (quaternions(mirrored), "as those of left-handed axes"),
        (
            quaternions(|turn| vec![-turn.i, -turn.j, -turn.k, turn.w]),
            "with w last, in the order x, y, z, w, and inverted",
        ),
        (
            vectors("rad", |turn| turn.inverse().scaled_axis().iter().copied().collect()),
            "change the sign of its three numbers",
        ),
        (
            vectors("deg", |turn| turn.scaled_axis().iter().copied().collect()),
            "as radians (the columns then end in _rad)",
        ),
    ] {
        let message = refused(&text);
        assert!(
            message.contains("the orientations of p1 cannot be meant as written")
                && message.contains(expected),
            "{expected}: {message}"
        );
        assert!(!message.contains(", or "), "the places say which: {message}");
    }
    // Without places, w last is an inverted orientation in other axes: both are reported.
    let bare = |line: &str| {
        format!(
            "{}\n",
            line.split(',')
                .enumerate()
                .filter(|(column, _)| !(6..9).contains(column))
                .map(|(_, cell)| cell)
                .collect::<Vec<_>>()
                .join(",")
        )
    };
    let alone: String = quaternions(|turn| vec![turn.i, turn.j, turn.k, turn.w]).lines().map(bare).collect();
    let message = refused(&alone);
    assert!(
        message.contains("with w last")
            && message.contains(", or ")
            && message.contains("inverted, as the rotation"),
        "{message}"
    );
    assert_eq!(refused(&quaternions(plain)), "taken: []");
    // Degrees under a header of radians are more than a turn.
    let message =
        refused(&vectors("rad", |turn| turn.scaled_axis().iter().map(|part| part.to_degrees()).collect()));
    assert!(message.contains("more than a whole turn") && message.contains("line 2, column 10"), "{message}");
    // Axes that are none of these: each row turned at random.
    let mut rng = Xorshift::seeded(9);
    let header = format!("{},p1_qw,p1_qx,p1_qy,p1_qz\n", of_positions());
    let rows: String = tracked(30, &body, (0.1, 0.05), 5, plain)
        .lines()
        .map(|line| {
            let numbers: Vec<f64> = (0..4).map(|_| rng.noise(1.0)).collect();
            let turn = UnitQuaternion::from_quaternion(Quaternion::new(
                numbers[0], numbers[1], numbers[2], numbers[3],
            ));
            let kept: Vec<&str> = line.split(',').take(9).collect();
            format!("{},{}\n", kept.join(","), cells(quaternion(&turn)))
        })
        .collect();
    let message = refused(&format!("{header}{rows}"));
    assert!(message.contains("have little to do with those the model expects"), "{message}");
}

#[test]
fn a_body_that_the_model_holds_turned_otherwise_is_reported_with_what_would_fit() {
    let body = pose([0.0, 0.0, 0.0], [180.0, 0.0, 0.0]);
    let text =
        format!("{},p1_qw,p1_qx,p1_qy,p1_qz\n{}", of_positions(), tracked(30, &body, (0.05, 0.02), 6, plain));
    let model = tracked_model("{free: false}", "{}");
    let lab = laboratory(&model, &text, Options::default());
    let warnings = lab.table().warnings.join("\n");
    assert!(
        warnings.contains("the orientations of p1 are 1")
            && warnings.contains("rpy_deg: [")
            && warnings.contains("of p1 would fit"),
        "{warnings}"
    );
}

/// The camera on the hand, and the board in the base.
pub(super) fn camera() -> Pose {
    pose([42.0, -15.0, 70.0], [3.0, -8.0, 95.0])
}

pub(super) fn board() -> Pose {
    pose([520.0, 40.0, 10.0], [178.0, 4.0, -60.0])
}

/// Poses from which the camera sees the board about 350 mm ahead, and what it sees; `one_axis`: the hand turns about the board's normal alone.
fn pictures(rows: usize, noise: (f64, f64), seed: u64, zeros: &[f64; 6], one_axis: bool) -> String {
    let rows = pictures_of(&board(), rows, noise, seed, zeros, one_axis);
    let text: String = rows.iter().map(|row| format!("{row}\n")).collect();
    format!("{HEADER}tvec_x_mm,tvec_y_mm,tvec_z_mm,rvec_x_rad,rvec_y_rad,rvec_z_rad\n{text}")
}

/// The same of a board anywhere, row by row.
pub(super) fn pictures_of(
    board: &Pose,
    rows: usize,
    noise: (f64, f64),
    seed: u64,
    zeros: &[f64; 6],
    one_axis: bool,
) -> Vec<String> {
    let mut rng = Xorshift::seeded(seed);
    let mut taken = Vec::new();
    while taken.len() < rows {
        let q = match one_axis {
            // Upright with the hand straight down, the first and last joint alone turn it.
            true => [rng.between(-20.0, 20.0), 60.0, -60.0, 0.0, 0.0, rng.between(-60.0, 60.0)],
            false => anywhere(&mut rng),
        };
        let seen = camera().inverse() * flange(&q, zeros).inverse() * board;
        let position = seen.translation.vector;
        let in_view =
            position.z > 200.0 && position.z < 700.0 && position.x.hypot(position.y) < 0.45 * position.z;
        if one_axis || in_view {
            let seen = noisy(&seen, noise, &mut rng);
            let turn: Vec<f64> = seen.rotation.scaled_axis().iter().copied().collect();
            taken.push(format!(
                "{},{},{}",
                cells(q),
                cells(seen.translation.vector.iter().copied()),
                cells(turn)
            ));
        }
    }
    taken
}

fn hand_eye_model(free: &str, noise: &str) -> String {
    format!("{ARM}targets: {{p1: {{}}}}\nboard: {{seen_by: p1}}\nfree: {free}\nnoise: {noise}\n")
}

/// By how many standard errors a placement is off at most.
pub(super) fn off(comparison: &Comparison, name: &str, truth: &Pose) -> f64 {
    let placed = comparison.placed.iter().find(|placed| placed.name == name).unwrap();
    let shift = (0..3)
        .map(|axis| (placed.xyz_mm[axis] - truth.translation.vector[axis]) / placed.se_mm[axis].unwrap());
    let [w, x, y, z] = placed.quaternion;
    let found = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
    let turn = (found * truth.rotation.inverse()).scaled_axis().map(f64::to_degrees);
    let turned = (0..3).map(|axis| turn[axis] / placed.se_deg[axis].unwrap());
    shift.chain(turned).map(f64::abs).fold(0.0, f64::max)
}

#[test]
fn hand_eye_is_found_from_no_start_with_its_uncertainty_and_written_back() {
    let sound = [0.0; 6];
    let text = pictures(25, (0.1, 0.02), 21, &sound, false);
    let lab = laboratory(&hand_eye_model("[]", "{board_mm: 0.1, board_deg: 0.02}"), &text, without_holdout());
    let found = compared(&lab);
    assert!(found.gauges.is_empty() && found.placed.len() == 2, "{:?} {:?}", found.gauges, found.placed);
    assert!(off(&found, "p1", &camera()) < 4.0 && off(&found, "board", &board()) < 4.0, "{:?}", found.placed);
    assert!(
        found.placed.iter().all(|placed| placed.se_mm.iter().all(|se| se.unwrap() < 0.3)),
        "{:?}",
        found.placed
    );
    assert!((found.rms_mm.fit / 0.173 - 1.0).abs() < 0.25, "{:?}", found.rms_mm);
    let accepted = lab.accept(&Progress::unwatched()).unwrap();
    let again = Model::parse("again.yaml", &model_text(&accepted.model)).unwrap();
    assert!((again.targets[0].xyz - camera().translation.vector).norm() < 0.5, "{:?}", again.targets[0]);
    assert!(again.targets[0].rotation.angle_to(&camera().rotation.to_rotation_matrix()) < 0.002);
    let placed = again.boards.into_iter().next().unwrap();
    assert!((placed.pose.translation.vector - board().translation.vector).norm() < 0.5, "{placed:?}");
    assert!(!again.base.free, "nobody saw the base");
}

#[test]
fn standard_errors_of_hand_eye_are_those_of_repeated_fits() {
    let model = hand_eye_model("[]", "{}");
    let (mut squares, mut count) = (0.0, 0.0);
    for seed in 0..10 {
        let found = compared(&laboratory(
            &model,
            &pictures(20, (0.2, 0.05), 300 + seed, &[0.0; 6], false),
            without_holdout(),
        ));
        for (name, truth) in [("p1", camera()), ("board", board())] {
            let placed = found.placed.iter().find(|placed| placed.name == name).unwrap();
            for axis in 0..3 {
                squares += ((placed.xyz_mm[axis] - truth.translation.vector[axis])
                    / placed.se_mm[axis].unwrap())
                .powi(2);
                count += 1.0;
            }
        }
    }
    let ratio = f64::sqrt(squares / count);
    assert!((0.65..1.4).contains(&ratio), "errors over standard errors: {ratio}");
}

#[test]
fn the_arms_own_zeros_are_found_with_the_hand_eye_and_a_gain_that_is_hidden_is_named() {
    let zeros = [0.0, 0.2, -0.15, 0.3, -0.25, 0.0];
    let text = pictures(60, (0.05, 0.01), 33, &zeros, false);
    let free = "[joint_zero(j2), joint_zero(j3), joint_zero(j4), joint_zero(j5)]";
    let found = compared(&laboratory(
        &hand_eye_model(free, "{board_mm: 0.05, board_deg: 0.01}"),
        &text,
        without_holdout(),
    ));
    for (effect, truth) in found.effects.iter().zip(&zeros[1..]) {
        assert!((effect.size - truth).abs() < 3.5 * effect.se && effect.se < 0.05, "{effect:?} {truth}");
    }
    let hidden = laboratory(
        &hand_eye_model("[]", "{board_mm: 0.05, board_deg: 0.01}"),
        &pictures(80, (0.05, 0.01), 34, &[0.0, 0.0, 0.3, 0.0, 0.0, 0.0], false),
        Options::default(),
    );
    let diagnosis = hidden.diagnose(&Progress::unwatched()).unwrap();
    assert!(diagnosis_sentence(&diagnosis).contains("joint_zero(j3)"), "{}", diagnosis_sentence(&diagnosis));
}

#[test]
fn a_hand_that_turned_about_one_axis_is_said_what_it_cannot_find_and_what_to_add() {
    let text = pictures(15, (0.1, 0.02), 44, &[0.0; 6], true);
    let lab = laboratory(&hand_eye_model("[]", "{}"), &text, without_holdout());
    let warnings = lab.table().warnings.join("\n");
    assert!(warnings.contains("the hand turned about one axis only ([0.00, 0.00, 1.00]"), "{warnings}");
    assert!(
        warnings.contains(
            "cannot be distinguished from the board; add poses that turn the hand by 30 deg or more"
        ),
        "{warnings}"
    );
    let found = compared(&lab);
    assert!(!found.gauges.is_empty(), "what cannot be told is held and named");
    let few = pictures(2, (0.1, 0.02), 45, &[0.0; 6], false);
    let lab = laboratory(&hand_eye_model("[]", "{}"), &few, without_holdout());
    assert!(
        lab.table().warnings.iter().any(|warning| warning.contains("measure three at least")),
        "{:?}",
        lab.table().warnings
    );
}

#[test]
fn next_poses_keep_the_board_in_view_and_distinguish_effects() {
    let text = pictures(25, (0.1, 0.02), 55, &ZEROS, false);
    let lab = laboratory(
        &hand_eye_model("[joint_zero(j2), joint_zero(j3)]", "{board_mm: 0.1, board_deg: 0.02}"),
        &text,
        Options::default(),
    );
    let request = Requested { count: 4, keep_out: Vec::new(), payloads: Vec::new() };
    let next = lab.next_poses(&request, &Progress::unwatched()).unwrap();
    assert!(next.next.len() >= 4, "{next:?}");
    for pose in &next.next {
        let q: [f64; 6] = pose.q_deg.clone().try_into().unwrap();
        let seen = (camera().inverse() * flange(&q, &ZEROS).inverse() * board()).translation.vector;
        assert!(seen.z > 170.0 && seen.x.hypot(seen.y) < 0.6 * seen.z, "{q:?}: {seen}");
    }
}

#[test]
fn a_board_that_no_camera_of_the_model_sees_and_a_body_it_lacks_are_refused() {
    let text = pictures(5, (0.1, 0.02), 66, &[0.0; 6], false);
    let bare = format!("{ARM}targets: {{p1: {{}}}}\nfree: []\n");
    let message = try_laboratory(&bare, &text, Options::default()).unwrap_err();
    assert!(
        message.contains("`board: {seen_by: p1}`") && message.contains("is a target: p1_x_mm"),
        "{message}"
    );
    let lost = hand_eye_model("[]", "{}").replace("seen_by: p1", "seen_by: p3");
    let message = try_laboratory(&lost, &text, Options::default()).unwrap_err();
    assert!(message.contains("there is no target `p3` that could be the camera"), "{message}");
    let text = format!("{HEADER}p4_qw,p4_qx,p4_qy,p4_qz\n1,2,3,4,5,6,1,0,0,0\n");
    let message = try_laboratory(&bare, &text, Options::default()).unwrap_err();
    assert!(message.contains("add `p4` under `targets:`"), "{message}");
}
