//! How long steps take, as far as can be known before a run.

use nalgebra::IsometryMatrix3;
use serde_json::{Map, Value};

use crate::expression::{Calculator, Expression};

/// Time of a request to a device and its answer, seconds.
pub(crate) const EXCHANGE_S: f64 = 0.02;

/// Time of what only calculates, seconds.
pub(super) const CALCULATION_S: f64 = 0.01;

/// Full speed of a joint that has not told its own, rad/s (or mm/s).
pub(super) const TYPICAL_SPEED: f64 = 0.3;

/// Full speed of a robot's joint, by robot and joint, rad/s or mm/s.
pub(crate) type FullSpeed<'a> = dyn Fn(&str, &str) -> Option<f64> + 'a;

/// How long a robot's flange takes from one place to another at full speed, seconds.
pub(crate) type FlangeTime<'a> = dyn Fn(&str, [IsometryMatrix3<f64>; 2]) -> Option<f64> + 'a;

/// What the time of a step is worked out from.
pub(crate) struct TimeContext<'a> {
    pub(crate) calculator: &'a Calculator,
    /// What is known to the step before the run.
    pub(crate) values: Map<String, Value>,
    /// Where the robot has told it.
    pub(crate) full_speed: &'a FullSpeed<'a>,
    /// Where the robot is there and its model known.
    pub(crate) flange_time: &'a FlangeTime<'a>,
}

impl TimeContext<'_> {
    /// What an expression comes to, where that is known before the run.
    pub(crate) fn known(&self, expression: &Expression) -> Option<f64> {
        expression.number(self.calculator, &self.values).ok()
    }

    /// Full speed of a joint, rad/s or mm/s.
    pub(super) fn full_speed(&self, robot: &str, joint: &str) -> f64 {
        (self.full_speed)(robot, joint).map_or(TYPICAL_SPEED, |speed| speed.max(1e-3))
    }
}
