//! Profiles: predictions against an arm worked out by hand, derivatives against differences, and what is refused.

use nalgebra::{Rotation3, Vector3};

use super::*;
use crate::arm_model::AddedEffect;
use crate::arm_model::Model;
use crate::effect::{EffectId, Site};
use crate::fit::ResidualModel;
use crate::table::{Table, table_text};

const MODEL: &str = "
arm: elbow
convention: distal
joints:
  - {name: waist, a_mm: 0, alpha_deg: 90, d_mm: 195, theta_deg: 0}
  - {name: shoulder, a_mm: 177.8, alpha_deg: 0, d_mm: 10, theta_deg: 0}
  - {name: roll, a_mm: 20, alpha_deg: -30, d_mm: 109, theta_deg: 0}
base: {xyz_mm: [3, -4, 5], rpy_deg: [1, -2, 10], free: true}
targets: {p1: {xyz_mm: [4, 2, 8], free: true}, p2: {xyz_mm: [-30, 12, 20], rpy_deg: [5, 8, -100], free: true}}
profile: {seen_by: p2}
surfaces:
  plate: {plane: {normal: [0.05, -0.03, 1], offset_mm: 6}, free: true}
  ball: {sphere: {centre_mm: [200, 40, -30], radius_mm: 12}, free: true}
  rim: {line: {point_mm: [140, 10, 0], direction: [0.2, 1, 0.4]}, free: true}
measured_from: world
noise: {profile_mm: 0.02}
";

const ROWS: &str = "q1_deg,q2_deg,q3_deg,profile1_x_mm,profile1_z_mm,profile2_x_mm,profile2_z_mm,on
10,20,-60,-15,150,20,160,plate
12,25,-70,-12,130,,,ball
-8,22,-65,4.5,141,6,139,rim
";

/// The flange by plain products of rotations and shifts, base frame.
fn flange(q: [f64; 3]) -> (Rotation3<f64>, Vector3<f64>) {
    let (mut rotation, mut at) = (Rotation3::identity(), Vector3::zeros());
    for ((a, alpha, d), q) in
        [(0.0, 90.0, 195.0), (177.8, 0.0, 10.0), (20.0, -30.0, 109.0)].into_iter().zip(q)
    {
        let about_z = Rotation3::from_axis_angle(&Vector3::z_axis(), f64::to_radians(q));
        at += rotation * (about_z * Vector3::new(a, 0.0, d));
        rotation =
            rotation * about_z * Rotation3::from_axis_angle(&Vector3::x_axis(), f64::to_radians(alpha));
    }
    (rotation, at)
}

/// Where a point of a profile is, frame of the measurements.
fn seen(q: [f64; 3], x: f64, z: f64) -> Vector3<f64> {
    let euler = |rpy: [f64; 3]| {
        Rotation3::from_euler_angles(rpy[0].to_radians(), rpy[1].to_radians(), rpy[2].to_radians())
    };
    let (rotation, at) = flange(q);
    let on_flange = Vector3::new(-30.0, 12.0, 20.0) + euler([5.0, 8.0, -100.0]) * Vector3::new(x, 0.0, z);
    euler([1.0, -2.0, 10.0]) * (at + rotation * on_flange) + Vector3::new(3.0, -4.0, 5.0)
}

fn refused(rows: &str) -> String {
    let model = Model::parse("model.yaml", MODEL).unwrap();
    let table = Table::parse("rows.csv", rows).unwrap();
    Observations::new(&model, &table).unwrap_err().to_string()
}

#[test]
fn predictions_agree_with_an_arm_worked_out_by_hand() {
    let (model, table) =
        (Model::parse("model.yaml", MODEL).unwrap(), Table::parse("rows.csv", ROWS).unwrap());
    let observations = Observations::new(&model, &table).unwrap();
    let problem = ResidualModel::new(&model, &table, &observations, &[]).unwrap();
    let found: Vec<f64> = problem.residuals(&problem.start()).iter().map(|left| -left).collect();
    let normal = Vector3::new(0.05, -0.03, 1.0).normalize();
    let over = |point: Vector3<f64>| normal.dot(&point) - 6.0;
    let ball = (seen([12.0, 25.0, -70.0], -12.0, 130.0) - Vector3::new(200.0, 40.0, -30.0)).norm() - 12.0;
    let direction = Vector3::new(0.2, 1.0, 0.4).normalize();
    let left = Vector3::z().cross(&direction).normalize();
    let rim = |x: f64, z: f64| {
        let away = seen([-8.0, 22.0, -65.0], x, z) - Vector3::new(140.0, 10.0, 0.0);
        [left.dot(&away), direction.cross(&left).dot(&away)]
    };
    let pose = [10.0, 20.0, -60.0];
    let mut expected = vec![over(seen(pose, -15.0, 150.0)), over(seen(pose, 20.0, 160.0)), ball];
    expected.extend([rim(4.5, 141.0), rim(6.0, 139.0)].concat());
    assert_eq!(found.len(), expected.len());
    assert!(
        found.iter().zip(&expected).all(|(one, other)| (one - other).abs() < 1e-8),
        "{found:?} {expected:?}"
    );
    assert!(observations.equations.iter().all(|one| one.is_declared && one.sigma == 0.02));
    let again = Table::parse("again.csv", &table_text(&table)).unwrap();
    assert_eq!(table_text(&again), table_text(&table));
}

#[test]
fn derivatives_by_every_free_number_agree_with_differences() {
    let (model, table) =
        (Model::parse("model.yaml", MODEL).unwrap(), Table::parse("rows.csv", ROWS).unwrap());
    let observations = Observations::new(&model, &table).unwrap();
    let zeros: Vec<AddedEffect> = (0..3)
        .map(|joint| AddedEffect { id: EffectId::at("joint_zero", Site::Joint(joint)), values: vec![0.0] })
        .collect();
    let problem = ResidualModel::new(&model, &table, &observations, &zeros).unwrap();
    let (start, count, rows) = (problem.start(), problem.free_parameters().len(), [0, 1, 2]);
    // Base 6, two targets 3 each, the sensor's turn 3, plane 3, ball 3, edge in space 4, three zeros.
    assert_eq!(count, 6 + 6 + 3 + 3 + 3 + 4 + 3);
    let jacobian = problem.block(&start, &rows, &[], &[]).jacobian;
    for free_parameter in 0..count {
        let at = |amount: f64| {
            let mut step = vec![0.0; count];
            step[free_parameter] = amount;
            problem.block(&start.stepped(problem.free_parameters(), &step), &rows, &[], &[]).residuals
        };
        let (ahead, behind) = (at(1e-6), at(-1e-6));
        for (equation, (ahead, behind)) in ahead.iter().zip(&behind).enumerate() {
            let (slope, derivative) = ((behind - ahead) / 2e-6, jacobian[(free_parameter, equation)]);
            let name = problem.parameter_name(problem.free_parameters()[free_parameter]);
            assert!(
                (derivative - slope).abs() < 1e-4 * (1.0 + slope.abs()),
                "{name}, {equation}: {derivative} beside {slope}"
            );
        }
    }
}

#[test]
fn profiles_that_lack_something_are_refused_with_what_would_be_right() {
    let head = "q1_deg,q2_deg,q3_deg,profile_x_mm,profile_z_mm,on\n";
    for (row, part) in [
        ("1,2,3,4,150,\n", "line 2: a profile needs `on`, the name of the surface it lies on"),
        ("1,2,3,4,,plate\n", "`profile` has its x and no `profile_z_mm`"),
        ("1,2,3,,,plate\n", "the row has no point of it"),
        (
            "1,2,3,4,150,plat\n",
            "`plat` in column `on` is not in the model's `surfaces:`; did you mean `plate`?",
        ),
    ] {
        let message = refused(&format!("{head}{row}"));
        assert!(message.contains(part), "{part}: {message}");
    }
    let without = MODEL.replace("profile: {seen_by: p2}\n", "");
    let (model, table) =
        (Model::parse("model.yaml", &without).unwrap(), Table::parse("rows.csv", ROWS).unwrap());
    let message = Observations::new(&model, &table).unwrap_err().to_string();
    assert!(message.contains("`profile: {seen_by: p1}`"), "{message}");
    for (text, part) in [
        (MODEL.replace(", radius_mm: 12", ""), "radius_mm"),
        (MODEL.replace("radius_mm: 12", "radius_mm: -12"), "a ball of radius -12 mm cannot be"),
        (
            MODEL.replace("profile: {seen_by: p2}", "profile: {seen_by: p3}"),
            "no target `p3` that could be the laser line sensor",
        ),
    ] {
        let message = Model::parse("model.yaml", &text).unwrap_err().to_string();
        assert!(message.contains(part), "{part}: {message}");
    }
    for (header, part) in [
        ("profile_x,profile_z_mm", "the unit is missing: write profile_x_mm"),
        ("profile_x_px,profile_z_mm", "units are mm, m, in"),
        ("profile1_y_mm,profile1_z_mm", "across its plane it measures nothing"),
    ] {
        let message = Table::parse("t.csv", &format!("q1_deg,q2_deg,q3_deg,{header},on\n1,2,3,4,5,plate\n"))
            .unwrap_err();
        assert!(message.to_string().contains(part), "{part}: {message}");
    }
}
