//! Model files whose arm is described in a URDF file beside them.

use std::path::Path;

use plumb_calibration::arm_model::Model;
use plumb_calibration::file::model_text;
use plumb_calibration::prediction::{Pose, points};
use tempfile::TempDir;

/// Two links in a vertical plane on a column, the second joint's axis drawn the other way round; a tool of 50 mm.
const ARM: &str = r#"<robot name="column">
  <link name="foot"/>
  <link name="upper"><inertial><origin xyz="0.1 0 0"/><mass value="2"/></inertial></link>
  <link name="fore"/> <link name="hand"/> <link name="tool"/>
  <joint name="waist" type="revolute"><parent link="foot"/><child link="upper"/><origin xyz="0 0 0.3"/><axis xyz="0 0 1"/><limit lower="-2" upper="2"/></joint>
  <joint name="shoulder" type="revolute"><parent link="upper"/><child link="fore"/><axis xyz="0 1 0"/><limit lower="-1" upper="1"/></joint>
  <joint name="elbow" type="continuous"><parent link="fore"/><child link="hand"/><origin xyz="0.2 0 0"/><axis xyz="0 -1 0"/></joint>
  <joint name="grip" type="fixed"><parent link="hand"/><child link="tool"/><origin xyz="0.15 0 0"/></joint>
</robot>"#;

/// A folder with the arm and a model file beside it; what reading it gives.
fn read(model: &str) -> (TempDir, Result<Model, String>) {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("arms")).unwrap();
    std::fs::write(folder.path().join("arms/column.urdf"), ARM).unwrap();
    let path = folder.path().join("model.yaml");
    std::fs::write(&path, model).unwrap();
    let model = Model::read(Path::new(&path)).map_err(|error| error.to_string());
    (folder, model)
}

fn point(model: &Model, q: [f64; 3]) -> [f64; 3] {
    let pose = Pose { q: q.iter().map(|angle| angle.to_radians()).collect(), ..Pose::default() };
    points(model, None, &[pose]).unwrap()[0].into()
}

/// The tip by plain trigonometry, `ahead` of the tool's frame: the shoulder lowers, the elbow raises.
fn tip([waist, shoulder, elbow]: [f64; 3], ahead: f64) -> [f64; 3] {
    let (waist, first, second) =
        (waist.to_radians(), -shoulder.to_radians(), (elbow - shoulder).to_radians());
    let radius = 200.0 * first.cos() + (150.0 + ahead) * second.cos();
    let height = 300.0 + 200.0 * first.sin() + (150.0 + ahead) * second.sin();
    [radius * waist.cos(), radius * waist.sin(), height]
}

fn near(left: [f64; 3], right: [f64; 3]) {
    assert!(left.iter().zip(right).all(|(left, right)| (left - right).abs() < 1e-6), "{left:?} {right:?}");
}

#[test]
fn a_model_file_may_leave_its_rows_to_a_urdf_file() {
    for head in ["convention: {urdf: arms/column.urdf}", "convention: urdf\nurdf: arms/column.urdf"] {
        let (_folder, model) = read(&format!(
            "arm: column\n{head}\nbase: {{xyz_mm: [10, 0, 0]}}\ntargets: {{p1: {{xyz_mm: [40, 0, 0], free: true}}}}\nfree: [\"joint_zero(*)\"]\n"
        ));
        let model = model.unwrap();
        let q = [20.0, 30.0, -50.0];
        let [x, y, z] = tip(q, 40.0);
        near(point(&model, q), [x + 10.0, y, z]);
        assert!((model.masses[0].mass - 2.0).abs() < 1e-12);
    }
}

#[test]
fn without_a_target_the_tip_is_the_point_and_a_revision_is_complete() {
    let (_folder, model) = read("arm: column\nconvention: {urdf: arms/column.urdf, tip: hand}\n");
    let model = model.unwrap();
    let q = [-70.0, 10.0, 40.0];
    near(point(&model, q), tip(q, -150.0));
    let alone = Model::parse("revision.yaml", &model_text(&model)).unwrap();
    near(point(&alone, q), tip(q, -150.0));
}

#[test]
fn beside_the_file_a_joint_may_have_limits_a_sign_and_a_gear_ratio() {
    let (_folder, model) = read(
        "arm: column\nconvention: {urdf: arms/column.urdf}\njoints:\n  - {name: elbow, sign: -1, gear_ratio: 62.5, limits_deg: [-90, 90]}\n",
    );
    let model = model.unwrap();
    near(point(&model, [0.0, 30.0, 50.0]), tip([0.0, 30.0, -50.0], 0.0));
    assert_eq!(model.chain.joints[2].gear_ratio, Some(62.5));
    assert!((model.chain.joints[2].limits.1.to_degrees() - 90.0).abs() < 1e-9);
}

#[test]
fn what_does_not_go_with_a_urdf_file_is_refused_with_its_place() {
    let says = |model: &str, parts: &[&str]| {
        let (_folder, read) = read(model);
        let message = read.err().unwrap();
        assert!(parts.iter().all(|part| message.contains(part)), "{message}");
    };
    says("arm: a\nconvention: {urdf: nowhere.urdf}\n", &[":2:", "nowhere.urdf", "from this file's folder"]);
    says("arm: a\nconvention: urdf\n", &[":2:", "which URDF file?"]);
    says("arm: a\nconvention: distal\nurdf: arms/column.urdf\n", &[":3:", "goes with `convention: urdf`"]);
    says("arm: a\nconvention: {urdf: arms/column.urdf, tip: hend}\n", &["there is no link `hend`", "hand"]);
    says("arm: a\nconvention: {urdf: arms/column.urdf, top: hand}\n", &["unknown key `top`"]);
    says("arm: a\nconvention: udrf\n", &["`udrf`, which is not known", "urdf"]);
    let joint = |joint: &str| format!("arm: a\nconvention: {{urdf: arms/column.urdf}}\njoints: [{joint}]\n");
    says(&joint("{name: elbw}"), &[":3:", "there is no joint `elbw`", "elbow"]);
    says(&joint("{name: elbow, a_mm: 150}"), &[":3:", "the URDF file says where joint `elbow` is"]);
}

/// As the ROS-Industrial files of KUKA arms have it: the first axis points down.
fn upside_down() -> String {
    ARM.replace("<axis xyz=\"0 0 1\"/>", "<axis xyz=\"0 0 -1\"/>")
}

/// Where gravity pulls in the measurements' frame, by a model as it is.
fn pull(model: &Model) -> [f64; 3] {
    (model.base.pose.rotation * model.down(&model.base.pose.rotation)).into()
}

#[test]
fn what_is_down_in_a_urdf_file_is_down_for_its_rows_whichever_way_the_first_axis_points() {
    let folder = tempfile::tempdir().unwrap();
    let urdf = folder.path().join("column.urdf");
    let path = folder.path().join("model.yaml");
    for text in [ARM.to_owned(), upside_down()] {
        std::fs::write(&urdf, text).unwrap();
        std::fs::write(&path, "arm: column\nconvention: {urdf: column.urdf}\n").unwrap();
        let described = Model::read(&path).unwrap();
        near(pull(&described), [0.0, 0.0, -1.0]);
        near(pull(&Model::parse("revision.yaml", &model_text(&described)).unwrap()), [0.0, 0.0, -1.0]);
        let template = plumb_calibration::template::Template::of_urdf(&urdf, None).unwrap();
        near(pull(&Model::parse("template.yaml", &template.model).unwrap()), [0.0, 0.0, -1.0]);
        // An arm that hangs from a wall: what is down is given in the root link's frame.
        std::fs::write(&path, "arm: column\nconvention: {urdf: column.urdf}\ngravity: [1, 0, 0]\n").unwrap();
        near(pull(&Model::read(&path).unwrap()), [1.0, 0.0, 0.0]);
    }
}

#[test]
fn equal_masses_are_said_to_look_like_placeholders() {
    let folder = tempfile::tempdir().unwrap();
    let urdf = folder.path().join("column.urdf");
    let inertial = "<inertial><origin xyz=\"0 0 0\"/><mass value=\"2\"/></inertial>";
    let heavy = ARM.replace(
        "<link name=\"fore\"/> <link name=\"hand\"/>",
        &format!("<link name=\"fore\">{inertial}</link> <link name=\"hand\">{inertial}</link>"),
    );
    std::fs::write(&urdf, &heavy).unwrap();
    let template = plumb_calibration::template::Template::of_urdf(&urdf, None).unwrap();
    assert!(template.model.contains("placeholders: all are 2 kg"), "{}", template.model);
    std::fs::write(&urdf, ARM).unwrap();
    let template = plumb_calibration::template::Template::of_urdf(&urdf, None).unwrap();
    assert!(!template.model.contains("placeholders"), "{}", template.model);
}
