//! What a prompt asks.

use plumb_document::Span;

use super::beyond::limits_between;
use super::limits::{kept_from, outside};
use super::motions::{MotionContext, rounded};
use crate::cell_names::CellNames;
use crate::check_context::{CheckContext, OwnLimits, RobotNames};
use crate::deg_or_mm::DegOrMm;
use crate::expression::{Expression, Shape};
use crate::prompt::ChoiceOption;

/// What counts as an answer.
#[derive(Debug, Clone)]
pub(crate) enum PromptQuestion {
    /// Done.
    Acknowledge {
        /// What is confirmed.
        label: String,
    },
    /// One of several.
    Choice {
        /// In the order shown.
        options: Vec<ChoiceOption>,
        /// Offered first.
        default: Option<String>,
    },
    /// A number.
    Number {
        /// Its unit; empty for a bare number.
        unit: String,
        /// Smallest allowed.
        minimum: Option<Expression>,
        /// Greatest allowed.
        maximum: Option<Expression>,
        /// Offered first.
        default: Option<Expression>,
    },
    /// A line of text.
    Text {
        /// The most characters it may have.
        longest: usize,
    },
    /// A spirit level, read along two axes.
    Level {
        /// Furthest it can show to either side, deg.
        most: f64,
    },
    /// A picture that is taken, by its file.
    Photo,
    /// The arm brought somewhere by hand.
    JogTo {
        /// Which robot.
        robot: String,
        /// Where its name is written.
        span: Span,
        /// Bounds that have to be kept.
        goals: Vec<Goal>,
        /// From which side joints have to arrive.
        arrivals: Vec<Arrival>,
    },
}

/// From which side a joint that is driven by hand has to arrive.
#[derive(Debug, Clone)]
pub(crate) struct Arrival {
    /// The joint.
    pub(crate) joint: String,
    /// Where its name is written.
    pub(crate) span: Span,
    /// The side.
    pub(crate) from: ArrivalSide,
}

/// A side from which a joint arrives.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ArrivalSide {
    /// Its reading increases.
    Below,
    /// Its reading decreases.
    Above,
}

impl ArrivalSide {
    /// As the measurement table has it: 1 from below, -1 from above.
    pub(crate) fn side(self) -> i8 {
        match self {
            Self::Below => 1,
            Self::Above => -1,
        }
    }

    /// `below` or `above`.
    pub(crate) fn in_words(self) -> &'static str {
        match self {
            Self::Below => "below",
            Self::Above => "above",
        }
    }
}

/// Bounds on one joint of a jog.
#[derive(Debug, Clone)]
pub(crate) struct Goal {
    /// The joint.
    pub(crate) joint: String,
    /// Where it is.
    pub(crate) span: Span,
    /// How its numbers are written.
    pub(crate) unit: DegOrMm,
    /// Smallest allowed.
    pub(crate) minimum: Expression,
    /// Greatest allowed.
    pub(crate) maximum: Expression,
}

impl PromptQuestion {
    /// Checks everything it refers to.
    pub(super) fn check(&self, context: &CheckContext<'_>) {
        match self {
            Self::Number { minimum, maximum, default, .. } => {
                for expression in [minimum, maximum, default].into_iter().flatten() {
                    context.check_expression(expression);
                }
            }
            Self::JogTo { robot, span, goals, arrivals } => {
                let robot = context.robot(robot, *span);
                for goal in goals {
                    goal.check(robot, context);
                }
                for arrival in arrivals {
                    if let Some(robot) = robot {
                        context.joint(robot, &arrival.joint, arrival.span);
                    }
                }
            }
            Self::Acknowledge { .. }
            | Self::Choice { .. }
            | Self::Text { .. }
            | Self::Level { .. }
            | Self::Photo => {}
        }
    }

    /// What later expressions may name of the answer.
    pub(super) fn result_shape(&self, cell: &CellNames) -> Shape {
        let numbers = |names: &[&str]| {
            Shape::Map(names.iter().map(|name| ((*name).to_owned(), Shape::Single)).collect())
        };
        match self {
            Self::Acknowledge { .. } => Shape::Map(Vec::new()),
            Self::Choice { .. } => numbers(&["choice"]),
            Self::Number { .. } => numbers(&["value"]),
            Self::Text { .. } => numbers(&["text"]),
            Self::Level { .. } => numbers(&["x_deg", "y_deg", "tilt_deg"]),
            Self::Photo => numbers(&["file", "format", "bytes", "sha256"]),
            Self::JogTo { robot, .. } => Shape::Map(vec![("joints".to_owned(), cell.joints_shape(robot))]),
        }
    }
}

impl Goal {
    fn check(&self, robot: Option<&RobotNames>, context: &CheckContext<'_>) {
        context.check_expression(&self.minimum);
        context.check_expression(&self.maximum);
        if let Some(robot) = robot
            && let Some(unit) = context.joint(robot, &self.joint, self.span)
            && unit != self.unit
        {
            let message = format!("joint `{}` goes by {}", self.joint, unit.symbol());
            context.problems.add(self.span, message, format!("write it under `within_{}`", unit.symbol()));
        }
        self.check_limits(robot, context);
    }

    /// The limits that every position between the bounds lies beyond, in words, where the bounds are known before the run.
    pub(super) fn beyond(&self, robot: &str, context: &MotionContext<'_>) -> Option<String> {
        let bounds = context.time.known(&self.minimum).zip(context.time.known(&self.maximum))?;
        let internal = (self.unit.to_internal(bounds.0), self.unit.to_internal(bounds.1));
        let limits = limits_between((robot, &self.joint), internal, self.unit, context)?;
        let (joint, unit) = (&self.joint, self.unit.symbol());
        let (least, most) = (rounded(bounds.0), rounded(bounds.1));
        Some(format!("{joint} has to come between {least} and {most} {unit}, beyond its limits: {limits}"))
    }

    /// Checks bounds that are written as numbers: that a position is between them, and one that the joint may take by the cell's limits and the robot's own.
    fn check_limits(&self, robot: Option<&RobotNames>, context: &CheckContext<'_>) {
        let written = |bound: &Expression| bound.text().trim().parse::<f64>().ok();
        let Some((least, most)) = written(&self.minimum).zip(written(&self.maximum)) else { return };
        let unit = self.unit.symbol();
        if least > most {
            let message = format!("no place of {} is between {least} and {most} {unit}", self.joint);
            return context.problems.add(self.span, message, "write the lesser one first");
        }
        let Some(robot) = robot else { return };
        let bounds = (self.unit.to_internal(least), self.unit.to_internal(most));
        let of_cell = robot.limits.iter().find(|(joint, ..)| *joint == self.joint);
        let own = robot.own_limits.iter().find(|limits| limits.joint == self.joint);
        let ranges = of_cell
            .map(|(_, least, most)| (*least, *most))
            .into_iter()
            .chain(own.map(OwnLimits::with_zero_shift));
        let out = { ranges }.find_map(|range| outside(range, bounds));
        if let Some(help) = out.and_then(|coordinate| kept_from(robot, &self.joint, coordinate, self.unit)) {
            let message = format!("{} cannot come between {least} and {most} {unit}", self.joint);
            context.problems.add(self.span, message, help);
        }
    }
}
