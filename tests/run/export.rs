//! `plumb model export`: a calibrated arm leaves for other programs, and what they cannot hold is said.

use plumb_calibration::arm_model::Model;
use plumb_calibration::forward::ForwardModel;

use crate::lab::Lab;

/// A PUMA with errors that rigid links hold.
const RIGID: &str = "effects:
  - {effect: joint_zero, where: shoulder, values: {zero_deg: 0.3}}
  - {effect: link_length, where: shoulder, values: {length_mm: 1.1}}
  - {effect: link_offset, where: elbow, values: {offset_mm: -0.7}}
  - {effect: axis_skew, where: elbow, values: {skew_deg: -0.04}}
";

/// And one that they do not.
const SOFT: &str = "  - {effect: joint_compliance, where: shoulder, values: {compliance: 1.0e-4}}\n";

fn lab_with(effects: &str) -> Lab {
    let lab = Lab::of("ur5");
    let text = std::fs::read_to_string(lab.path("../arms/puma560.yaml")).unwrap();
    assert!(text.contains("effects: []"));
    lab.write("puma.yaml", &text.replace("effects: []", effects));
    lab
}

fn export(lab: &Lab, model: &str, more: &[&str]) -> crate::lab::Said {
    let mut arguments = vec!["model", "export", model, "--as"];
    arguments.extend(more);
    lab.plumb(&arguments)
}

/// The reader of URDF files takes it back: the tip is the same within 1e-6 mm in 1,000 poses.
#[test]
fn the_urdf_puts_the_tip_where_the_calibrated_model_does() {
    let lab = lab_with(RIGID);
    let written = export(&lab, "puma.yaml", &["urdf"]);
    assert_eq!(written.code(), 0, "{}", written.all());
    lab.write("puma.urdf", &written.out());
    lab.write(
        "back.yaml",
        "arm: back\nconvention: {urdf: puma.urdf, tip: p1}\ntargets: {p1: {xyz_mm: [0, 0, 0]}}\n",
    );
    let back = Model::read(&lab.path("back.yaml")).unwrap();
    let (root_from_base, place) = (back.base.pose, back.targets[0].xyz);
    let back = ForwardModel::new(back).unwrap();
    let model = Model::read(&lab.path("puma.yaml")).unwrap();
    let (joints, target) = (model.chain.len(), model.targets[0].xyz);
    let calibrated = ForwardModel::new(model).unwrap();
    let mut worst = 0.0_f64;
    for pose in 0..1000_usize {
        let q: Vec<f64> =
            (0..joints).map(|joint| ((pose * 7 + joint * 131) % 311) as f64 / 100.0 - 1.55).collect();
        let tip = calibrated.flange(&q, &[]) * nalgebra::Point3::from(target);
        let read_back = root_from_base * back.flange(&q, &[]) * nalgebra::Point3::from(place);
        worst = worst.max((read_back - tip).norm());
    }
    assert!(worst < 1e-6, "{worst} mm");
}

#[test]
fn what_a_urdf_cannot_hold_is_refused_with_its_size_and_left_out_only_when_asked() {
    let lab = lab_with(&format!("{RIGID}{SOFT}"));
    let refused = export(&lab, "puma.yaml", &["urdf"]);
    assert_eq!((refused.code(), refused.out().as_str()), (2, ""));
    let told = refused.err();
    assert!(
        told.starts_with("plumb: rigid links between joints cannot hold joint_compliance(shoulder): without"),
        "{told}"
    );
    let size = told.split("up to ").nth(1).unwrap().split(" mm").next().unwrap().parse::<f64>().unwrap();
    assert!((1.0..20.0).contains(&size), "the shoulder gives way by millimetres: {told}");
    let written = export(&lab, "puma.yaml", &["urdf", "--leave-out"]);
    assert_eq!(written.code(), 0, "{}", written.all());
    assert!(written.err().starts_with("left out: joint_compliance(shoulder) (up to "), "{}", written.err());
    let without = lab_with(RIGID);
    assert_eq!(written.out(), export(&without, "puma.yaml", &["urdf"]).out());
}

#[test]
fn a_ur_driver_gets_the_calibration_in_its_own_form_and_another_arm_does_not() {
    let lab = Lab::of("ur5");
    let written = export(&lab, "../arms/ur5.yaml", &["ros-calibration"]);
    assert_eq!(written.code(), 0, "{}", written.all());
    let values: serde_json::Value = serde_yaml::from_str(&written.out()).unwrap();
    let of = |link: &str, key: &str| values["kinematics"][link][key].as_f64().unwrap();
    // As ur_description has them for a UR5 (config/ur5/default_kinematics.yaml).
    for (link, key, right) in [
        ("shoulder", "z", 0.089_159),
        ("upper_arm", "roll", std::f64::consts::FRAC_PI_2),
        ("forearm", "x", -0.425),
        ("wrist_1", "x", -0.392_25),
        ("wrist_1", "z", 0.109_15),
        ("wrist_2", "y", -0.094_65),
        ("wrist_3", "y", 0.0823),
    ] {
        assert!((of(link, key) - right).abs() < 1e-9, "{link} {key}: {}", of(link, key));
    }
    let refused = export(&lab, "../arms/scara4.yaml", &["ros-calibration"]);
    assert_eq!(refused.code(), 2);
    assert!(refused.err().contains("of six joints; `scara4` has 4"), "{}", refused.err());
    let unknown = export(&lab, "../arms/ur5.yaml", &["sdf"]);
    assert!(unknown.err().contains("[possible values: urdf, ros-calibration, dh]"), "{}", unknown.err());
}
