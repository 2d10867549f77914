//! First guesses of bases, targets and places, and what a state says of the arm, against numbers worked out by hand.

use nalgebra::{IsometryMatrix3, Point3, Rotation3, Translation3, Vector3};
use plumb_estimation::{Progress, Random};
use plumb_kinematics::HalfSpace;

use crate::arm_model::{AddedEffect, Model, StripeRig};
use crate::effect::{Channel, Contribution, Dof, build, parse};
use crate::fit::arm_pose::Changes;
use crate::fit::{FitOptions, ResidualModel, SeenBody, Sight, State, base_and_targets, rigid};
use crate::measurement::Observations;
use crate::table::Table;
use crate::table::scalar::{DISTANCE, HEIGHT};

fn pose(shift: [f64; 3], rotation: [f64; 3]) -> IsometryMatrix3<f64> {
    IsometryMatrix3::from_parts(
        Translation3::from(Vector3::from(shift)),
        Rotation3::new(Vector3::from(rotation)),
    )
}

fn apart(one: &IsometryMatrix3<f64>, other: &IsometryMatrix3<f64>) -> f64 {
    (one.to_homogeneous() - other.to_homogeneous()).norm()
}

#[test]
fn the_rigid_motion_between_points_is_found_and_is_never_a_mirror() {
    let from: Vec<Vector3<f64>> =
        [[0.0, 0.0, 0.0], [10.0, 0.0, 0.0], [0.0, 20.0, 0.0], [0.0, 0.0, 5.0]].map(Vector3::from).to_vec();
    let motion = pose([100.0, -50.0, 7.0], [0.4, -1.2, 2.0]);
    let to: Vec<Vector3<f64>> = from.iter().map(|point| (motion * Point3::from(*point)).coords).collect();
    assert!(apart(&rigid(&from, &to).unwrap(), &motion) < 1e-9);
    assert!(rigid(&from[..2], &to[..2]).is_none(), "two points leave a turn about the line through them");
    assert!(rigid(&from[..3], &to[..3]).is_some());
    let mirrored: Vec<Vector3<f64>> =
        from.iter().map(|point| Vector3::new(-point.x, point.y, point.z)).collect();
    let found = rigid(&from, &mirrored).unwrap();
    assert!((found.rotation.matrix().determinant() - 1.0).abs() < 1e-9, "{found}");
}

#[test]
fn base_and_targets_are_found_at_once_from_no_start() {
    let mut random = Random::seeded(5);
    let mut some = |scale: f64| Vector3::from_fn(|_, _| scale * random.normal());
    let base = IsometryMatrix3::from_parts(Translation3::from(some(900.0)), Rotation3::new(some(1.0)));
    let targets = [some(50.0), some(50.0)];
    let mut sights = Vec::new();
    for index in 0..24 {
        let flange = IsometryMatrix3::from_parts(Translation3::from(some(300.0)), Rotation3::new(some(1.0)));
        let target = index % 2;
        sights.push(Sight {
            target,
            measured: (base * flange * Point3::from(targets[target])).coords,
            flange,
        });
    }
    let start = [Vector3::zeros(), Vector3::zeros()];
    let (found, positions) =
        base_and_targets(&sights, &IsometryMatrix3::identity(), &start, &[true, true]).unwrap();
    assert!(apart(&found, &base) < 1e-6, "{found} {base}");
    assert!((positions[0] - targets[0]).norm() < 1e-6 && (positions[1] - targets[1]).norm() < 1e-6);
    // A target that is not free stays, and the other is found beside it.
    let known = [targets[0], Vector3::zeros()];
    let (found, positions) =
        base_and_targets(&sights, &IsometryMatrix3::identity(), &known, &[false, true]).unwrap();
    assert!(
        apart(&found, &base) < 1e-6
            && positions[0] == targets[0]
            && (positions[1] - targets[1]).norm() < 1e-6
    );
}

const ARM: &str = "
arm: elbow
convention: distal
joints:
  - {name: waist, d_mm: 100, alpha_deg: 90}
  - {name: shoulder, a_mm: 400}
  - {name: wrist, a_mm: 300, alpha_deg: 90}
base: {xyz_mm: [0, 0, 0], rpy_deg: [0, 0, 0], free: true}
targets: {p1: {xyz_mm: [0, 0, 0], free: true}, p2: {xyz_mm: [0, 0, 0], free: true}}
";

/// Where the arm's targets are, seen from far off: noise-free rows.
fn rows(base: &IsometryMatrix3<f64>, tools: [Vector3<f64>; 2]) -> String {
    let mut random = Random::seeded(17);
    let mut text = "q1_deg,q2_deg,q3_deg,p1_x_mm,p1_y_mm,p1_z_mm,p2_x_mm,p2_y_mm,p2_z_mm\n".to_owned();
    for _ in 0..25 {
        let q = [170.0, 80.0, 120.0].map(|reach| reach * (2.0 * random.uniform() - 1.0));
        let [waist, shoulder, wrist] = q.map(f64::to_radians);
        let about = |axis: Vector3<f64>, angle: f64| Rotation3::new(axis * angle);
        // The shoulder and the wrist turn about the waist's -y; the flange's x goes along the last link, its z where that turns over.
        let arm = about(Vector3::z(), waist) * about(Vector3::y(), -shoulder);
        let hand = arm * about(Vector3::y(), -wrist);
        let at = Vector3::new(0.0, 0.0, 100.0)
            + arm * Vector3::new(400.0, 0.0, 0.0)
            + hand * Vector3::new(300.0, 0.0, 0.0);
        // Rows: waist Rx(90), shoulder none, wrist Rx(90): x stays, y and z are turned by 180 degrees in all.
        let flange = hand * about(Vector3::x(), std::f64::consts::PI);
        text.push_str(&format!("{},{},{}", q[0], q[1], q[2]));
        for tool in tools {
            let point = base * Point3::from(at + flange * tool);
            text.push_str(&format!(",{},{},{}", point.x, point.y, point.z));
        }
        text.push('\n');
    }
    text
}

#[test]
fn a_fit_finds_a_base_and_targets_that_are_nowhere_near_where_the_file_has_them() {
    let base = pose([2500.0, -900.0, 400.0], [0.3, 0.2, 2.9]);
    let tools = [Vector3::new(120.0, -40.0, 60.0), Vector3::new(-30.0, 90.0, 10.0)];
    let model = Model::parse("m.yaml", ARM).unwrap();
    let table = Table::parse("t.csv", &rows(&base, tools)).unwrap();
    let observations = Observations::new(&model, &table).unwrap();
    let problem = ResidualModel::new(&model, &table, &observations, &[]).unwrap();
    let fit =
        problem.fit(&problem.start(), &[true; 25], FitOptions::default(), &Progress::default()).unwrap();
    assert!(apart(&fit.state.base, &base) < 1e-5, "{} {base}", fit.state.base);
    assert!(
        (fit.state.targets[0] - tools[0]).norm() < 1e-5 && (fit.state.targets[1] - tools[1]).norm() < 1e-5
    );
    assert!(fit.convergence.arrived && fit.convergence.reached < 1e-6);
}

const PLANAR: &str = "
arm: planar
convention: distal
joints:
  - {name: shoulder, a_mm: 400}
  - {name: elbow, a_mm: 300}
links: [{after: elbow, mass_kg: 2, centre_mm: [0, 0, 0]}]
base: {xyz_mm: [1000, 0, 0], rpy_deg: [90, 0, 0], free: false}
targets: {p1: {xyz_mm: [50, 0, 0], free: false}}
measured_from: world
";

/// Shows a residual model of the planar arm, which is 1 m along x, stretched out level and then with its elbow up.
fn planar(effects: &[(&str, f64)], look: impl FnOnce(&ResidualModel<'_>, &State)) {
    let model = Model::parse("m.yaml", PLANAR).unwrap();
    let table = Table::parse("t.csv", "q1_deg,q2_deg,p1_x_mm\n0,0,5\n0,90,5\n").unwrap();
    let observations = Observations::new(&model, &table).unwrap();
    let added: Vec<AddedEffect> = effects
        .iter()
        .map(|(text, value)| AddedEffect { id: parse(text, &model).unwrap(), values: vec![*value] })
        .collect();
    let problem = ResidualModel::new(&model, &table, &observations, &added).unwrap();
    look(&problem, &problem.start());
}

#[test]
fn points_along_the_arm_run_from_the_base_to_the_first_target() {
    planar(&[], |problem, state| {
        let along = problem.points_along(state, 1);
        let expected = [[1000.0, 0.0, 0.0], [1400.0, 0.0, 0.0], [1400.0, 0.0, 300.0], [1400.0, 0.0, 350.0]];
        assert_eq!(along.len(), expected.len());
        for (found, expected) in along.iter().zip(expected.map(Vector3::from)) {
            assert!((found - expected).norm() < 1e-9, "{found} {expected}");
        }
        assert!((problem.believed_point(state, 0) - Vector3::new(1750.0, 0.0, 0.0)).norm() < 1e-9);
        assert!(problem.believed_board(state, 0).is_none(), "there is no board");
    });
}

#[test]
fn moments_and_motions_of_a_row_are_those_of_the_lever() {
    planar(&[], |problem, state| {
        let details = problem.row_details(state, 0);
        // 2 kg hang 700 mm before the shoulder and 300 mm before the elbow; the axes point along -y, and the weight turns the arm down.
        let weight = 2.0 * 9.80665;
        assert!((details.moments[0] + weight * 0.7).abs() < 1e-9, "{:?}", details.moments);
        assert!((details.moments[1] + weight * 0.3).abs() < 1e-9, "{:?}", details.moments);
        // A turn of the shoulder lifts the target by 750 mm a radian, one of the elbow by 350 mm.
        assert!((details.by_joint[0] - Vector3::new(0.0, 0.0, 750.0)).norm() < 1e-9);
        assert!((details.by_joint[1] - Vector3::new(0.0, 0.0, 350.0)).norm() < 1e-9);
    });
}

#[test]
fn the_arm_stays_clear_as_long_as_every_point_of_it_does() {
    planar(&[], |problem, state| {
        let clear = |row: usize, normal: [f64; 3], offset: f64| {
            problem.stays_clear(state, row, &[HalfSpace { normal, offset }])
        };
        // In the base's frame y is up: the elbow goes up to 350 mm, target and all, and out to 400 mm.
        assert!(
            clear(1, [0.0, -1.0, 0.0], -350.1) && !clear(1, [0.0, -1.0, 0.0], -349.9),
            "a ceiling over the target"
        );
        assert!(
            clear(1, [-1.0, 0.0, 0.0], -400.1) && !clear(1, [-1.0, 0.0, 0.0], -399.9),
            "a wall before the elbow"
        );
        assert!(
            clear(0, [-1.0, 0.0, 0.0], -750.1) && !clear(0, [-1.0, 0.0, 0.0], -749.9),
            "and before the target"
        );
        assert!(problem.stays_clear(state, 0, &[]));
        let two = [
            HalfSpace { normal: [-1.0, 0.0, 0.0], offset: -400.1 },
            HalfSpace { normal: [0.0, -1.0, 0.0], offset: -349.9 },
        ];
        assert!(!problem.stays_clear(state, 1, &two), "one of two is enough");
    });
}

#[test]
fn contributions_of_a_row_are_those_of_the_effect_there() {
    planar(&[], |problem, state| {
        let gain = build(&parse("joint_gain(elbow)", problem.model).unwrap(), problem.model).unwrap();
        let contributions = problem.contributions(state, 1, gain.as_ref());
        assert!(
            contributions.len() == 1 && (contributions[0].rate - std::f64::consts::FRAC_PI_2).abs() < 1e-12
        );
    });
}

#[test]
fn an_arm_that_gives_balances_with_what_pulls_where_it_has_come_to() {
    // A shoulder this soft comes down by a good part of a radian: w = c m g (0.75 cos w ...) has to hold where it ends.
    let compliance = 0.02;
    planar(&[("joint_compliance(shoulder)", compliance)], |problem, state| {
        let point = problem.believed_point(state, 0) - Vector3::new(1000.0, 0.0, 0.0);
        let angle = point.z.atan2(point.x);
        let expected = -compliance * 2.0 * 9.80665 * 0.7 * angle.cos();
        // Three rounds leave the cube of the first round's share.
        assert!((angle - expected).abs() < 0.02 * expected.abs(), "{angle} {expected}");
        assert!((-0.275..-0.25).contains(&angle), "{angle}");
    });
}

#[test]
fn changes_add_up_each_where_it_belongs() {
    let mut changes = Changes::none(2, 1);
    let contribution = |parameter, dof, rate| Contribution { parameter, dof, rate };
    let contributions = [
        contribution(0, Dof::ReadingZero(Channel::of(&DISTANCE).unwrap()), 2.0),
        contribution(1, Dof::ReadingScale(Channel::of(&DISTANCE).unwrap()), 3.0),
        contribution(0, Dof::ReadingZero(Channel::TiltX), -1.0),
        contribution(0, Dof::Trigger, 0.5),
        contribution(5, Dof::Trigger, 100.0),
    ];
    changes.add(&contributions, &[0.1, 0.01]);
    changes.add(&contributions[..1], &[0.2]);
    let pose = crate::fit::ArmPose { changes, ..Default::default() };
    let (zero, scale) = pose.reading(Some(Channel::of(&DISTANCE).unwrap()));
    assert!((zero - 0.6).abs() < 1e-12 && (scale - 0.03).abs() < 1e-12, "{zero} {scale}");
    assert_eq!(pose.reading(Some(Channel::TiltX)), (-0.1, 0.0));
    assert_eq!(pose.reading(Some(Channel::of(&HEIGHT).unwrap())), (0.0, 0.0));
    assert_eq!(pose.reading(None), (0.0, 0.0), "what no instrument reads out");
    assert!((pose.trigger_height() - 0.05).abs() < 1e-12, "a parameter without a value is zero");
}

#[test]
fn a_large_turn_of_the_base_changes_with_its_vector_as_the_rotation_group_has_it() {
    // d/dv exp(v) in the direction e turns by J(v) e; by differences of two rotations.
    let rotation = Vector3::new(0.7, -1.1, 0.4);
    let text = PLANAR.replace("free: false}\ntargets", "free: true, per: session}\ntargets");
    let model = Model::parse("m.yaml", &format!("{text}epochs: {{sessions: [a, b]}}\n")).unwrap();
    let table = Table::parse("t.csv", "q1_deg,q2_deg,p1_x_mm,session\n0,0,5,a\n0,90,5,b\n").unwrap();
    let observations = Observations::new(&model, &table).unwrap();
    let added = AddedEffect {
        id: parse("base_reset", &model).unwrap(),
        values: vec![0.0, 0.0, 0.0, rotation.x, rotation.y, rotation.z],
    };
    let problem = ResidualModel::new(&model, &table, &observations, &[added]).unwrap();
    let state = problem.start();
    let jacobian = problem.block(&state, &[1], &[], &[]).jacobian;
    // The target of the second row, off the base's origin: turned by exp(v).
    let lever = Vector3::new(400.0, 0.0, 350.0);
    for axis in 0..3 {
        let at = |by: f64| Rotation3::new(rotation + Vector3::ith(axis, by)) * lever;
        let slope = (at(1e-6) - at(-1e-6)) / 2e-6;
        let free_parameter = problem.free_parameters().len() - 3 + axis;
        assert!(
            (jacobian[(free_parameter, 0)] - slope.x).abs() < 1e-4,
            "{axis}: {} {slope}",
            jacobian[(free_parameter, 0)]
        );
    }
}

#[test]
fn pixels_lie_where_their_rays_meet_the_sheet() {
    let mut model = Model::parse("m.yaml", PLANAR).unwrap();
    model.stripe_rig = Some(StripeRig {
        focal_px: [500.0, 400.0],
        principal_px: [100.0, 90.0],
        distortion: [0.0; 5],
        flange_from_camera: nalgebra::Isometry3::identity(),
        normal: Vector3::z(),
        d_mm: -100.0,
        bow: 0.0,
    });
    let table = Table::parse("t.csv", "q1_deg,q2_deg,p1_x_mm\n0,0,5\n0,90,5\n").unwrap();
    let observations = Observations::new(&model, &table).unwrap();
    let problem = ResidualModel::new(&model, &table, &observations, &[]).unwrap();
    let state = problem.start();
    let found = problem.stripe_points(&state, 0, &[[100.0, 90.0], [150.0, 50.0]]);
    // Stretched out the flange's x is the world's, its y the world's z, its z the world's -y; 50 px aside are 10 mm, 40 px up are -10 mm.
    assert!((found[0].unwrap() - Vector3::new(1700.0, -100.0, 0.0)).norm() < 1e-9, "{found:?}");
    assert!((found[1].unwrap() - Vector3::new(1710.0, -100.0, -10.0)).norm() < 1e-9, "{found:?}");
    assert_eq!(problem.rig(&state), model.stripe_rig);
    planar(&[], |problem, state| {
        assert!(problem.rig(state).is_none() && problem.stripe_points(state, 0, &[[1.0, 1.0]]) == [None]);
    });
}

#[test]
fn bodies_whose_poses_a_table_holds_are_listed_with_them() {
    let text = PLANAR.replace(
        "targets: {p1: {xyz_mm: [50, 0, 0], free: false}}",
        "targets: {p1: {xyz_mm: [50, 0, 0]}, p2: {}}\nboard: {seen_by: p2, xyz_mm: [1, 2, 3], rpy_deg: [0, 0, 0], free: true}",
    );
    let model = Model::parse("m.yaml", &text).unwrap();
    let rows = "q1_deg,q2_deg,p1_x_mm,p1_y_mm,p1_z_mm,p1_rx_deg,p1_ry_deg,p1_rz_deg,board_x_mm,board_y_mm,board_z_mm,board_rx_deg,board_ry_deg,board_rz_deg\n\
                0,0,10,20,30,0,0,90,,,,0,0,90\n5,5,,,,,,,1,2,3,,,\n";
    let table = Table::parse("t.csv", rows).unwrap();
    let observations = Observations::new(&model, &table).unwrap();
    let problem = ResidualModel::new(&model, &table, &observations, &[]).unwrap();
    let state = problem.start();
    assert_eq!(problem.seen_bodies(), [SeenBody::Target(0), SeenBody::Board(0)]);
    assert_eq!([SeenBody::Target(0), SeenBody::Board(0)].map(|body| body.target(&problem)), [0, 1]);
    let of_target = problem.seen_poses(&state, &[0, 1], SeenBody::Target(0));
    assert_eq!(of_target.len(), 1, "the second row has no orientation");
    assert_eq!(of_target[0].seen.translation.vector, Vector3::new(10.0, 20.0, 30.0));
    assert!((of_target[0].seen.rotation * Vector3::x() - Vector3::y()).norm() < 1e-12);
    assert!((of_target[0].flange.translation.vector - Vector3::new(700.0, 0.0, 0.0)).norm() < 1e-9);
    let of_board = problem.seen_poses(&state, &[0, 1], SeenBody::Board(0));
    assert!(of_board.len() == 1 && of_board[0].seen.translation.vector.iter().all(|part| part.is_nan()));
    // Of the board the pose is the camera's as the board sees it: turned the other way.
    assert!((of_board[0].seen.rotation * Vector3::x() + Vector3::y()).norm() < 1e-12);
}

#[test]
fn a_residual_map_shifts_the_base_and_moves_joints_in_their_own_sense() {
    let text = "
arm: mapped
convention: distal
joints: [{name: turn, a_mm: 100, sign: -1}, {name: slide, slides: true}]
base: {xyz_mm: [0, 0, 0], rpy_deg: [0, 0, 90], free: false}
targets: {p1: {free: false}}
measured_region: {ranges: {turn: [-90, 90], slide: [0, 50]}, reach: 3, poses: [[-90, 0], [90, 50]]}
residual_map: {not_understood: 0.5, sides: [{joint: turn, weights: [1.5]}, {joint: slide, weights: [0.25]}], waves: [{rates: [0, 0, 0], phase_rad: 0, shift_mm: [2, 0, 0]}]}
";
    let model = Model::parse("m.yaml", text).unwrap();
    let (low, high) = (
        model.measured_region.as_ref().unwrap().joints[0].low,
        model.measured_region.as_ref().unwrap().joints[0].high,
    );
    assert!(
        (low + std::f64::consts::FRAC_PI_2).abs() < 1e-12
            && (high - std::f64::consts::FRAC_PI_2).abs() < 1e-12
    );
    let rows = "q1_deg,q2_mm,p1_x_mm,approach_q1,approach_q2\n0,25,0,0,0\n0,25,0,1,0\n0,25,0,0,1\n";
    let table = Table::parse("t.csv", rows).unwrap();
    let observations = Observations::new(&model, &table).unwrap();
    let problem = ResidualModel::new(&model, &table, &observations, &[]).unwrap();
    let at = |row: usize| problem.believed_point(&problem.start(), row);
    // The arm points along the base's x, which is the world's y; the wave is the same everywhere and shifts the base along its x.
    assert!((at(0) - Vector3::new(0.0, 102.0, 25.0)).norm() < 1e-9, "{}", at(0));
    // From below the turn is 1.5 degrees more in its own sense, which turns the other way.
    let turned = 1.5_f64.to_radians();
    let expected = Vector3::new(100.0 * turned.sin(), 2.0 + 100.0 * turned.cos(), 25.0);
    assert!((at(1) - expected).norm() < 1e-9, "{} {expected}", at(1));
    assert!((at(2) - Vector3::new(0.0, 102.0, 25.25)).norm() < 1e-9, "{}", at(2));
}

#[test]
fn whole_points_are_seen_and_points_of_which_an_axis_is_missing_are_not() {
    let model =
        Model::parse("m.yaml", &super::PLANAR.replace("free: false}\ntargets", "free: true}\ntargets"))
            .unwrap();
    let text =
        "q1_deg,q2_deg,p1_x_mm,p1_y_mm,p1_z_mm\n0,0,700,0,0\n90,0,0,,0\n0,90,400,300,0\n90,0,0,700,1\n";
    let table = Table::parse("t.csv", text).unwrap();
    let observations = Observations::new(&model, &table).unwrap();
    let problem = ResidualModel::new(&model, &table, &observations, &[]).unwrap();
    let found = crate::fit::align::sights(&problem, &problem.start(), &[0, 1, 2, 3]);
    let measured: Vec<[f64; 3]> = found.iter().map(|sight| sight.measured.into()).collect();
    assert_eq!(measured, [[700.0, 0.0, 0.0], [400.0, 300.0, 0.0], [0.0, 700.0, 1.0]]);
    assert!(found.iter().all(|sight| sight.target == 0));
    assert!((found[1].flange.translation.vector - Vector3::new(400.0, 300.0, 0.0)).norm() < 1e-9);
}

#[test]
fn a_base_that_is_far_from_where_the_model_has_it_is_found_from_no_start() {
    let model =
        Model::parse("m.yaml", &super::PLANAR.replace("free: false}\ntargets", "free: true}\ntargets"))
            .unwrap();
    // The arm turned by 120 degrees and a metre away.
    let base = Rotation3::from_euler_angles(0.0, 0.0, 120.0_f64.to_radians());
    let mut text = "q1_deg,q2_deg,p1_x_mm,p1_y_mm,p1_z_mm\n".to_owned();
    for step in 0..12 {
        let (one, other) = (f64::from(step) * 20.0 - 110.0, f64::from(step * 37 % 150) - 70.0);
        let (first, second) = (one.to_radians(), (one + other).to_radians());
        let tip = Vector3::new(
            400.0 * first.cos() + 300.0 * second.cos(),
            400.0 * first.sin() + 300.0 * second.sin(),
            0.0,
        );
        let seen = base * tip + Vector3::new(1000.0, -200.0, 50.0);
        text.push_str(&format!("{one},{other},{},{},{}\n", seen.x, seen.y, seen.z));
    }
    let table = Table::parse("t.csv", &text).unwrap();
    let observations = Observations::new(&model, &table).unwrap();
    let problem = ResidualModel::new(&model, &table, &observations, &[]).unwrap();
    let rows: Vec<usize> = (0..12).collect();
    let found = crate::fit::align::align(&problem, &problem.start(), &rows, &Progress::default()).unwrap();
    assert!(
        (found.base.translation.vector - Vector3::new(1000.0, -200.0, 50.0)).norm() < 1e-6,
        "{}",
        found.base
    );
    assert!((found.base.rotation.matrix() - base.matrix()).norm() < 1e-9);
}

#[test]
fn boards_that_a_table_speaks_of_are_those_it_names_and_the_one_that_most_rows_see_comes_first() {
    let targets = "targets: {p1: {}, p2: {}}\n";
    let boards = "boards: {floor: {seen_by: p2}, wall: {seen_by: p2}, door: {seen_by: p2}}\n";
    let arm = super::PLANAR.replace("targets: {p1: {xyz_mm: [0, 0, 0], free: false}}\n", targets);
    let model = Model::parse("m.yaml", &format!("{arm}{boards}")).unwrap();
    let header = "q1_deg,q2_deg,board,board_x_mm,board_y_mm,board_z_mm";
    let rows = "0,0,floor,1,2,300\n5,5,wall,1,2,300\n6,9,wall,3,1,310\n7,7,floor,,,\n";
    let table = Table::parse("t.csv", &format!("{header}\n{rows}")).unwrap();
    let observations = Observations::new(&model, &table).unwrap();
    let problem = ResidualModel::new(&model, &table, &observations, &[]).unwrap();
    assert_eq!(problem.boards_named(), [0, 1], "nobody speaks of the door");
    assert_eq!(problem.boards_seen(), [1, 0]);
    // Each row's equations are of the board that it names.
    let of_rows: Vec<u32> = (0..3).map(|row| observations.of_row(row)[0].measurand.index).collect();
    assert_eq!(of_rows, [0, 1, 1]);
    let plain = Table::parse("t.csv", "q1_deg,q2_deg,p1_x_mm\n0,0,700\n").unwrap();
    let observations = Observations::new(&model, &plain).unwrap();
    let problem = ResidualModel::new(&model, &plain, &observations, &[]).unwrap();
    assert!(problem.boards_named().is_empty() && problem.boards_seen().is_empty());
}

/// A place that is touched begins at the middle of where the arm believes it; one that no row touches stays.
#[test]
fn every_touched_place_begins_where_the_arm_touched_it() {
    let model = Model::parse("m.yaml", PLANAR).unwrap();
    let table = Table::parse("t.csv", "q1_deg,q2_deg,touch\n0,0,a\n0,90,b\n0,0,b\n90,0,c\n").unwrap();
    let observations = Observations::new(&model, &table).unwrap();
    let problem = ResidualModel::new(&model, &table, &observations, &[]).unwrap();
    let mut state = problem.start();
    crate::fit::align::place_touched(&problem, &mut state, &[0, 1, 2]);
    // Stretched out the tip is at x = 1750 mm, with the elbow up at (1400, 0, 350).
    let expected = [[1750.0, 0.0, 0.0], [1575.0, 0.0, 175.0], [0.0, 0.0, 0.0]];
    assert_eq!(state.places.len(), 3);
    for (found, expected) in state.places.iter().zip(expected.map(Vector3::from)) {
        assert!((found - expected).norm() < 1e-9, "{:?}", state.places);
    }
}
