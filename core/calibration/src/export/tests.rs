//! What is written puts the flange where the model does.

mod forms;

use super::*;
use crate::arm_model::Model;
use crate::forward::ForwardModel;

const PUMA: &str = include_str!("../../../../workcells/arms/puma560.yaml");
const SCARA: &str = include_str!("../../../../workcells/arms/scara4.yaml");

/// Errors of every kind that rigid links hold.
const ERRORS: &str = "effects:
  - {effect: joint_zero, where: shoulder, values: {zero_deg: 0.3}}
  - {effect: link_length, where: shoulder, values: {length_mm: 1.1}}
  - {effect: link_offset, where: elbow, values: {offset_mm: -0.7}}
  - {effect: link_twist, where: shoulder, values: {twist_deg: 0.05}}
  - {effect: axis_skew, where: elbow, values: {skew_deg: -0.04}}
";

fn model(text: &str, effects: &str) -> Model {
    assert!(text.contains("effects: []"));
    Model::parse("arm.yaml", &text.replace("effects: []", effects)).unwrap()
}

/// Coordinates that are spread over their limits, the same each time.
fn poses(joints: usize) -> Vec<Vec<f64>> {
    (0..200)
        .map(|pose| (0..joints).map(|joint| ((pose * 7 + joint * 13) % 31) as f64 / 10.0 - 1.5).collect())
        .collect()
}

fn assert_same_flange(model: Model) {
    let arm = RigidArm::of(&model).unwrap();
    assert!(arm.left_out.is_empty() && arm.not_the_robot.is_empty(), "{arm:?}");
    let forward = ForwardModel::new(model.clone()).unwrap();
    for q in poses(model.chain.len()) {
        let (ours, theirs) = (arm.flange(&q), forward.flange(&q, &[]));
        let off = (ours.translation.vector - theirs.translation.vector).norm();
        let turned = (ours.rotation.matrix() - theirs.rotation.matrix()).norm();
        assert!(off < 1e-9 && turned < 1e-12, "{off} mm, {turned} at {q:?}");
    }
}

#[test]
fn rigid_links_put_the_flange_where_the_model_with_its_errors_does() {
    assert_same_flange(model(PUMA, ERRORS));
    assert_same_flange(Model::parse("scara.yaml", SCARA).unwrap());
}

#[test]
fn what_rigid_links_cannot_hold_is_named_and_what_is_not_there_is_not() {
    let soft = "effects:
  - {effect: joint_compliance, where: shoulder, values: {compliance: 1.0e-4}}
  - {effect: joint_backlash, where: elbow, values: {play_deg: 0.0}}
";
    let arm = RigidArm::of(&model(PUMA, soft)).unwrap();
    assert_eq!(arm.left_out, ["joint_compliance(shoulder)"]);
}

#[test]
fn a_residual_map_is_named_as_what_rigid_links_cannot_hold() {
    const MAPPED: &str = "arm: two
convention: distal
joints: [{name: turn, a_mm: 100}, {name: slide, slides: true}]
targets: {p1: {}}
measured_region: {ranges: {turn: [-90, 95], slide: [0, 50]}, reach: 0.5, poses: [[-90, 0], [95, 50]]}
residual_map: {not_understood: 0.6, along: [{joint: slide, weights: [0.1, 0.02]}]}
";
    let arm = RigidArm::of(&Model::parse("arm.yaml", MAPPED).unwrap()).unwrap();
    assert_eq!(arm.left_out, ["the residual map"]);
}

#[test]
fn a_calibration_of_six_joints_is_refused_to_an_arm_of_four() {
    let arm = RigidArm::of(&Model::parse("scara.yaml", SCARA).unwrap()).unwrap();
    let error = ros_calibration(&arm).unwrap_err().to_string();
    assert!(error.starts_with("a UR driver's calibration is of six joints;"), "{error}");
}

#[test]
fn the_table_holds_the_rows_with_their_errors() {
    let model = model(PUMA, ERRORS);
    let table = dh_table(&RigidArm::of(&model).unwrap(), &model);
    let shoulder = model.chain.joints.iter().find(|joint| joint.name == "shoulder").unwrap();
    let row: Vec<&str> =
        table.lines().find(|line| line.starts_with("shoulder,")).unwrap().split(',').collect();
    assert_eq!(row[2].parse::<f64>().unwrap(), shoulder.a + 1.1);
    assert!((row[5].parse::<f64>().unwrap() - shoulder.theta.to_degrees() - 0.3).abs() < 1e-9, "{table}");
}
