//! Joints with a number each: where to go, or by how much.

use super::limits::kept_from;
use crate::check_context::{CheckContext, RobotNames};
use crate::deg_or_mm::DegOrMm;
use crate::expression::Expression;
use crate::read_context::ReadContext;
use plumb_document::{MapReader, Span};

/// A joint and its number.
#[derive(Debug, Clone)]
pub(crate) struct JointTarget {
    /// The joint.
    pub(crate) joint: String,
    /// Where it is.
    pub(crate) span: Span,
    /// In which unit the number is written.
    pub(crate) unit: DegOrMm,
    /// The number.
    pub(crate) value: Expression,
}

/// Several joints with a number each.
pub(crate) type JointTargets = Vec<JointTarget>;

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
                targets.push(JointTarget { joint: joint.name.clone(), span: joint.span, unit, value });
            }
        }
    }
    targets
}

impl JointTarget {
    /// Checks a position that is written as a number against the limits of the joint: those that the cell gives it, and the robot's own.
    pub(super) fn check_limits(&self, robot: Option<&RobotNames>, context: &CheckContext<'_>) {
        let Ok(position) = self.value.text().trim().parse::<f64>() else { return };
        let Some(robot) = robot else { return };
        let internal = self.unit.to_internal(position);
        let Some(help) = kept_from(robot, &self.joint, internal, self.unit) else { return };
        let message = format!("{} cannot go to {position} {}", self.joint, self.unit.symbol());
        context.problems.add(self.span, message, help);
    }

    /// Checks that the robot has the joint, that the unit fits it, and the names in the number.
    pub(super) fn check(&self, robot: Option<&RobotNames>, context: &CheckContext<'_>) {
        context.check_expression(&self.value);
        let Some(robot) = robot else { return };
        if let Some(unit) = context.joint(robot, &self.joint, self.span)
            && unit != self.unit
        {
            let message = format!("joint `{}` is given in {}", self.joint, self.unit.symbol());
            context.problems.add(
                self.span,
                message,
                format!("it goes by {}: write it under the key that ends in `_{0}`", unit.symbol()),
            );
        }
    }
}
