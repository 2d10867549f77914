//! Joints with a number each: where to go, or by how much.

use super::motions::rounded;
use crate::check_context::{CheckContext, OwnLimits, RobotNames};
use crate::deg_or_mm::DegOrMm;
use crate::expression::Expression;
use crate::read_context::ReadContext;
use plumb_document::{MapReader, Span};

/// A joint and its number.
#[derive(Debug, Clone)]
pub(crate) struct JointTarget {
    /// The joint.
    pub(crate) joint: String,
    /// Where it stands.
    pub(crate) place: Span,
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
                targets.push(JointTarget { joint: joint.name.clone(), place: joint.span, unit, value });
            }
        }
    }
    targets
}

/// A place beyond limits by no more than this is within them, rad or mm: what a number loses on its way from degrees.
const ROUNDING: f64 = 1e-9;

/// Where a place (rad or mm) lies beyond the limits of a joint, these limits in words.
pub(super) fn beyond_limits(place: f64, (least, most): (f64, f64), unit: DegOrMm) -> Option<String> {
    let number = |internal: f64| rounded(unit.from_internal(internal));
    let within = (least - ROUNDING..=most + ROUNDING).contains(&place);
    (!within).then(|| format!("{} to {} {}", number(least), number(most), unit.symbol()))
}

impl OwnLimits {
    /// Where a place (rad or mm) lies beyond them wherever the zero may be, in words.
    pub(super) fn beyond(&self, place: f64, unit: DegOrMm) -> Option<String> {
        let (least, most) = (self.least - self.zero_shift, self.most + self.zero_shift);
        beyond_limits(place, (least, most), unit)?;
        let number = |internal: f64| rounded(unit.from_internal(internal));
        let limits = format!(
            "the robot itself goes from {} to {} {}",
            number(self.least),
            number(self.most),
            unit.symbol()
        );
        Some(match self.zero_shift {
            0.0 => limits,
            shift => {
                format!("{limits}, and its zero is corrected by at most {} {}", number(shift), unit.symbol())
            }
        })
    }
}

impl JointTarget {
    /// Checks a place that is written as a number against the limits of the joint: those that the cell gives it, and the robot's own.
    pub(super) fn check_limits(&self, robot: Option<&RobotNames>, context: &CheckContext<'_>) {
        let Ok(place) = self.value.text().trim().parse::<f64>() else { return };
        let Some(robot) = robot else { return };
        let internal = self.unit.to_internal(place);
        let of_cell = robot.limits.iter().find(|(joint, ..)| *joint == self.joint);
        let of_cell =
            of_cell.and_then(|(_, least, most)| beyond_limits(internal, (*least, *most), self.unit));
        let own = robot.own_limits.iter().find(|limits| limits.joint == self.joint);
        let own = own.and_then(|limits| limits.beyond(internal, self.unit));
        let help = match (of_cell, own) {
            (Some(limits), _) => {
                format!(
                    "the cell keeps it within {limits}: give a place there, or widen its limits in the cell file"
                )
            }
            (None, Some(limits)) => format!("{limits}: give a place there"),
            (None, None) => return,
        };
        let message = format!("{} cannot go to {place} {}", self.joint, self.unit.symbol());
        context.problems.add(self.place, message, help);
    }

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
