//! The arm as a URDF: links without shapes, joints with their calibrated places.

use std::fmt::Write as _;

use nalgebra::IsometryMatrix3;
use plumb_kinematics::Motion;

use super::rigid_arm::RigidArm;

/// Metres in a millimetre: URDF lengths are metres.
const METRES: f64 = 1e-3;

/// The URDF's text. Its root `base_link` is the model's base, `flange` its flange, and each measured point a link of its own.
pub fn urdf(arm: &RigidArm) -> String {
    let mut text = format!(
        "<?xml version=\"1.0\"?>\n<robot name=\"{}\">\n  <link name=\"base_link\"/>\n",
        escaped(&arm.name)
    );
    let mut parent = "base_link".to_owned();
    for joint in &arm.joints {
        let child = format!("{}_link", joint.name);
        let (kind, unit) = match joint.motion {
            Motion::Turns => ("revolute", 1.0),
            Motion::Slides => ("prismatic", METRES),
        };
        // URDF asks for effort and velocity as well; 0 is what files say that do not know them.
        let (least, greatest) = joint.limits;
        let _ = write!(
            text,
            "  <link name=\"{0}\"/>\n  <joint name=\"{1}\" type=\"{kind}\">\n    <parent link=\"{2}\"/>\n    <child link=\"{0}\"/>\n    {3}\n    \
             <axis xyz=\"0 0 {4}\"/>\n    <limit lower=\"{5}\" upper=\"{6}\" effort=\"0\" velocity=\"0\"/>\n  </joint>\n",
            escaped(&child),
            escaped(&joint.name),
            escaped(&parent),
            origin(&joint.parent_from_joint),
            if joint.sign < 0.0 { -1 } else { 1 },
            number(least * unit),
            number(greatest * unit),
        );
        parent = child;
    }
    fixed(&mut text, &parent, "flange", &arm.joint_from_flange);
    for (name, position) in &arm.targets {
        fixed(&mut text, "flange", name, &IsometryMatrix3::translation(position.x, position.y, position.z));
    }
    text.push_str("</robot>\n");
    text
}

fn fixed(text: &mut String, parent: &str, child: &str, parent_from_child: &IsometryMatrix3<f64>) {
    let (parent, child) = (escaped(parent), escaped(child));
    let _ = write!(
        text,
        "  <link name=\"{child}\"/>\n  <joint name=\"{child}_fixed\" type=\"fixed\">\n    <parent link=\"{parent}\"/>\n    \
         <child link=\"{child}\"/>\n    {}\n  </joint>\n",
        origin(parent_from_child)
    );
}

/// `<origin xyz="..." rpy="..."/>`: metres, and roll, pitch, yaw about fixed axes in radians.
fn origin(pose: &IsometryMatrix3<f64>) -> String {
    let position = pose.translation.vector * METRES;
    let (roll, pitch, yaw) = pose.rotation.euler_angles();
    let numbers = [position.x, position.y, position.z, roll, pitch, yaw].map(number);
    let [x, y, z, roll, pitch, yaw] = numbers;
    format!("<origin xyz=\"{x} {y} {z}\" rpy=\"{roll} {pitch} {yaw}\"/>")
}

/// A number that reads back as the same double; no minus before a zero.
pub(super) fn number(value: f64) -> String {
    format!("{}", value + 0.0)
}

/// Text within quotes of XML.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;")
}
