//! Poses of a made-up arm of three joints, worked out here by plain products of turns and shifts: what is said of their orientations and of what they cannot determine.

use super::*;
use nalgebra::IsometryMatrix3;
use plumb_calibration::fit::hand_eye::rigid_of;
use plumb_calibration::measurement::Observations;
use plumb_estimation::Random;

/// Poses of a known base and body, a third of a radian and more apart about all axes; each place off by `off` mm.
fn poses(off: f64) -> (Vec<SeenPose>, TwoRotations) {
    let mut random = Random::seeded(7);
    let mut any = |reach: f64| {
        let mut three = |scale: f64| Vector3::from_fn(|_, _| scale * random.normal());
        rigid_of(Rotation3::new(three(1.0)), three(reach))
    };
    let (base, body) = (any(900.0), any(60.0));
    let poses = (0..12).map(|row| {
        let flange = any(400.0);
        let mut seen = base * flange * body;
        seen.translation.vector.z += if row % 2 == 0 { off } else { -off };
        SeenPose { flange, seen }
    });
    (poses.collect(), TwoRotations { base: base.rotation, body: body.rotation })
}

#[test]
fn places_leave_what_base_and_body_do_not_explain_as_a_share_of_their_spread() {
    let (right, found) = poses(0.0);
    assert!(positions_left(&right, &found) < 1e-9);
    let spread = |poses: &[SeenPose]| {
        let seen: Vec<Vector3<f64>> = poses.iter().map(|pose| pose.seen.translation.vector).collect();
        let middle = seen.iter().sum::<Vector3<f64>>() / seen.len() as f64;
        seen.iter().map(|position| (position - middle).norm_squared()).sum::<f64>()
    };
    let (wrong, found) = poses(50.0);
    let left = positions_left(&wrong, &found);
    // Six of thirty-six numbers are fitted: most of twelve times 50 squared is left.
    let all = (12.0 * 2500.0 / spread(&wrong)).sqrt();
    assert!(left < all && left > 0.7 * all, "{left} {all}");
    let mut none = right.clone();
    none.iter_mut().for_each(|pose| pose.seen.translation.vector.fill(f64::NAN));
    assert_eq!(positions_left(&none, &found), 0.0, "no place was measured");
    // Positions that were not measured are left out, and those that were count.
    let mut some = wrong.clone();
    some[3].seen.translation.vector.fill(f64::NAN);
    assert!((positions_left(&some, &found) / left - 1.0).abs() < 0.3);
}

#[test]
fn what_does_not_go_together_is_reported_by_what_is_foreign() {
    let words = |angle: f64, positions: f64| off_in_words(Left { angle, positions });
    assert_eq!(words(0.5, 0.0), "29 deg of them are left wherever base and body sit");
    assert!(words(0.99 * FOREIGN, 0.31).ends_with("31 % of the places' spread is left"));
    assert_eq!(off_in_words(Left::STILL), "they do not turn as the flange does");
    // The worse of the two, 1 where it is foreign.
    let size = |angle: f64, positions: f64| {
        Left { angle: angle * FOREIGN, positions: positions * FOREIGN_POSITIONS }.size()
    };
    assert!((size(0.5, 2.0) - 2.0).abs() < 1e-12 && (size(3.0, 0.0) - 3.0).abs() < 1e-12);
    assert_eq!(rpy(&Rotation3::from_euler_angles(0.1, -0.2, 0.3)), "[5.7, -11.5, 17.2]");
}

#[test]
fn the_reading_that_was_slipped_is_the_best_of_all() {
    let (right, _) = poses(0.0);
    assert!(Left::of(&right).unwrap().size() < 1e-6);
    let body = SeenBody::Target(0);
    let slipped = read_as(&right, body, inverted);
    assert!(Left::of(&slipped).unwrap().size() > 1.0);
    let found = others(&slipped, body, VECTOR);
    assert!(
        found[0].0.size() < 1e-6 && found[0].1.what.starts_with("inverted, as the rotation"),
        "{}",
        found[0].1.what
    );
    assert!(found.iter().all(|(_, reading)| reading.form.is_none() || reading.form == VECTOR));
    assert!(found.windows(2).all(|pair| pair[0].0.size() <= pair[1].0.size()));
    // A camera's orientations are those of what it sees: the slip is undone in what was written down.
    let board = read_as(&right, SeenBody::Board(0), w_last);
    let measured = right[2].seen.inverse();
    let expected = rigid_of(w_last(&measured.rotation), measured.translation.vector).inverse();
    assert!((board[2].seen.to_homogeneous() - expected.to_homogeneous()).norm() < 1e-9);
}

#[test]
fn every_reading_undoes_the_slip_it_is_named_for() {
    let rotation = Rotation3::new(Vector3::new(0.4, -1.2, 0.8));
    let true_one = UnitQuaternion::from_rotation_matrix(&rotation);
    // Written x, y, z, w and read w, x, y, z.
    let misread = Quaternion::new(true_one.i, true_one.j, true_one.k, true_one.w);
    let misread = UnitQuaternion::from_quaternion(misread).to_rotation_matrix();
    assert!(w_last(&misread).angle_to(&rotation) < 1e-7);
    assert!(inverted(&rotation.inverse()).angle_to(&rotation) < 1e-7);
    assert!(
        mirrored(&mirrored(&rotation)).angle_to(&rotation) < 1e-7
            && mirrored(&rotation).angle_to(&rotation) > 0.1
    );
    assert!(scaled(&scaled(&rotation, 0.01), 100.0).angle_to(&rotation) < 1e-7);
}

type Pose = IsometryMatrix3<f64>;

fn flange(q_deg: [f64; 3]) -> Pose {
    let rows = [(0.0, 90.0, 400.0), (350.0, 90.0, 0.0), (0.0, 0.0, 80.0_f64)];
    rows.into_iter().zip(q_deg).fold(Pose::identity(), |pose, ((a, alpha, d), q): ((f64, f64, f64), f64)| {
        let about_z = Rotation3::from_axis_angle(&Vector3::z_axis(), q.to_radians());
        let about_x = Rotation3::from_axis_angle(&Vector3::x_axis(), alpha.to_radians());
        pose * rigid_of(about_z, Vector3::zeros()) * rigid_of(about_x, Vector3::new(a, 0.0, d))
    })
}

fn turned(roll: f64, pitch: f64, yaw: f64) -> Rotation3<f64> {
    Rotation3::from_euler_angles(roll.to_radians(), pitch.to_radians(), yaw.to_radians())
}

fn at(xyz: [f64; 3], [roll, pitch, yaw]: [f64; 3]) -> Pose {
    rigid_of(turned(roll, pitch, yaw), Vector3::from(xyz))
}

/// The arm's base as the tracker sees it, and the body on the flange.
fn base() -> Pose {
    at([1500.0, -700.0, 300.0], [2.0, -3.0, 120.0])
}

fn body() -> Pose {
    at([10.0, 20.0, 60.0], [30.0, -40.0, 100.0])
}

/// Angles of so many rows, which turn the hand about all axes.
fn anywhere(rows: usize) -> Vec<[f64; 3]> {
    (0..rows)
        .map(|row| {
            [(0.9, 50.0), (2.3, 40.0), (1.7, 70.0)]
                .map(|(rate, reach)| reach * (rate * (row as f64 + 0.4)).sin())
        })
        .collect()
}

fn cells(pose: &Pose) -> String {
    let rotation = UnitQuaternion::from_rotation_matrix(&pose.rotation).scaled_axis();
    let numbers = pose.translation.vector.iter().chain(rotation.iter()).map(|number| format!("{number:.12}"));
    numbers.collect::<Vec<_>>().join(",")
}

/// A tracker's rows of a body on the flange, each changed.
fn tracked(rows: &[[f64; 3]], change: impl Fn(usize, Pose) -> Pose) -> String {
    let mut text = "q1_deg,q2_deg,q3_deg,p1_x_mm,p1_y_mm,p1_z_mm,p1_rx_rad,p1_ry_rad,p1_rz_rad\n".to_owned();
    for (row, q) in rows.iter().enumerate() {
        let seen = change(row, base() * flange(*q) * body());
        text.push_str(&format!("{},{},{},{}\n", q[0], q[1], q[2], cells(&seen)));
    }
    text
}

/// What a camera on the hand sees of boards that are somewhere in the base's frame.
fn pictures(rows: &[([f64; 3], &str, Pose)]) -> String {
    let mut text =
        "q1_deg,q2_deg,q3_deg,tvec_x_mm,tvec_y_mm,tvec_z_mm,rvec_x_rad,rvec_y_rad,rvec_z_rad,board\n"
            .to_owned();
    for (q, name, board) in rows {
        let seen = body().inverse() * flange(*q).inverse() * board;
        text.push_str(&format!("{},{},{},{},{name}\n", q[0], q[1], q[2], cells(&seen)));
    }
    text
}

fn floor() -> Pose {
    at([520.0, 40.0, 10.0], [178.0, 4.0, -60.0])
}

fn wall() -> Pose {
    at([300.0, -520.0, 350.0], [95.0, 10.0, 20.0])
}

/// What is said of the orientations of a table.
fn message(lines: &str, table: &str) -> Result<Vec<String>, ImplausibleError> {
    let model =
        Model::parse("model.yaml", &format!("{}free: []\n{lines}\n", crate::testing::THREE_JOINTS)).unwrap();
    let table = Table::parse("table.csv", table).unwrap();
    let observations = Observations::new(&model, &table).unwrap();
    check(&ResidualModel::new(&model, &table, &observations, &[]).unwrap())
}

const ALL_FREE: &str = "base: {free: true}\ntargets: {p1: {free: true, free_rpy: true}}";

/// As a model file has a pose.
fn in_file(pose: &Pose) -> String {
    let xyz = pose.translation.vector;
    let (roll, pitch, yaw) = pose.rotation.euler_angles();
    let [roll, pitch, yaw] = [roll, pitch, yaw].map(f64::to_degrees);
    format!("xyz_mm: [{}, {}, {}], rpy_deg: [{roll}, {pitch}, {yaw}]", xyz.x, xyz.y, xyz.z)
}

/// Base and body held or free, the body's orientation held `off` degrees from where it is, the base's `base_off`.
fn held(base_free: bool, base_off: f64, body_free: bool, off: f64) -> String {
    let by = |pose: Pose, off: f64| pose * rigid_of(turned(0.0, 0.0, off), Vector3::zeros());
    format!(
        "base: {{{}, free: {base_free}}}\ntargets: {{p1: {{{}, free: {body_free}, free_rpy: {body_free}}}}}",
        in_file(&by(base(), base_off)),
        in_file(&by(body(), off))
    )
}

#[test]
fn orientations_that_follow_the_hand_are_let_be() {
    assert_eq!(message(ALL_FREE, &tracked(&anywhere(12), |_, seen| seen)), Ok(Vec::new()));
    assert_eq!(
        message(&held(false, 0.0, false, 0.0), &tracked(&anywhere(12), |_, seen| seen)),
        Ok(Vec::new())
    );
}

#[test]
fn another_convention_is_refused_with_what_would_fit_from_six_rows_on() {
    let inverted = |_: usize, seen: Pose| rigid_of(seen.rotation.inverse(), seen.translation.vector);
    let refused = message(ALL_FREE, &tracked(&anywhere(FEWEST), inverted));
    let Err(ImplausibleError::Orientation { table, body, what, left_deg, .. }) = refused else {
        panic!("{refused:?}")
    };
    assert_eq!((table.as_str(), body.as_str()), ("table.csv", "p1"));
    assert!(
        what.starts_with("inverted, as") && !what.contains(", or ") && left_deg < 1e-3,
        "{what} {left_deg}"
    );
    assert_eq!(message(ALL_FREE, &tracked(&anywhere(FEWEST - 1), inverted)), Ok(Vec::new()));
}

#[test]
fn orientations_that_nothing_explains_are_odd_from_what_is_foreign_on() {
    // In turn to either side about an axis of the body's own: what is left is the turn itself, to first order.
    let wobbling = |deg: f64| {
        let change = move |row: usize, seen: Pose| {
            let by = if row.is_multiple_of(2) { deg } else { -deg };
            seen * rigid_of(turned(0.0, by, 0.0), Vector3::zeros())
        };
        message(ALL_FREE, &tracked(&anywhere(60), change)).unwrap()
    };
    let foreign = FOREIGN.to_degrees();
    assert_eq!(wobbling(0.95 * foreign), Vec::<String>::new());
    let odd = wobbling(1.1 * foreign);
    assert!(
        odd.len() == 1
            && odd[0].starts_with("the orientations of p1 have little to do with those the model expects: 11 deg of them are left"),
        "{odd:?}"
    );
}

#[test]
fn a_body_or_a_base_that_is_held_turned_otherwise_is_said_with_what_would_fit() {
    let table = tracked(&anywhere(12), |_, seen| seen);
    let odd = |lines: String| message(&lines, &table).unwrap();
    let foreign = FOREIGN.to_degrees();
    let of_body = format!("`rpy_deg: {}` of p1", rpy(&body().rotation));
    let of_base = format!("`rpy_deg: {}` of the base", rpy(&base().rotation));
    let begins =
        |off: f64| format!("the orientations of p1 are {off:.0} deg off as the model holds base and p1: ");
    // Held alone, each is answered by the other, but not the turn of the one about all axes of the other.
    assert_eq!(odd(held(false, 0.0, false, 0.95 * foreign)), Vec::<String>::new());
    let both = odd(held(false, 0.0, false, 40.0));
    assert_eq!(
        both,
        [format!("{}{of_body} with {of_base} would fit; put that into the model, or free it", begins(40.0))]
    );
    let turned_base = odd(held(false, 50.0, false, 0.0));
    assert!(turned_base[0].starts_with(&begins(50.0)), "{turned_base:?}");
    let alone = odd(held(true, 0.0, false, 40.0));
    assert!(
        alone.len() == 1 && alone[0].contains(&of_body) && !alone[0].contains("of the base"),
        "{alone:?}"
    );
    let alone = odd(held(false, 40.0, true, 0.0));
    assert!(alone.len() == 1 && alone[0].contains(&of_base) && !alone[0].contains("` of p1"), "{alone:?}");
    assert_eq!(odd(held(true, 40.0, true, 40.0)), Vec::<String>::new(), "both are found");
}

/// The hand turns about the first joint's axis, and after the first row by `deg` to either side about another.
fn about_one_axis(rows: usize, deg: f64) -> Vec<[f64; 3]> {
    let aside = |row: usize| match row {
        0 => 0.0,
        _ if row.is_multiple_of(4) || row % 4 == 3 => deg,
        _ => -deg,
    };
    (0..rows).map(|row| [5.0 * row as f64, 30.0 + aside(row), 0.0]).collect()
}

#[test]
fn a_hand_that_turned_about_one_axis_cannot_separate_base_and_body() {
    let odd = |lines: &str, rows: &[[f64; 3]]| message(lines, &tracked(rows, |_, seen| seen)).unwrap();
    let noted = odd(ALL_FREE, &about_one_axis(8, 0.0));
    assert!(
        noted.len() == 1 && noted[0].starts_with("between all poses the hand turned about one axis only ("),
        "{noted:?}"
    );
    assert!(
        noted[0].contains("0.00, 1.00] in the base's frame): how far p1 sits along it")
            || noted[0].contains("0.00, -1.00]"),
        "{noted:?}"
    );
    assert!(noted[0].contains("cannot be distinguished from the base; add poses"), "{noted:?}");
    let edge = ONE_AXIS.to_degrees();
    assert_eq!(odd(ALL_FREE, &about_one_axis(9, 0.9 * edge)).len(), 1);
    assert_eq!(odd(ALL_FREE, &about_one_axis(9, 1.2 * edge)), Vec::<String>::new());
    // Where either is known the other follows.
    assert_eq!(odd(&held(false, 0.0, true, 0.0), &about_one_axis(8, 0.0)), Vec::<String>::new());
    assert_eq!(odd(&held(true, 0.0, false, 0.0), &about_one_axis(8, 0.0)), Vec::<String>::new());
}

#[test]
fn fewer_than_three_poses_cannot_separate_base_and_body_however_they_turn() {
    let odd = |rows: usize| message(ALL_FREE, &tracked(&anywhere(rows), |_, seen| seen)).unwrap();
    let noted = odd(1);
    assert!(
        noted.len() == 1
            && noted[0].starts_with(
                "1 pose with an orientation cannot determine how p1 sits on the flange and where the base is"
            ),
        "{noted:?}"
    );
    assert_eq!(odd(FEWEST_OF_A_CAMERA), Vec::<String>::new());
    let still = message(ALL_FREE, &tracked(&about_one_axis(2, 0.0), |_, seen| seen)).unwrap();
    assert!(still.len() == 1 && still[0].starts_with("2 poses"), "{still:?}");
    // Of a table without any orientation of the body nothing is said.
    let none: String = tracked(&anywhere(8), |_, seen| seen)
        .lines()
        .enumerate()
        .map(|(line, text)| {
            if line == 0 {
                format!("{text}\n")
            } else {
                format!("{},,,\n", text.splitn(9, ',').take(6).collect::<Vec<_>>().join(","))
            }
        })
        .collect();
    assert_eq!(message(ALL_FREE, &none), Ok(Vec::new()));
}

const BOARDS: &str = "targets: {p1: {}}\nboards: {floor: {seen_by: p1}, wall: {seen_by: p1}}";

#[test]
fn a_board_in_few_pictures_is_placed_by_a_camera_that_another_board_determines() {
    let with_wall = |of_wall: usize, floor_rows: &[[f64; 3]]| {
        let of_floor = floor_rows.iter().map(|q| (*q, "floor", floor()));
        let rows: Vec<_> =
            of_floor.chain(anywhere(of_wall).into_iter().map(|q| (q, "wall", wall()))).collect();
        message(BOARDS, &pictures(&rows)).unwrap()
    };
    let one = with_wall(1, &anywhere(12));
    assert!(
        one.len() == 1 && one[0].starts_with("the board wall is in 1 picture only: its place follows"),
        "{one:?}"
    );
    let two = with_wall(2, &anywhere(12));
    assert!(two.len() == 1 && two[0].starts_with("the board wall is in 2 pictures only"), "{two:?}");
    assert_eq!(with_wall(FEWEST_OF_A_CAMERA, &anywhere(12)), Vec::<String>::new());
    // Three pictures from several sides are enough of the other board, and pictures from one side never are.
    assert!(with_wall(1, &anywhere(FEWEST_OF_A_CAMERA))[0].contains("hardly anything confirms it"));
    let neither = with_wall(1, &anywhere(FEWEST_OF_A_CAMERA - 1));
    assert!(
        neither.iter().any(|noted| noted.starts_with("1 pose ") && noted.contains("where the board wall is")),
        "{neither:?}"
    );
    let turned = with_wall(1, &about_one_axis(12, 0.0));
    assert!(
        turned.iter().any(|noted| noted.contains("cannot be distinguished from the board floor")),
        "{turned:?}"
    );
    assert!(turned.iter().any(|noted| noted.starts_with("1 pose ")), "{turned:?}");
}

#[test]
fn a_board_that_is_held_turned_otherwise_is_said_by_the_base_it_asks_for() {
    let rows: Vec<_> = anywhere(12).into_iter().map(|q| (q, "floor", floor())).collect();
    let lines = |off: f64, free: bool| {
        let board = floor() * rigid_of(turned(0.0, 0.0, off), Vector3::zeros());
        format!(
            "base: {{free: false}}\ntargets: {{p1: {{{}, free: false}}}}\nboards: {{floor: {{seen_by: p1, {}, free: {free}}}}}",
            in_file(&body()),
            in_file(&board)
        )
    };
    let table = pictures(&rows);
    assert_eq!(message(&lines(0.0, false), &table), Ok(Vec::new()));
    assert_eq!(message(&lines(40.0, true), &table), Ok(Vec::new()), "it is looked for");
    let odd = message(&lines(40.0, false), &table).unwrap();
    assert!(
        odd.len() == 1 && odd[0].starts_with("the orientations of the board floor are 40 deg off"),
        "{odd:?}"
    );
    // The board is held where it is not: the base would have to be turned by as much about the board's own axis.
    let asked = floor().rotation * turned(0.0, 0.0, 40.0) * floor().rotation.inverse();
    assert!(odd[0].contains(&format!("`rpy_deg: {}` of the base", rpy(&asked))), "{odd:?} {}", rpy(&asked));
}
