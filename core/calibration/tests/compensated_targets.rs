//! Joint targets made anew for a calibrated arm.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use nalgebra::{IsometryMatrix3, Translation3};
use plumb_calibration::arm_model::Model;
use plumb_calibration::export::compensated_targets;
use plumb_calibration::forward::ForwardModel;
use plumb_calibration::table::Table;

const UR5: &str = include_str!("../../../workcells/ur5/ur5.model.yaml");

const FOUND: &str = "effects:
  - {effect: joint_compliance, where: lift, values: {compliance: 3.0e-5}}
  - {effect: joint_zero, where: elbow, values: {zero_deg: 0.2}}
  - {effect: joint_backlash, where: wrist1, values: {play_deg: 0.05}}";

fn models() -> (Model, Model) {
    let drawing = Model::parse("ur5.yaml", UR5).unwrap();
    (drawing, Model::parse("rev1.yaml", &UR5.replace("effects: []", FOUND)).unwrap())
}

fn poses(text: &str) -> Table {
    Table::parse("program.csv", &format!("q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg\n{text}")).unwrap()
}

/// The tip with the directions of the hand.
fn tip(model: &Model, q: &[f64], sides: &[i8]) -> IsometryMatrix3<f64> {
    let flange = ForwardModel::new(model.clone()).unwrap().flange(q, sides);
    model.base.pose * flange * Translation3::from(model.targets[0].xyz)
}

#[test]
fn the_calibrated_arm_comes_where_the_drawing_would_have_with_its_hand_as_drawn() {
    let (drawing, calibrated) = models();
    let table = poses("10,-80,70,-60,80,20\n-50,-120,90,-40,60,-100\n-50,-100,100,-90,70,0\n");
    let targets = compensated_targets(&drawing, &calibrated, &table).unwrap();
    // From the row before: down or up, or none for the first and for a joint that stays.
    let sides: [&[i8]; 3] = [&[], &[-1, -1, 1, 1, -1, -1], &[0, 1, 1, -1, 1, 1]];
    for ((target, q), sides) in targets.iter().zip(table.q.chunks_exact(6)).zip(sides) {
        let (expected, comes) = (tip(&drawing, q, &[]), tip(&calibrated, &target.q, sides));
        assert!((expected.translation.vector - comes.translation.vector).norm() < 1e-5);
        assert!(expected.rotation.angle_to(&comes.rotation) < 1e-7);
        assert_eq!(target.requested, expected.translation.vector);
        assert!(target.off_before > 0.5, "{} mm", target.off_before);
    }
}

#[test]
fn by_the_drawing_itself_nothing_changes() {
    let (drawing, _) = models();
    let table = poses("10,-80,70,-60,80,20\n");
    let targets = compensated_targets(&drawing, &drawing, &table).unwrap();
    assert!(targets[0].q.iter().zip(&table.q).all(|(new, old)| (new - old).abs() < 1e-9));
}

#[test]
fn what_is_out_of_reach_or_of_another_arm_is_reported_with_its_line() {
    let (drawing, calibrated) = models();
    let refused = |table: &Table| compensated_targets(&drawing, &calibrated, table).unwrap_err().to_string();
    let beyond = refused(&poses("10,-80,70,-60,80,20\n10,-80,-149.95,-60,80,20\n"));
    assert!(beyond.starts_with("program.csv: line 3: `elbow` would have to go to"), "{beyond}");
    let five = Table::parse("five.csv", "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg\n1,2,3,4,5\n").unwrap();
    assert_eq!(refused(&five), "five.csv: poses of 5 joints for an arm of 6");
    let scara =
        Model::parse("scara.yaml", include_str!("../../../workcells/scara/scara.model.yaml")).unwrap();
    let four = compensated_targets(&scara, &scara, &five).unwrap_err().to_string();
    assert!(four.contains("for which an arm has six joints or more"), "{four}");
}
