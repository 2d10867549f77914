//! URDF files: rows that move as the file says, and refusals that name the element and its line.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use nalgebra::{IsometryMatrix3, Rotation3, Translation3, Unit, Vector3};
use plumb_kinematics::LinkFrames;
use plumb_kinematics::urdf::{UrdfArm, UrdfError};

/// Joints of all kinds: crossing, skew and parallel axes, a fixed joint between, a slide, a camera on a branch.
const ARM: &str = r#"<?xml version="1.0"?>
<robot name="sample">
  <link name="world"/>
  <link name="base"/>
  <link name="upper"><inertial><origin xyz="0.1 0 0.02"/><mass value="2.5"/></inertial></link>
  <link name="fore"/>
  <link name="wrist"/>
  <link name="slide"/>
  <link name="tool"/>
  <link name="camera"/>
  <joint name="stand" type="fixed"><parent link="world"/><child link="base"/><origin xyz="0.1 -0.2 0.3" rpy="0.1 0.2 0.3"/></joint>
  <joint name="turn" type="revolute"><parent link="base"/><child link="upper"/><origin xyz="0 0 0.4"/><axis xyz="0 0 1"/><limit lower="-2" upper="2"/></joint>
  <joint name="lift" type="continuous"><parent link="upper"/><child link="fore"/><origin xyz="0.05 0.1 0.1" rpy="0.3 0 0"/><axis xyz="0 1 0"/></joint>
  <joint name="bend" type="revolute"><parent link="fore"/><child link="wrist"/><origin xyz="0.425 0 0.02"/><axis xyz="0 -1 0"/><limit lower="-3" upper="3"/></joint>
  <joint name="reach" type="prismatic"><parent link="wrist"/><child link="slide"/><origin xyz="0.1 0.03 0" rpy="0.2 -0.4 0.7"/><axis xyz="1 1 0"/><limit lower="0" upper="0.25"/></joint>
  <joint name="hand" type="fixed"><parent link="slide"/><child link="tool"/><origin xyz="0 0.02 0.11" rpy="1 0 0.5"/></joint>
  <joint name="view" type="fixed"><parent link="upper"/><child link="camera"/></joint>
</robot>"#;

/// The tip by the file's own words, step by step.
fn tip(q: [f64; 4]) -> IsometryMatrix3<f64> {
    let pose = |xyz: [f64; 3], rpy: [f64; 3]| {
        let turn = Rotation3::from_euler_angles(rpy[0], rpy[1], rpy[2]);
        IsometryMatrix3::from_parts(Translation3::from(Vector3::from(xyz) * 1e3), turn)
    };
    let turn = |axis: [f64; 3], angle: f64| {
        let axis = Unit::new_normalize(Vector3::from(axis));
        IsometryMatrix3::from_parts(Translation3::identity(), Rotation3::from_axis_angle(&axis, angle))
    };
    let slide = |axis: [f64; 3], mm: f64| {
        let way = Unit::new_normalize(Vector3::from(axis)).into_inner() * mm;
        IsometryMatrix3::from_parts(Translation3::from(way), Rotation3::identity())
    };
    pose([0.1, -0.2, 0.3], [0.1, 0.2, 0.3])
        * pose([0.0, 0.0, 0.4], [0.0; 3])
        * turn([0.0, 0.0, 1.0], q[0])
        * pose([0.05, 0.1, 0.1], [0.3, 0.0, 0.0])
        * turn([0.0, 1.0, 0.0], q[1])
        * pose([0.425, 0.0, 0.02], [0.0; 3])
        * turn([0.0, -1.0, 0.0], q[2])
        * pose([0.1, 0.03, 0.0], [0.2, -0.4, 0.7])
        * slide([1.0, 1.0, 0.0], q[3])
        * pose([0.0, 0.02, 0.11], [1.0, 0.0, 0.5])
}

#[test]
fn the_rows_move_the_tip_as_the_file_says() {
    let arm = UrdfArm::parse(ARM, None).unwrap();
    assert_eq!(arm.ends, ("world".to_owned(), "tool".to_owned()));
    for q in [[0.0; 4], [0.3, -0.7, 1.1, 40.0], [-1.9, 2.4, -2.8, 210.0]] {
        let there = arm.root_from_base * LinkFrames::of(&arm.chain, &q, &[]).flange * arm.flange_from_tip;
        let expected = tip(q);
        assert!((there.translation.vector - expected.translation.vector).norm() < 1e-9, "{q:?}");
        assert!((there.rotation.matrix() - expected.rotation.matrix()).norm() < 1e-9, "{q:?}");
    }
    assert_eq!(arm.chain.joints[3].limits, (0.0, 250.0), "a slide counts in mm");
    assert_eq!((arm.masses.len(), arm.masses[0].after, arm.masses[0].mass), (1, 0, 2.5));
}

#[test]
fn a_mass_moves_with_its_link() {
    let arm = UrdfArm::parse(ARM, None).unwrap();
    let at = |q: f64| {
        let link_frames = LinkFrames::of(&arm.chain, &[q], &[]);
        arm.root_from_base * link_frames.joints[0].end * nalgebra::Point3::from(arm.masses[0].centre)
    };
    let by_file = |q: f64| {
        let stand = IsometryMatrix3::from_parts(
            Translation3::new(100.0, -200.0, 300.0),
            Rotation3::from_euler_angles(0.1, 0.2, 0.3),
        );
        let turned = Rotation3::from_axis_angle(&Vector3::z_axis(), q) * Vector3::new(100.0, 0.0, 20.0);
        stand * nalgebra::Point3::from(turned + Vector3::new(0.0, 0.0, 400.0))
    };
    for q in [0.0, 1.2] {
        assert!((at(q) - by_file(q)).norm() < 1e-9);
    }
}

fn refused(from: &str, to: &str) -> String {
    assert!(ARM.contains(from), "the sample has {from}");
    UrdfArm::parse(&ARM.replace(from, to), None).unwrap_err().to_string()
}

#[test]
fn a_closed_loop_names_the_link_and_both_its_joints() {
    let bar = r#"<joint name="bar" type="continuous"><parent link="base"/><child link="wrist"/><axis xyz="0 1 0"/></joint></robot>"#;
    let message = refused("</robot>", bar);
    assert!(
        message.contains("link `wrist` hangs on both joint `bend` and joint `bar`")
            && message.contains("closed loop"),
        "{message}"
    );
    assert!(message.starts_with("line "), "{message}");
    let circle = refused(r#"<parent link="world"/>"#, r#"<parent link="tool"/>"#);
    assert!(circle.contains("go in a circle") && circle.contains("stand"), "{circle}");
}

#[test]
fn a_joint_that_mimics_another_is_named() {
    let message =
        refused(r#"<limit lower="-3" upper="3"/>"#, r#"<limit lower="-3" upper="3"/><mimic joint="lift"/>"#);
    // With a joint that mimics on the way, no other branch is as long.
    assert!(message.contains("joint `bend`") && message.contains("mimics joint `lift`"), "{message}");
}

#[test]
fn missing_limits_say_what_to_write() {
    let message = refused(r#"<limit lower="-2" upper="2"/>"#, "");
    assert_eq!(
        message,
        "line 12: joint `turn`: a revolute joint needs <limit lower=\"...\" upper=\"...\"/>, or the type `continuous` if it turns without end"
    );
}

#[test]
fn millimetres_and_degrees_are_reported() {
    let message = refused(r#"xyz="0.425 0 0.02""#, r#"xyz="425 0 20""#);
    assert!(message.contains("joint `bend`") && message.contains("looks like millimetres"), "{message}");
    let message = refused(r#"rpy="0.2 -0.4 0.7""#, r#"rpy="0 90 0""#);
    assert!(message.contains("joint `reach`") && message.contains("looks like degrees"), "{message}");
    let message = refused(r#"<limit lower="-2" upper="2"/>"#, r#"<limit lower="-170" upper="170"/>"#);
    assert!(message.contains("joint `turn`") && message.contains("look like degrees"), "{message}");
}

#[test]
fn what_is_no_number_no_axis_and_no_arm_is_reported() {
    let message = refused(r#"xyz="0.425 0 0.02""#, r#"xyz="0,425 0 0,02""#);
    assert!(
        message.contains("joint `bend`") && message.contains("three numbers between blanks"),
        "{message}"
    );
    let message = refused(r#"<axis xyz="0 0 1"/>"#, r#"<axis xyz="0 0 0"/>"#);
    assert!(message.contains("joint `turn`: its axis has no direction"), "{message}");
    let message = refused(r#"type="continuous""#, r#"type="floating""#);
    assert!(message.contains("joint `lift`: its type is `floating`"), "{message}");
    let message = refused(r#"<child link="wrist"/>"#, r#"<child link="wirst"/>"#);
    assert!(message.contains("its child `wirst` is no link"), "{message}");
    let message = UrdfArm::parse("<sdf><model/></sdf>", None).unwrap_err();
    assert!(matches!(message, UrdfError::NotARobot(_)), "{message}");
    let message = UrdfArm::parse("<robot><link", None).unwrap_err();
    assert!(matches!(message, UrdfError::Syntax { .. }), "{message}");
    let message = UrdfArm::parse(ARM, Some("toool")).unwrap_err().to_string();
    assert!(message.contains("there is no link `toool`"), "{message}");
}

#[test]
fn what_is_wrong_beside_the_arm_does_not_matter() {
    let beside = r#"<link name="cup"/>
  <joint name="lid" type="revolute"><parent link="upper"/><child link="cup"/><axis xyz="0 0 1"/></joint>
  <joint name="rotor" type="floating"><parent link="upper"/><child link="nowhere"/></joint>"#;
    let text = ARM.replace(r#"<link name="camera"/>"#, &format!(r#"<link name="camera"/>{beside}"#));
    let plain = UrdfArm::parse(ARM, Some("tool")).unwrap();
    assert_eq!(UrdfArm::parse(&text, Some("tool")).unwrap().chain, plain.chain);
    let message = UrdfArm::parse(&text, Some("cup")).unwrap_err().to_string();
    assert!(message.contains("joint `lid`: a revolute joint needs <limit"), "{message}");
}

#[test]
fn a_joint_that_does_not_move_needs_no_axis_and_limits_without_end_are_none() {
    let text = ARM
        .replace(r#"rpy="1 0 0.5"/></joint>"#, r#"rpy="1 0 0.5"/><axis xyz="0 0 0"/></joint>"#)
        .replace(r#"<limit lower="-2" upper="2"/>"#, r#"<limit lower="-1e16" upper="1e16"/>"#);
    let arm = UrdfArm::parse(&text, None).unwrap();
    assert_eq!(arm.chain.joints[0].limits, UrdfArm::parse(ARM, None).unwrap().chain.joints[1].limits);
}

#[test]
fn what_is_not_written_of_limits_is_nought_as_the_format_has_it() {
    let text = ARM.replace(r#"<limit lower="-2" upper="2"/>"#, r#"<limit upper="2"/>"#);
    assert_eq!(UrdfArm::parse(&text, None).unwrap().chain.joints[0].limits, (0.0, 2.0));
    let message = refused(r#"<limit lower="-2" upper="2"/>"#, r#"<limit effort="3"/>"#);
    assert!(message.contains("hold no pose") && message.contains("`continuous`"), "{message}");
}

#[test]
fn an_arm_ends_before_its_fingers() {
    let fingers = r#"<link name="left"/><link name="right"/>
  <joint name="finger" type="prismatic"><parent link="tool"/><child link="left"/><axis xyz="0 1 0"/><limit lower="0" upper="0.04"/></joint>
  <joint name="other" type="prismatic"><parent link="tool"/><child link="right"/><axis xyz="0 -1 0"/><limit lower="0" upper="0.04"/><mimic joint="finger"/></joint>"#;
    let text = ARM.replace(r#"<link name="camera"/>"#, &format!(r#"<link name="camera"/>{fingers}"#));
    let arm = UrdfArm::parse(&text, None).unwrap();
    assert_eq!((arm.ends.1.as_str(), arm.chain.len()), ("tool", 4));
}
