//! `declare`: a robot's controller takes where the arm stands for a stated pose from now on.

use super::joint_targets::{JointTargets, read_pair};
use crate::read_context::{CheckContext, ReadContext};
use crate::yaml::{MapReader, Node, Place};

/// A declared calibration of a controller's own zeros.
#[derive(Debug, Clone)]
pub struct DeclareStep {
    /// Which robot.
    pub robot: String,
    /// Where its name stands.
    pub robot_place: Place,
    /// What the joints shall read from now on; joints not named read what they read.
    pub joints: JointTargets,
    /// One standard uncertainty of that, or its budget, for the record; what is left out was not determined.
    pub uncertainties: JointTargets,
    /// A greater shift is a mistake, not a correction: degrees or mm.
    pub plausible: f64,
    /// A person (or the answers file) accepts it first.
    pub ask: bool,
}

pub(super) fn read(node: &Node, context: &ReadContext<'_>) -> Option<DeclareStep> {
    let mut map = MapReader::new(node, "`declare`", context.problems)?;
    let robot = context.required_text(&mut map, "robot");
    let joints = read_pair(&mut map, "as_deg", "as_mm", context);
    let uncertainties = read_pair(&mut map, "uncertainty_deg", "uncertainty_mm", context);
    let plausible = context.number_or(&mut map, "plausible", (1e-6, 1e4), 10.0);
    let ask = map.optional("ask").and_then(|node| node.boolean("`ask`", context.problems)).unwrap_or(true);
    let place = map.place();
    map.finish();
    if joints.is_empty() {
        let help = "give what the joints shall read, as in `as_deg: {shoulder: -90, elbow: 90}`";
        context.problems.add(place, "this declares no joint", help);
        return None;
    }
    let (robot, robot_place) = robot?;
    Some(DeclareStep { robot, robot_place, joints, uncertainties, plausible, ask })
}

impl DeclareStep {
    pub(super) fn check(&self, context: &CheckContext<'_>) {
        let robot = context.robot(&self.robot, self.robot_place);
        for joint in self.joints.iter().chain(&self.uncertainties) {
            joint.check(robot, context);
        }
    }
}
