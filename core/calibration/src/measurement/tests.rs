//! Every kind's prediction against an independent computation, and its derivatives against differences.

mod kinds;

use nalgebra::{Isometry3, Rotation3, Vector3};

use super::*;
use crate::arm_model::{AddedEffect, Model, StripeRig};
use crate::effect::{EffectId, Site, build};
use crate::fit::{ResidualModel, State};
use crate::table::{Stretch, Table};

const ARM: &str = "
arm: folded
convention: distal
joints:
  - {name: waist, a_mm: 0, alpha_deg: 90, d_mm: 195, theta_deg: 0}
  - {name: shoulder, a_mm: 177.8, alpha_deg: 0, d_mm: 0, theta_deg: 0}
  - {name: elbow, a_mm: 177.8, alpha_deg: 0, d_mm: 0, theta_deg: 0, less: shoulder}
  - {name: pitch, a_mm: 0, alpha_deg: 90, d_mm: 0, theta_deg: 90, less: elbow}
  - {name: roll, a_mm: 0, alpha_deg: 0, d_mm: 109, theta_deg: 0}
base: {xyz_mm: [0, 0, 0], rpy_deg: [0, 0, 0], free: false}
targets: {p1: {xyz_mm: [0, 0, 8], free: false}}
surfaces:
  table: {plane: {normal: [0, 0, 1], offset_mm: 0}, free: false}
  line_b: {line: {point_mm: [140, 0, 0], direction: [0, 1, 0], light: right}, free: false}
measured_from: world
sensor: {working_mm: 8, peak_mm: 5, spot_mm: 3, hysteresis_percent: 10, dark_percent: 7}
noise: {on_mm: 1}
";

/// The hand tilted outward and 2 mm lower than where it fires.
const EDGE: &str = "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,on,signal\n12,24.9,-112,-65,0,line_b,off\n";

#[test]
fn a_tilted_hand_meets_an_edge_where_it_looks_and_its_derivatives_say_so() {
    let model = Model::parse("arm.yaml", ARM).unwrap();
    let table = Table::parse("edge.csv", EDGE).unwrap();
    let observations = Observations::new(&model, &table).unwrap();
    let zeros: Vec<AddedEffect> = (0..4)
        .map(|joint| AddedEffect { id: EffectId::at("joint_zero", Site::Joint(joint)), values: vec![0.0] })
        .collect();
    assert!(zeros.iter().all(|zero| build(&zero.id, &model).is_ok()));
    let problem = ResidualModel::new(&model, &table, &observations, &zeros).unwrap();
    let residual = |state: &State| problem.block(state, &[0], &[1.0], &[]).residuals[0];
    let start = problem.start();

    let point = problem.believed_point(&start, 0);
    let look_outward = 65_f64.to_radians().tan().recip();
    let seen = point.x + point.z * look_outward * 12_f64.to_radians().cos();
    assert!(point.z.abs() > 1.0, "the point is not on the table: {point}");
    let early = {
        let sensor = problem.model.sensor.unwrap();
        let distance = sensor.working + point.z / 65_f64.to_radians().sin();
        -0.5 * sensor.spot * sensor.early(false, distance, sensor.hysteresis)
    };
    // Left of a line along y, seen from above, is towards -x.
    let expected = -(-(seen - 140.0) - early);
    assert!((residual(&start) - expected).abs() < 1e-6, "{} {expected}", residual(&start));

    let jacobian = problem.block(&start, &[0], &[1.0], &[]).jacobian;
    for joint in 0..4 {
        let at = |by: f64| {
            let mut state = start.clone();
            state.effects[joint][0] += by;
            residual(&state)
        };
        let slope = (at(-1e-5) - at(1e-5)) / 2e-5;
        assert!(
            (jacobian[(joint, 0)] - slope).abs() < 0.05 + 2e-3 * slope.abs(),
            "{joint}: {slope} {jacobian}"
        );
    }
}

/// An arm with everything that can be measured on it; all that may be free is.
const ALL: &str = "
arm: everything
convention: distal
joints:
  - {name: waist, a_mm: 0, alpha_deg: 90, d_mm: 195, theta_deg: 0}
  - {name: shoulder, a_mm: 177.8, alpha_deg: 0, d_mm: 10, theta_deg: 0}
  - {name: elbow, a_mm: 177.8, alpha_deg: 0, d_mm: -5, theta_deg: 0}
  - {name: pitch, a_mm: 0, alpha_deg: 90, d_mm: 0, theta_deg: 90}
  - {name: roll, a_mm: 0, alpha_deg: 0, d_mm: 109, theta_deg: 0}
base: {xyz_mm: [3, -4, 5], rpy_deg: [1, -2, 10], free: true}
targets: {p1: {xyz_mm: [4, 2, 8], rpy_deg: [20, -30, 140], free: true}, p2: {xyz_mm: [-30, 12, 20], rpy_deg: [5, 8, -100], free: true}}
board: {seen_by: p2, xyz_mm: [250, -60, -20], rpy_deg: [170, 10, 30], free: true}
profile: {seen_by: p2}
surfaces:
  table: {plane: {normal: [0.05, -0.03, 1], offset_mm: 6}, free: true}
  ball: {sphere: {centre_mm: [200, 40, -30], radius_mm: 12}, free: true}
  line: {line: {point_mm: [140, 10, 0], direction: [0.2, 1, 0], light: right}, free: true}
  post: {point_mm: [-60, 90, 15], free: true}
level: {after: pitch}
measured_from: world
noise: {on_mm: 1}
";

/// One row of each kind; and of triggers, over each shape.
const ROWS: &str = "\
q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,p1_x_mm,p1_y_mm,p1_z_mm,p2_x_mm,p2_y_mm,p2_z_mm,height_mm,on,tilt_x_deg,tilt_y_deg,distance_mm,distance_to,touch,p1_qw,p1_qx,p1_qy,p1_qz,board_x_mm,board_y_mm,board_z_mm,board_rx_rad,board_ry_rad,board_rz_rad,p1_azimuth_deg,p2_elevation_deg
10,20,-60,-40,15,150,20,60,,,,,,,,,,,,,,,,,,,,,,
12,25,-70,-30,25,,,,160,30,70,,,,,,,,,,,,,,,,,,,
-8,22,-65,-35,5,,,,,,,4.5,table,,,,,,,,,,,,,,,,,
-8,22,-65,-35,5,,,,,,,,table,,,,,,,,,,,,,,,,,
9,22,-65,-35,5,,,,,,,,ball,,,,,,,,,,,,,,,,,
7,24,-66,-33,15,,,,,,,,line,,,,,,,,,,,,,,,,,
7,26,-64,-31,25,,,,,,,,post,,,,,,,,,,,,,,,,,
11,18,-50,-45,35,,,,,,,,,4,,,,,,,,,,,,,,,,
11,18,-50,-45,35,,,,,,,,,,-3,,,,,,,,,,,,,,,
14,21,-62,-41,45,,,,,,,,,,,210,post,,,,,,,,,,,,,
16,23,-61,-43,55,,,,,,,,,,,190,ball,,,,,,,,,,,,,
18,27,-58,-47,65,,,,,,,,,,,,,cone,,,,,,,,,,,,
20,26,-57,-46,60,,,,,,,,,,,,,,,,,,,,,,,,,
15,19,-54,-42,33,,,,,,,,,,,,,,0.5,-0.5,0.5,0.5,,,,,,,,
13,28,-55,-41,21,,,,,,,,,,,,,,,,,,15,-20,300,0.4,-2.1,0.9,,
17,21,-59,-44,28,,,,,,,,,,,,,,,,,,,,,,,,35,40
";

const EFFECTS: [(&str, Site); 15] = [
    ("joint_zero", Site::Joint(0)),
    ("joint_gain", Site::Joint(2)),
    ("link_length", Site::Joint(1)),
    ("link_twist", Site::Joint(3)),
    ("base_tilt", Site::Base),
    ("scale", Site::Axis(1)),
    ("trigger_height", Site::Sensor),
    ("camera_aim", Site::Sensor),
    ("camera_roll", Site::Sensor),
    ("camera_scale", Site::Sensor),
    ("principal_point", Site::Sensor),
    ("lens_distortion", Site::Sensor),
    ("stripe_plane", Site::Sensor),
    ("stripe_bow", Site::Sensor),
    ("hand_eye", Site::Sensor),
];

/// A camera in the flange's origin that looks along its z, and a sheet of light 100 mm ahead of it.
fn rig() -> StripeRig {
    StripeRig {
        focal_px: [500.0, 400.0],
        principal_px: [100.0, 90.0],
        distortion: [0.0; 5],
        flange_from_camera: Isometry3::identity(),
        normal: Vector3::z(),
        d_mm: -100.0,
        bow: 0.0,
    }
}

/// A stretch on the table and one on the ball, seen in the last row.
fn stretches() -> Vec<Stretch> {
    let pixels =
        |first: f64| (0..9).map(move |step| [60.0 + 7.0 * f64::from(step), first + 9.0 * f64::from(step)]);
    vec![Stretch::new(12, 0, pixels(20.0).collect(), 0.1), Stretch::new(12, 1, pixels(40.0).collect(), 0.1)]
}

fn with_everything(look: impl Fn(&ResidualModel<'_>)) {
    let mut model = Model::parse("all.yaml", ALL).unwrap();
    model.stripe_rig = Some(rig());
    let mut table = Table::parse("rows.csv", ROWS).unwrap();
    table.stretches = stretches();
    let observations = Observations::new(&model, &table).unwrap();
    let usable = EFFECTS.iter().map(|(name, site)| EffectId::at(name, *site));
    let effects: Vec<AddedEffect> = usable
        .filter(|id| build(id, &model).is_ok())
        .map(|id| AddedEffect { id, values: Vec::new() })
        .collect();
    assert!(effects.len() >= 14, "{effects:?}");
    look(&ResidualModel::new(&model, &table, &observations, &effects).unwrap());
}

#[test]
fn every_kind_is_read_from_its_columns() {
    with_everything(|model| {
        let names: Vec<Vec<&str>> = (0..model.table.len())
            .map(|row| model.observations.of_row(row).iter().map(|one| one.measurand.kind.name()).collect())
            .collect();
        assert_eq!(names[0], ["position"; 3]);
        assert_eq!(names[1], ["position"; 3]);
        let single = [
            (2, "height"),
            (3, "trigger"),
            (4, "trigger"),
            (5, "edge"),
            (6, "trigger"),
            (7, "tilt"),
            (8, "tilt"),
            (9, "distance"),
            (10, "distance"),
        ];
        for (row, name) in single {
            assert_eq!(names[row], [name], "row {row}");
        }
        assert_eq!(names[11], ["touch"; 3]);
        assert_eq!(names[12], ["stripe"; 6]);
        assert_eq!(names[13], ["orientation"; 3]);
        assert_eq!(
            names[14],
            ["board", "board", "board", "board_rotation", "board_rotation", "board_rotation"]
        );
        assert_eq!(names[15], ["direction"; 2]);
        let mut met: Vec<&str> = names.concat();
        met.sort_unstable();
        met.dedup();
        // `on` says something else in a table of profiles: they have tests of their own (`profile_tests.rs`).
        assert_eq!(met.len() + 1, kinds().len(), "a kind has no row here: {met:?}");
    });
}

#[test]
fn derivatives_of_every_kind_by_every_free_number_agree_with_differences() {
    with_everything(|model| {
        let start = model.start();
        let rows: Vec<usize> = (0..model.table.len()).collect();
        let jacobian = model.block(&start, &rows, &[], &[]).jacobian;
        let count = model.free_parameters().len();
        for free_parameter in 0..count {
            let at = |amount: f64| {
                let mut step = vec![0.0; count];
                step[free_parameter] = amount;
                model.block(&start.stepped(model.free_parameters(), &step), &rows, &[], &[]).residuals
            };
            let (ahead, behind) = (at(1e-6), at(-1e-6));
            for (equation, (ahead, behind)) in ahead.iter().zip(&behind).enumerate() {
                let slope = (behind - ahead) / 2e-6;
                let derivative = jacobian[(free_parameter, equation)];
                let kind = model.observations.equations[equation].measurand.kind.name();
                assert!(
                    (derivative - slope).abs() < 1e-4 * (1.0 + slope.abs()),
                    "{kind}, {}: {derivative} beside {slope}",
                    model.parameter_name(model.free_parameters()[free_parameter])
                );
            }
        }
    });
}

/// The flange and the frame of the fourth joint by plain products of rotations and shifts, base frame.
fn independent_arm(q: [f64; 5]) -> [(Rotation3<f64>, Vector3<f64>); 2] {
    let table = [
        (0.0, 90.0, 195.0, 0.0),
        (177.8, 0.0, 10.0, 0.0),
        (177.8, 0.0, -5.0, 0.0),
        (0.0, 90.0, 0.0, 90.0),
        (0.0, 0.0, 109.0, 0.0),
    ];
    let (mut rotation, mut at) = (Rotation3::identity(), Vector3::zeros());
    let mut frames = Vec::new();
    for ((a, alpha, d, theta), q) in table.iter().zip(q) {
        let about_z = Rotation3::from_axis_angle(&Vector3::z_axis(), f64::to_radians(theta + q));
        at += rotation * (about_z * Vector3::new(*a, 0.0, *d));
        rotation =
            rotation * about_z * Rotation3::from_axis_angle(&Vector3::x_axis(), f64::to_radians(*alpha));
        frames.push((rotation, at));
    }
    [frames[3], frames[4]]
}

#[test]
fn predictions_agree_with_an_arm_worked_out_by_hand() {
    with_everything(|model| {
        let residuals = model.residuals(&model.start());
        let predicted = |row: usize| {
            let range = model.observations.range(row);
            let equations = model.observations.of_row(row).iter();
            equations.zip(&residuals[range]).map(|(one, left)| one.measured - left).collect::<Vec<f64>>()
        };
        let base =
            Rotation3::from_euler_angles(1_f64.to_radians(), (-2_f64).to_radians(), 10_f64.to_radians());
        let origin = Vector3::new(3.0, -4.0, 5.0);
        let point = |q: [f64; 5], tool: [f64; 3]| {
            let [_, (rotation, at)] = independent_arm(q);
            base * (at + rotation * Vector3::from(tool)) + origin
        };
        let same = |row: usize, expected: &[f64]| {
            let found = predicted(row);
            assert_eq!(found.len(), expected.len(), "row {row}");
            assert!(
                found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-8),
                "row {row}: {found:?} {expected:?}"
            );
        };
        let first = [4.0, 2.0, 8.0];
        same(0, point([10.0, 20.0, -60.0, -40.0, 15.0], first).as_slice());
        same(1, point([12.0, 25.0, -70.0, -30.0, 25.0], [-30.0, 12.0, 20.0]).as_slice());
        let over_table = |point: Vector3<f64>| {
            let normal = Vector3::new(0.05, -0.03, 1.0).normalize();
            normal.dot(&point) - 6.0
        };
        let low = point([-8.0, 22.0, -65.0, -35.0, 5.0], first);
        same(2, &[over_table(low)]);
        same(3, &[over_table(low)]);
        let ball = Vector3::new(200.0, 40.0, -30.0);
        same(4, &[(point([9.0, 22.0, -65.0, -35.0, 5.0], first) - ball).norm() - 12.0]);
        let post = Vector3::new(-60.0, 90.0, 15.0);
        same(6, &[(point([7.0, 26.0, -64.0, -31.0, 25.0], first) - post).norm()]);
        same(9, &[(point([14.0, 21.0, -62.0, -41.0, 45.0], first) - post).norm()]);
        same(10, &[(point([16.0, 23.0, -61.0, -43.0, 55.0], first) - ball).norm()]);
        let pose = [17.0, 21.0, -59.0, -44.0, 28.0];
        let (seen, high) = (point(pose, first), point(pose, [-30.0, 12.0, 20.0]));
        same(15, &[seen.y.atan2(seen.x), (high.z / high.norm()).asin()]);
        let [(level, _), _] = independent_arm([11.0, 18.0, -50.0, -45.0, 35.0]);
        // Upwards as the level's frame sees it.
        let up = (base * level).inverse() * Vector3::z();
        same(7, &[up.y.atan2(up.z)]);
        same(8, &[(-up.x).atan2(up.z)]);
        let axes = |q: [f64; 5], rpy: [f64; 3]| {
            let [_, (rotation, _)] = independent_arm(q);
            let [roll, pitch, yaw] = rpy.map(f64::to_radians);
            base * rotation * Rotation3::from_euler_angles(roll, pitch, yaw)
        };
        // What was measured is the believed orientation and the residual after it, a turn about the body's own axes.
        let close = |row: usize, first: usize, measured: Rotation3<f64>, believed: Rotation3<f64>| {
            let found = predicted(row);
            let apart = Rotation3::new(Vector3::new(found[first], found[first + 1], found[first + 2]));
            assert!(((measured * apart).matrix() - believed.matrix()).norm() < 1e-8, "row {row}: {found:?}");
            assert!(apart.angle() > 0.2, "the test tells something");
        };
        let half = nalgebra::Quaternion::new(0.5, -0.5, 0.5, 0.5);
        let body = nalgebra::UnitQuaternion::from_quaternion(half).to_rotation_matrix();
        close(13, 0, body, axes([15.0, 19.0, -54.0, -42.0, 33.0], [20.0, -30.0, 140.0]));
        let pose = [13.0, 28.0, -55.0, -41.0, 21.0];
        let camera = axes(pose, [5.0, 8.0, -100.0]);
        let seen = camera.inverse() * (Vector3::new(250.0, -60.0, -20.0) - point(pose, [-30.0, 12.0, 20.0]));
        let found = predicted(14);
        assert!((Vector3::from_column_slice(&found[..3]) - seen).norm() < 1e-8, "{found:?} {seen}");
        let [roll, pitch, yaw] = [170.0, 10.0, 30.0].map(f64::to_radians);
        let board = Rotation3::from_euler_angles(roll, pitch, yaw);
        close(14, 3, Rotation3::new(Vector3::new(0.4, -2.1, 0.9)), camera.inverse() * board);
        // A pixel shows the point 100 mm ahead that is as far aside as the pixel is of the middle, by the focal length.
        let shown = |step: f64| {
            let aside = [60.0 + 7.0 * step - 100.0, 20.0 + 9.0 * step - 90.0];
            point([20.0, 26.0, -57.0, -46.0, 60.0], [aside[0] / 5.0, aside[1] / 4.0, 100.0])
        };
        let mean: f64 = (0..9).map(|step| over_table(shown(f64::from(step)))).sum::<f64>() / 9.0;
        // In a plane the heights grow evenly: the slope is what the last is above the first, the bend nothing. Nine even steps from -1 to 1 have mean square 5/12.
        let slope = 0.5 * (over_table(shown(8.0)) - over_table(shown(0.0))) * (5.0_f64 / 12.0).sqrt();
        let found = predicted(12);
        let near = |found: f64, expected: f64| (found - expected).abs() < 1e-8;
        assert!(near(found[0], mean) && near(found[1], slope) && near(found[2], 0.0), "{found:?}");
        assert!((mean - over_table(shown(4.0))).abs() < 1e-8 && slope.abs() > 0.1);
    });
}
