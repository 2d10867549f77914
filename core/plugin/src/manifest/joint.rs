//! A joint as a manifest lists it: how far it goes.

use plumb_document::{Node, Problems};
use serde::{Deserialize, Serialize};

/// How far a joint of a robot goes. It turns, in degrees, or slides, in millimetres.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ManifestJoint {
    /// As the robot describes it.
    pub name: String,
    /// The lowest it may go, deg.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from_deg: Option<f64>,
    /// The highest it may go, deg.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub to_deg: Option<f64>,
    /// The lowest it may go, mm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from_mm: Option<f64>,
    /// The highest it may go, mm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub to_mm: Option<f64>,
}

impl ManifestJoint {
    /// The lowest and the highest it may go, rad or mm; none where the manifest does not say both.
    pub fn range(&self) -> Option<(f64, f64)> {
        match (self.from_deg.zip(self.to_deg), self.from_mm.zip(self.to_mm)) {
            (Some((from, to)), None) => Some((from.to_radians(), to.to_radians())),
            (None, Some(range)) => Some(range),
            _ => None,
        }
    }
}

/// Checks listed joints, each with where it is. What could not be read is empty or no number, and not looked at.
pub(super) fn check_joints(joints: &[ManifestJoint], nodes: &[Node], problems: &Problems) {
    for (index, (joint, node)) in joints.iter().zip(nodes).enumerate() {
        let name = &joint.name;
        if !name.is_empty() && joints.iter().take(index).any(|before| before.name == *name) {
            problems.add(
                node.span_at(&["name"]),
                format!("two joints are called `{name}`"),
                "list each joint once",
            );
        }
        match joint.range() {
            None => {
                let message = format!("joint `{name}` does not say how far it goes");
                let help = "give `from_deg` and `to_deg`, or `from_mm` and `to_mm` of one that slides";
                problems.add(node.span, message, help);
            }
            Some((from, to)) if from >= to || from.is_infinite() || to.is_infinite() => {
                let message = format!("joint `{name}` has no way to go");
                problems.add(node.span, message, "the lower end comes first, and both are finite");
            }
            Some(_) => {}
        }
    }
}
