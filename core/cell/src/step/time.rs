//! How long steps take, as far as can be known before a run.

use serde_json::{Map, Value};

use super::known_robot::KnownRobot;
use crate::expression::{Calculator, Expression};

/// Time of a request to a device and its answer, seconds.
pub(crate) const EXCHANGE_S: f64 = 0.02;

/// Time of what only calculates, seconds.
pub(super) const CALCULATION_S: f64 = 0.002;

/// What the time of a step is worked out from.
pub(crate) struct TimeContext<'a> {
    pub(crate) calculator: &'a Calculator,
    /// What is known to the step before the run.
    pub(crate) values: Map<String, Value>,
    /// The cell's robots as the step finds them.
    pub(crate) robots: &'a [KnownRobot<'a>],
}

impl<'a> TimeContext<'a> {
    /// What an expression comes to, where that is known before the run.
    pub(crate) fn known(&self, expression: &Expression) -> Option<f64> {
        expression.number(self.calculator, &self.values).ok()
    }

    /// A robot of the cell.
    pub(crate) fn robot(&self, name: &str) -> Option<&'a KnownRobot<'a>> {
        self.robots.iter().find(|robot| robot.name() == name)
    }
}

/// What a step would change of what is known before the run.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Foreseen {
    /// Its result, where it is known.
    pub(crate) result: Option<Value>,
    /// Robots and joints that would be elsewhere: where, rad or mm, or None for a position that is not known.
    pub(crate) joints: Vec<(String, String, Option<f64>)>,
}
