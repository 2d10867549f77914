//! What each form holds, line by line: texts of URDF and of a UR driver, tables of compensation, and targets made anew.

use crate::arm_model::{Along, MeasuredRegion, Model, ResidualMap, Side, Wave};
use crate::export::{
    CompensationError, MOST_LINES, RigidArm, compensated_targets, compensation, linuxcnc, ros_calibration,
    urdf,
};
use crate::table::Table;
use nalgebra::Vector3;

const AXIS: &str = "
arm: axis
convention: distal
joints: [{name: x, slides: true, limits_mm: [0, 100], screw_pitch_mm: 10}]
targets: {p1: {}}
";

fn axis(more: &str) -> Model {
    Model::parse("axis.yaml", &format!("{AXIS}{more}")).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn a_table_of_compensation_holds_where_the_joint_really_is() {
    let effects = "effects:
  - {effect: joint_zero, where: x, values: {zero_mm: 0.5}}
  - {effect: joint_gain, where: x, values: {gain: 0.001}}
  - {effect: joint_backlash, where: x, values: {play_mm: 0.04}}
";
    let table = compensation(&axis(effects), 0, 3).unwrap();
    let expected = [[0.0, 0.48, 0.52], [50.0, 50.53, 50.57], [100.0, 100.58, 100.62]];
    assert_eq!((table.lines.len(), table.unit, table.left_out.len()), (3, "mm", 0));
    for (line, expected) in table.lines.iter().zip(expected) {
        assert!(
            line.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12),
            "{line:?} instead of {expected:?}"
        );
    }
    assert!(table.between < 1e-12, "straight lines miss nothing of a straight error: {}", table.between);
    assert_eq!(linuxcnc(&table).lines().next(), Some("0.000000 0.480000 0.520000"));
    // A row that counts the other way has its errors in its own coordinate's sense.
    let against = Model::parse(
        "axis.yaml",
        &format!("{}{effects}", AXIS.replace("slides: true", "slides: true, sign: -1")),
    )
    .unwrap();
    let table = compensation(&against, 0, 3).unwrap();
    assert!(
        (table.lines[1][1] - 50.53).abs() < 1e-12 && (table.lines[1][2] - 50.57).abs() < 1e-12,
        "{table:?}"
    );
}

#[test]
fn lines_are_at_least_two_and_at_most_what_linuxcnc_takes() {
    let model = axis("");
    for (asked, made) in [(0, 2), (2, 2), (256, 256), (1000, MOST_LINES)] {
        assert_eq!(compensation(&model, 0, asked).unwrap().lines.len(), made, "{asked}");
    }
    let table = compensation(&model, 0, 2).unwrap();
    assert_eq!(table.lines, [[0.0; 3], [100.0; 3]]);
}

#[test]
fn a_wave_needs_eight_lines_in_its_period() {
    let wave = "effects: [{effect: screw_wave, where: x, n: 1, values: {sine_mm: 0.02}}]\n";
    // A period of 10 mm needs lines 1.25 mm apart: 81 over 100 mm.
    let fine = compensation(&axis(wave), 0, 81).unwrap();
    assert!(fine.left_out.is_empty(), "{:?}", fine.left_out);
    assert!((fine.lines[2][1] - 2.5 - 0.02).abs() < 1e-9, "the crest: {:?}", fine.lines[2]);
    assert!(fine.between < 0.02 / 12.0 && fine.between > 0.02 / 30.0, "{}", fine.between);
    let coarse = compensation(&axis(wave), 0, 80).unwrap();
    assert!(coarse.left_out[0].contains("screw_wave(x, 1) (its period is 10 mm"), "{:?}", coarse.left_out);
    assert!(coarse.left_out[0].contains("1.250 would do"), "{:?}", coarse.left_out);
    assert_eq!(coarse.lines[0], [0.0; 3], "it is not in the table");
}

#[test]
fn what_does_not_go_by_the_coordinate_alone_is_left_out_by_name() {
    let effects = "effects:
  - {effect: joint_settling, where: x, values: {share: 0.01}}
  - {effect: joint_step, where: x, searched: 5, values: {step_mm: 0}}
fitted: [{effect: joint_gain, where: x, values: {gain: 0.01}}]
";
    let table = compensation(&axis(effects), 0, 3).unwrap();
    assert_eq!(table.left_out, ["joint_settling(x)"], "a value of nothing is not there");
    assert!((table.lines[2][1] - 101.0).abs() < 1e-12, "fitted values count");
}

#[test]
fn a_joint_without_limits_has_no_table_and_a_measured_region_narrows_it() {
    let endless = Model::parse("axis.yaml", &AXIS.replace(", limits_mm: [0, 100]", "")).unwrap();
    let message = compensation(&endless, 0, 3).unwrap_err();
    assert!(matches!(&message, CompensationError::NoLimits(name) if name == "x"), "{message}");
    assert!(compensation(&axis(""), 7, 3).is_err(), "there is no such joint");
    let mut model = axis("");
    model.measured_region = MeasuredRegion::of(&model.chain, &[vec![20.0], vec![60.0], vec![130.0]]);
    let table = compensation(&model, 0, 2).unwrap();
    assert_eq!([table.lines[0][0], table.lines[1][0]], [20.0, 100.0], "measured from 20, and it goes to 100");
}

#[test]
fn a_map_of_a_lone_slide_is_taken_along_the_axis_and_given_across_it() {
    let mut model = axis("");
    model.measured_region = MeasuredRegion::of(&model.chain, &[vec![0.0], vec![50.0], vec![100.0]]);
    // A wave of no rate is the same everywhere: cos 0 times its shift, whose part along z is the slide's.
    let wave = |shift: Vector3<f64>| Wave { rates: vec![0.0], phase: 0.0, shift };
    model.residual_map = Some(ResidualMap {
        waves: vec![wave(Vector3::new(0.03, 0.0, 0.2))],
        along: vec![Along { joint: 0, weights: vec![0.1] }],
        sides: vec![Side { joint: 0, weights: vec![0.01] }],
        not_understood: 0.5,
    });
    let table = compensation(&model, 0, 3).unwrap();
    // At the middle the half period of the cosine is nothing; at the ends it is 0.1 and -0.1.
    let expected = [[0.0, 0.31, 0.29], [50.0, 50.21, 50.19], [100.0, 100.11, 100.09]];
    for (line, expected) in table.lines.iter().zip(expected) {
        assert!(
            line.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9),
            "{line:?} instead of {expected:?}"
        );
    }
    assert!(table.left_out[0].contains("its straightness (up to 0.0300 mm)"), "{:?}", table.left_out);
    model.residual_map.as_mut().unwrap().waves = vec![wave(Vector3::new(0.0, 0.0, 0.2))];
    assert!(compensation(&model, 0, 3).unwrap().left_out.is_empty());
    // Beside another joint what goes by the whole pose is no slide's own.
    let two = AXIS.replace("screw_pitch_mm: 10}]", "screw_pitch_mm: 10}, {name: turn}]");
    let mut both = Model::parse("two.yaml", &two).unwrap();
    both.measured_region = MeasuredRegion::of(&both.chain, &[vec![0.0, 0.0], vec![100.0, 1.0]]);
    both.residual_map = Some(ResidualMap { waves: vec![wave(Vector3::z())], ..ResidualMap::default() });
    let table = compensation(&both, 0, 3).unwrap();
    assert_eq!(table.left_out, ["the part of the residual map that goes by the whole pose"]);
    assert_eq!(table.lines[0], [0.0; 3]);
}

const TURNS: &str = "
arm: \"a<b\"
convention: distal
joints: [{name: waist, d_mm: 150, alpha_deg: 90, limits_deg: [-90, 180], sign: -1}, {name: lift, slides: true, limits_mm: [0, 250]}]
targets: {p1: {xyz_mm: [10, 20, 30]}}
";

#[test]
fn a_urdf_is_in_metres_and_radians_with_names_that_xml_allows() {
    let arm = RigidArm::of(&Model::parse("t.yaml", TURNS).unwrap()).unwrap();
    let text = urdf(&arm);
    for part in [
        "<robot name=\"a&lt;b\">",
        "<joint name=\"waist\" type=\"revolute\">",
        "<parent link=\"base_link\"/>",
        "<axis xyz=\"0 0 -1\"/>",
        "<limit lower=\"-1.5707963267948966\" upper=\"3.141592653589793\" effort=\"0\" velocity=\"0\"/>",
        "<joint name=\"lift\" type=\"prismatic\">",
        "<parent link=\"waist_link\"/>",
        "<axis xyz=\"0 0 1\"/>",
        "<limit lower=\"0\" upper=\"0.25\" effort=\"0\" velocity=\"0\"/>",
        "<joint name=\"flange_fixed\" type=\"fixed\">",
        "<parent link=\"lift_link\"/>",
        "<origin xyz=\"0.01 0.02 0.03\" rpy=\"0 0 0\"/>",
    ] {
        assert!(text.contains(part), "{part}: {text}");
    }
    assert!(text.contains("0.15"), "the height of the waist in metres: {text}");
    assert!(!text.contains("\"-0\"") && !text.contains(" -0 "), "no minus before a zero: {text}");
}

#[test]
fn a_ur_drivers_calibration_names_six_links_in_metres() {
    let six: Vec<String> =
        (1..=6).map(|joint| format!("{{name: j{joint}, a_mm: {joint}00, d_mm: 10}}")).collect();
    let model =
        format!("arm: six\nconvention: distal\njoints: [{}]\ntargets: {{p1: {{}}}}\n", six.join(", "));
    let arm = RigidArm::of(&Model::parse("six.yaml", &model).unwrap()).unwrap();
    let text = ros_calibration(&arm).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!((lines.len(), lines[0], lines[43]), (2 + 6 * 7, "kinematics:", "  hash: unknown"));
    assert_eq!(lines[1], "  shoulder:");
    // The second joint lies 100 mm along the first row's x, and 10 mm along z of its own offset.
    assert_eq!(&lines[8..11], ["  upper_arm:", "    x: 0.1", "    y: 0"]);
    assert_eq!(lines[36], "  wrist_3:");
}

#[test]
fn an_arm_that_keeps_an_attitude_has_no_rigid_form() {
    let model = TURNS
        .replace("{name: lift, slides: true, limits_mm: [0, 250]}", "{name: elbow, a_mm: 10, less: waist}");
    let message = RigidArm::of(&Model::parse("t.yaml", &model).unwrap()).unwrap_err().to_string();
    assert!(message.contains("joint `elbow` turns by its coordinate less another joint's"), "{message}");
}

const PUMA: &str = include_str!("../../../../../workcells/arms/puma560.yaml");

#[test]
fn targets_are_made_anew_for_the_arm_that_it_is() {
    let drawing = Model::parse("puma.yaml", PUMA).unwrap();
    let off = "effects: [{effect: joint_zero, where: shoulder, values: {zero_deg: 0.5}}, {effect: joint_backlash, where: elbow, values: {play_deg: 0.1}}]";
    let calibrated = Model::parse("puma.yaml", &PUMA.replace("effects: []", off)).unwrap();
    let rows = "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg\n10,-30,70,20,40,10\n12,-35,80,15,50,10\n";
    let poses = Table::parse("poses.csv", rows).unwrap();
    let made = compensated_targets(&drawing, &calibrated, &poses).unwrap();
    for (row, target) in made.iter().enumerate() {
        // The shoulder goes back by its zero; play of 0.1 degrees is half of it against the way the elbow came.
        let expected = poses.q_of(row)[1] - 0.5_f64.to_radians();
        assert!((target.q[1] - expected).abs() < 2e-5, "row {row}: {} {expected}", target.q[1]);
        let elbow = if row == 0 { 0.0 } else { 0.05_f64.to_radians() };
        assert!((target.q[2] - poses.q_of(row)[2] - elbow).abs() < 2e-5, "row {row}: {:?}", target.q);
        assert!((1.0..10.0).contains(&target.off_before), "{}", target.off_before);
    }
}

#[test]
fn targets_of_another_arm_in_another_unit_or_beyond_a_limit_are_refused() {
    let puma = Model::parse("puma.yaml", PUMA).unwrap();
    let message = |model: &Model, rows: &str| {
        let poses = Table::parse("poses.csv", rows).unwrap();
        compensated_targets(model, model, &poses).unwrap_err().to_string()
    };
    let axis = axis("");
    assert!(message(&axis, "q1_mm\n5\n").contains("an arm has six joints or more; `axis` has 1"));
    assert!(message(&puma, "q1_deg\n5\n").contains("poses.csv: poses of 1 joints for an arm of 6"));
    let unit = message(&puma, "q1_deg,q2_mm,q3_deg,q4_deg,q5_deg,q6_deg\n1,2,3,4,5,6\n");
    assert!(unit.contains("column `q2_mm` is in mm, and joint `shoulder` turns: write it in deg"), "{unit}");
    let far =
        message(&puma, "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg\n0,0,60,0,0,0\n179,-40,70,10,40,10\n");
    assert!(far.contains("poses.csv: line 3: `waist` would have to go to 179.000 deg; it goes from -160.000 deg to 160.000 deg"), "{far}");
    let mut bare = puma.clone();
    bare.targets.clear();
    assert!(
        message(&bare, "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg\n0,0,60,0,0,0\n")
            .contains("the model has no target")
    );
}

#[test]
fn a_flange_that_lies_off_the_last_axis_is_reported_with_how_far() {
    let arm = |more: &str| {
        let text =
            format!("arm: one\nconvention: distal\njoints: [{{name: turn{more}}}]\ntargets: {{p1: {{}}}}\n");
        RigidArm::of(&Model::parse("one.yaml", &text).unwrap()).unwrap()
    };
    assert_eq!(arm("").behind_last_joint(), None);
    // What lies along the axis is part of the joint's own frame.
    assert_eq!(arm(", d_mm: 40").behind_last_joint(), None);
    let (off_mm, off_deg) = arm(", a_mm: 30, d_mm: 40").behind_last_joint().unwrap();
    assert!((off_mm - 30.0).abs() < 1e-9 && off_deg.abs() < 1e-9, "{off_mm} {off_deg}");
    let (off_mm, off_deg) = arm(", alpha_deg: 25").behind_last_joint().unwrap();
    assert!(off_mm.abs() < 1e-9 && (off_deg - 25.0).abs() < 1e-9, "{off_mm} {off_deg}");
}

#[test]
fn a_target_that_sits_elsewhere_is_written_where_it_sits() {
    let more = "effects: [{effect: tool_offset, where: p1, values: {x_mm: 2, y_mm: -3, z_mm: 5}}]\n";
    let arm = RigidArm::of(&axis(more)).unwrap();
    assert_eq!(arm.targets, [("p1".to_owned(), Vector3::new(2.0, -3.0, 5.0))]);
    assert!(arm.left_out.is_empty() && arm.not_the_robot.is_empty(), "{arm:?}");
}

#[test]
fn what_is_curved_between_the_lines_is_given_by_its_greatest_part() {
    // A wave of 10 mm and lines 10 mm apart would be refused; lines 1 mm apart leave the sagitta of a tenth of a wave.
    let more = "effects: [{effect: screw_wave, where: x, n: 1, values: {sine_mm: 0.1, cosine_mm: 0}}]\n";
    let table = compensation(&axis(more), 0, 101).unwrap();
    assert!(table.left_out.is_empty(), "{:?}", table.left_out);
    // At a crest: 0.1 (1 - cos(pi / 10)) at most, between lines on either side of it.
    let sagitta = 0.1 * (1.0 - (std::f64::consts::PI / 10.0).cos());
    assert!(table.between <= sagitta + 1e-12 && table.between > 0.9 * sagitta, "{} {sagitta}", table.between);
}

#[test]
fn an_event_and_what_comes_to_nothing_are_no_errors_of_the_position() {
    let more = "effects:
  - {effect: joint_step, where: x, searched: 5, values: {step_mm: 0.3}}
  - {effect: joint_settling, where: x, values: {share: 0}}
";
    let table = compensation(&axis(more), 0, 3).unwrap();
    assert!(table.left_out.is_empty(), "{:?}", table.left_out);
    assert_eq!(table.lines[1], [50.0; 3]);
}
