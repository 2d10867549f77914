//! The calibration file of the ROS driver of Universal Robots (`kinematics_params_file` of ur_description): where each of six joints lies in the
//! frame of the one before, metres and radians.

use std::fmt::Write as _;

use super::rigid_arm::{ExportError, RigidArm};
use super::urdf::number;

/// The links of a UR in the file's order.
const LINKS: [&str; 6] = ["shoulder", "upper_arm", "forearm", "wrist_1", "wrist_2", "wrist_3"];

/// The file's text. Its hash, by which the driver compares it with the robot's own calibration, is left for the driver to warn of: it is the
/// controller's secret.
///
/// # Errors
/// [`ExportError::NotSixJoints`].
pub fn ros_calibration(arm: &RigidArm) -> Result<String, ExportError> {
    if arm.joints.len() != LINKS.len() {
        return Err(ExportError::NotSixJoints { arm: arm.name.clone(), joints: arm.joints.len() });
    }
    let mut text = String::from("kinematics:\n");
    for (link, joint) in LINKS.iter().zip(&arm.joints) {
        // The driver counts in metres.
        let position = joint.parent_from_joint.translation.vector * 1e-3;
        let (roll, pitch, yaw) = joint.parent_from_joint.rotation.euler_angles();
        let _ = writeln!(text, "  {link}:");
        for (key, value) in [
            ("x", position.x),
            ("y", position.y),
            ("z", position.z),
            ("roll", roll),
            ("pitch", pitch),
            ("yaw", yaw),
        ] {
            let _ = writeln!(text, "    {key}: {}", number(value));
        }
    }
    text.push_str("  hash: unknown\n");
    Ok(text)
}
