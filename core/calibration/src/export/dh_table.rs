//! The rows of Denavit and Hartenberg with what was found, as a table.

use std::fmt::Write as _;

use plumb_kinematics::{Convention, Motion};

use super::rigid_arm::RigidArm;
use crate::arm_model::Model;

/// A table (CSV) with a row a joint: mm and degrees. `beta_deg` is Hayati's turn about y before the joint turns. `arm` is of this model.
pub fn dh_table(arm: &RigidArm, model: &Model) -> String {
    let convention = match model.chain.convention {
        Convention::Distal => "distal (standard): Ry(beta) Rz(theta + q) Tz(d) Tx(a) Rx(alpha)",
        Convention::Proximal => "proximal (modified): Rx(alpha) Tx(a) Ry(beta) Rz(theta + q) Tz(d)",
    };
    let mut text =
        format!("# {}: {convention}\njoint,kind,a_mm,alpha_deg,d_mm,theta_deg,beta_deg,sign\n", arm.name);
    for (joint, error) in model.chain.joints.iter().zip(&arm.deviations) {
        let kind = match joint.motion {
            Motion::Turns => "turns",
            Motion::Slides => "slides",
        };
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "{},{kind},{},{},{},{},{},{}",
            joint.name,
            joint.a + error.a,
            (joint.alpha + error.alpha).to_degrees(),
            joint.d + error.d,
            (joint.theta + error.theta).to_degrees(),
            error.beta.to_degrees(),
            joint.sign
        );
    }
    text
}
