//! `apply`: what was found is put in force.

use super::{ErrorTerm, error_terms};
use crate::expression::{Expression, Shape};
use crate::read_context::{CheckContext, DegOrMm, ReadContext};
use crate::yaml::{MapReader, Node, Place};

/// A declared correction of joint zeros.
#[derive(Debug, Clone)]
pub struct ApplyStep {
    /// Which robot.
    pub robot: String,
    /// Where its name stands.
    pub robot_place: Place,
    /// The joints whose zeros shift.
    pub shifts: Vec<ZeroShift>,
    /// A person (or the answers file) accepts it first.
    pub ask: bool,
}

/// The shift of one joint's zero.
#[derive(Debug, Clone)]
pub struct ZeroShift {
    /// The joint.
    pub joint: String,
    /// Where it stands.
    pub place: Place,
    /// How its numbers are written.
    pub unit: DegOrMm,
    /// Where the joint truly stood, less where it was thought to stand.
    pub shift: Expression,
    /// How far off the shift may be.
    pub uncertainty: ShiftUncertainty,
    /// A greater shift is a mistake, not a correction.
    pub plausible: f64,
}

/// What is said of the uncertainty of a shift.
#[derive(Debug, Clone)]
pub enum ShiftUncertainty {
    /// One standard uncertainty, or a budget of a `compute` step.
    Stated(Expression),
    /// What the shift depends on and is not known exactly; the shift names them.
    Errors(Vec<ErrorTerm>),
}

pub(super) fn read(node: &Node, context: &ReadContext<'_>) -> Option<ApplyStep> {
    let mut map = MapReader::new(node, "`apply`", context.problems)?;
    let robot = context.required_text(&mut map, "robot");
    let zeros = map.required("joint_zero").and_then(|node| node.entries("`joint_zero`", context.problems));
    let ask = map.optional("ask").and_then(|node| node.boolean("`ask`", context.problems)).unwrap_or(true);
    map.finish();
    let (robot, robot_place) = robot?;
    let shifts: Vec<ZeroShift> = zeros?
        .iter()
        .filter_map(|(joint, node)| read_shift(&joint.name, joint.place, node, context))
        .collect();
    Some(ApplyStep { robot, robot_place, shifts, ask })
}

fn read_shift(joint: &str, place: Place, node: &Node, context: &ReadContext<'_>) -> Option<ZeroShift> {
    let mut map = MapReader::new(node, "a joint's zero", context.problems)?;
    let in_mm = map.optional("shift_mm");
    let unit = if in_mm.is_some() { DegOrMm::Mm } else { DegOrMm::Deg };
    let keys = match unit {
        DegOrMm::Deg => ("uncertainty_deg", "plausible_deg"),
        DegOrMm::Mm => ("uncertainty_mm", "plausible_mm"),
    };
    let shift_node = match in_mm {
        Some(node) => Some(node),
        None => map.required("shift_deg"),
    };
    let shift = shift_node.and_then(|node| context.expression(node, "the shift"));
    let uncertainty = read_uncertainty(&mut map, keys.0, context);
    let plausible = context.number_or(&mut map, keys.1, (1e-6, 1e4), 30.0);
    map.finish();
    Some(ZeroShift {
        joint: joint.to_owned(),
        place,
        unit,
        shift: shift?,
        uncertainty: uncertainty?,
        plausible,
    })
}

fn read_uncertainty(
    map: &mut MapReader<'_>,
    key: &'static str,
    context: &ReadContext<'_>,
) -> Option<ShiftUncertainty> {
    let errors = error_terms::read(map, context);
    let (stated, place) = (map.optional(key), map.place());
    match (stated, errors.is_empty()) {
        (None, false) => Some(ShiftUncertainty::Errors(errors)),
        (Some(node), true) => context.expression(node, "the uncertainty").map(ShiftUncertainty::Stated),
        _ => {
            let help = format!(
                "give either `errors:`, what the shift depends on and is not known exactly, or `{key}:`"
            );
            context.problems.add(place, "how uncertain is this shift?", help);
            None
        }
    }
}

impl ApplyStep {
    pub(super) fn check(&self, context: &CheckContext<'_>) {
        let robot = context.robot(&self.robot, self.robot_place);
        for shift in &self.shifts {
            let mut names = context.names.clone();
            match &shift.uncertainty {
                ShiftUncertainty::Stated(uncertainty) => context.check_expression(uncertainty),
                ShiftUncertainty::Errors(errors) => {
                    error_terms::check(errors, context);
                    errors.iter().for_each(|error| names.set(&error.name, Shape::Single));
                }
            }
            shift.shift.check_names(&names, context.file, context.problems);
            if let Some(robot) = robot
                && let Some(unit) = context.joint(robot, &shift.joint, shift.place)
                && unit != shift.unit
            {
                let message = format!("joint `{}` goes by {}", shift.joint, unit.symbol());
                context.problems.add(shift.place, message, format!("write `shift_{}`", unit.symbol()));
            }
        }
    }
}
