//! What a prompt asks.

use plumb_document::Span;

use crate::cell_names::CellNames;
use crate::check_context::{CheckContext, RobotNames};
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
        /// Where its name stands.
        place: Span,
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
    /// Where its name stands.
    pub(crate) place: Span,
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
    /// Where it stands.
    pub(crate) place: Span,
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
            Self::JogTo { robot, place, goals, arrivals } => {
                let robot = context.robot(robot, *place);
                for goal in goals {
                    goal.check(robot, context);
                }
                for arrival in arrivals {
                    if let Some(robot) = robot {
                        context.joint(robot, &arrival.joint, arrival.place);
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
            && let Some(unit) = context.joint(robot, &self.joint, self.place)
            && unit != self.unit
        {
            let message = format!("joint `{}` goes by {}", self.joint, unit.symbol());
            context.problems.add(self.place, message, format!("write it under `within_{}`", unit.symbol()));
        }
    }
}
