//! Joints with a number each: where to go, or by how much.

use crate::expression::Expression;
use crate::read_context::{CheckContext, DegOrMm, ReadContext, RobotNames};
use crate::yaml::{MapReader, Place};

/// A joint and its number.
#[derive(Debug, Clone)]
pub struct JointTarget {
    /// The joint.
    pub joint: String,
    /// Where it stands.
    pub place: Place,
    /// In which unit the number is written.
    pub unit: DegOrMm,
    /// The number.
    pub value: Expression,
}

/// Several joints with a number each.
pub type JointTargets = Vec<JointTarget>;

/// Reads the joints under a key in degrees and a key in millimetres.
pub(super) fn read_pair(
    map: &mut MapReader<'_>,
    deg_key: &'static str,
    mm_key: &'static str,
    context: &ReadContext<'_>,
) -> JointTargets {
    let mut targets = Vec::new();
    for (key, unit) in [(deg_key, DegOrMm::Deg), (mm_key, DegOrMm::Mm)] {
        let Some(entries) =
            map.optional(key).and_then(|node| node.entries(&format!("`{key}`"), context.problems))
        else {
            continue;
        };
        for (joint, node) in entries {
            if let Some(value) = context.expression(node, &format!("`{}`", joint.name)) {
                targets.push(JointTarget { joint: joint.name.clone(), place: joint.place, unit, value });
            }
        }
    }
    targets
}

impl JointTarget {
    /// Checks that the robot has the joint, that the unit fits it, and the names in the number.
    pub(super) fn check(&self, robot: Option<&RobotNames>, context: &CheckContext<'_>) {
        context.check_expression(&self.value);
        let Some(robot) = robot else { return };
        if let Some(unit) = context.joint(robot, &self.joint, self.place)
            && unit != self.unit
        {
            let message = format!("joint `{}` is given in {}", self.joint, self.unit.symbol());
            context.problems.add(
                self.place,
                message,
                format!("it goes by {}: write it under the key that ends in `_{0}`", unit.symbol()),
            );
        }
    }
}
