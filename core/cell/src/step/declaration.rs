//! A step as a procedure declares it.

use std::any::Any;
use std::fmt::Debug;
use std::sync::Arc;
use std::time::Duration;

use super::motions::{MotionContext, PlannedMotion};
use super::question::PromptQuestion;
use super::time::{Foreseen, TimeContext};
use super::turns::Turns;
use crate::cell_names::CellNames;
use crate::check_context::CheckContext;
use crate::expression::{Expression, Shape};
use crate::prompt::Decision;
use plumb_document::{Key, Span};

/// One step of a procedure.
#[derive(Debug, Clone)]
pub struct Step {
    /// Unique in the procedure; results are called by it.
    pub id: String,
    /// Position of the id in the file.
    pub span: Span,
    /// For people.
    pub title: String,
    /// Its kind, as files name it.
    pub kind: &'static str,
    /// What it does.
    pub(crate) action: Arc<dyn Action>,
    /// Only when this holds; otherwise it is not needed.
    pub when: Option<Expression>,
    /// It fails when it takes longer.
    pub time_limit: Option<Duration>,
    /// What to do when it fails; left open, a person is asked, and an unattended run ends.
    pub(crate) on_error: Option<OnError>,
    /// How many times `retry` tries before the run ends.
    pub retries: u32,
}

/// What to do when a step fails.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum OnError {
    /// Ask a person.
    Ask,
    /// Do this without asking.
    Decide(Decision),
}

/// What a step does, as far as it is known before a run: the fields of one kind of step. How it is carried out is its
/// [`StepKind`](super::kind::StepKind).
pub(crate) trait Action: Any + Debug + Send + Sync {
    /// Checks everything it refers to.
    fn check(&self, context: &CheckContext<'_>);

    /// What later expressions may name of its result.
    fn result_shape(&self, cell: &CellNames) -> Shape;

    /// Estimated time, seconds; none where a person sets the pace.
    fn estimated_time_s(&self, context: &TimeContext<'_>) -> Option<f64>;

    /// What it would change of what is known before the run. Left out: its result is not known, and the joints it moves are nobody knows where.
    fn foreseen(&self, _context: &TimeContext<'_>) -> Foreseen {
        Foreseen::default()
    }

    /// What it asks a person, or the answers file.
    fn question(&self) -> Option<StepQuestion<'_>> {
        None
    }

    /// The expressions whose values it judges or works with, where these were found by earlier steps: to judge anew is to find them anew.
    fn judged(&self) -> Vec<&str> {
        Vec::new()
    }

    /// The joint it moves and the sensor it watches meanwhile, where it is about one of each.
    fn searched(&self) -> Option<Searched<'_>> {
        None
    }

    /// Robots it may move.
    fn moved_robots(&self) -> Vec<String> {
        Vec::new()
    }

    /// What it would move, for a dry run.
    fn planned_motions(&self, _context: &MotionContext<'_>) -> Vec<PlannedMotion> {
        Vec::new()
    }

    /// Joints of a robot that may be elsewhere after the step was cut off in its middle.
    fn moved_joints(&self, _robot: &str) -> MovedJoints {
        MovedJoints::None
    }

    /// The parameters of a sensor that it corrects.
    fn corrected_parameters(&self, _sensor: &str) -> Vec<&str> {
        Vec::new()
    }

    /// How far at most it corrects the zero of a robot's joint, rad or mm.
    fn zero_shift(&self, _robot: &str, _joint: &str) -> f64 {
        0.0
    }

    /// The steps inside it.
    fn inside(&self) -> Inside<'_> {
        Inside::Nothing
    }
}

/// What a step asks.
#[derive(Debug, Clone, Copy)]
pub(crate) enum StepQuestion<'a> {
    /// What a prompt asks.
    Prompt(&'a PromptQuestion),
    /// Whether corrections are accepted.
    Acceptance,
}

/// What a search is about.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Searched<'a> {
    /// The joint that moves.
    pub(crate) joint: &'a str,
    /// The sensor that is watched.
    pub(crate) sensor: &'a str,
}

/// Joints that a step may have moved.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum MovedJoints {
    /// None of the robot's.
    None,
    /// These.
    Named(Vec<String>),
    /// Any.
    All,
}

impl MovedJoints {
    /// Whether a joint is among them.
    pub(crate) fn contains(&self, joint: &str) -> bool {
        match self {
            Self::None => false,
            Self::Named(names) => names.iter().any(|name| name == joint),
            Self::All => true,
        }
    }
}

/// The steps inside a step.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Inside<'a> {
    /// None: it is carried out by itself.
    Nothing,
    /// Steps that are repeated.
    Repeated {
        /// How often.
        turns: &'a Turns,
        /// Ends the repetition after a turn in which it holds.
        until: Option<&'a Expression>,
        /// What is done each time.
        steps: &'a [Step],
    },
    /// The steps of another procedure.
    Called {
        /// Its file, relative to the file that calls it.
        file: &'a str,
        /// Position of its name.
        span: Span,
        /// Parameters other than their defaults.
        with: &'a [(Key, Expression)],
    },
}

impl Step {
    /// Checks everything the step refers to.
    pub(crate) fn check(&self, context: &CheckContext<'_>) {
        if let Some(when) = &self.when {
            context.check_expression(when);
        }
        self.action.check(context);
    }
}

/// The shape of a result with these numbers.
pub(super) fn numbers_shape(names: &[&str]) -> Shape {
    Shape::Map(names.iter().map(|name| ((*name).to_owned(), Shape::Single)).collect())
}

#[cfg(test)]
mod tests {
    use super::MovedJoints;

    #[test]
    fn a_step_that_was_cut_off_may_have_moved_the_joints_it_names() {
        let named = MovedJoints::Named(vec!["waist".to_owned()]);
        assert!(named.contains("waist") && !named.contains("elbow"));
        assert!(MovedJoints::All.contains("elbow") && !MovedJoints::None.contains("waist"));
    }
}
