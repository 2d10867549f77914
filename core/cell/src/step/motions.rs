//! Motions that a step would command, for a dry run.

use serde::Serialize;

use super::time::TimeContext;
use crate::check_context::OwnLimits;
use crate::deg_or_mm::DegOrMm;
use crate::expression::Expression;

/// One joint that would move.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PlannedMotion {
    /// The robot.
    pub robot: String,
    /// The joint; none where the operator chooses.
    pub joint: Option<String>,
    /// How, in words: `by 5 deg`, `by at most -40 deg until eye is on`.
    pub how: String,
    /// Fraction of full speed.
    pub speed: f64,
    /// Within what, in words.
    pub limits: String,
    /// It would go beyond the limits that the cell gives the joint, or the robot's own: which these are. The run would end there.
    pub beyond: Option<String>,
}

/// Gives the least and the greatest position of a robot's joint, rad or mm; none where the cell does not say.
pub(crate) type RangeOf<'a> = &'a dyn Fn(&str, &str) -> Option<(f64, f64)>;

/// Gives the limits of a robot's own of its joint, where they are known before it is started.
pub(crate) type OwnLimitsOf<'a> = &'a dyn Fn(&str, &str) -> Option<OwnLimits>;

/// What the motions of a step are worked out from.
pub(crate) struct MotionContext<'a> {
    pub(crate) time: &'a TimeContext<'a>,
    /// The limits of a robot's joint, in words.
    pub(crate) limits: &'a dyn Fn(&str, &str) -> String,
    /// The limits that the cell gives a robot's joint, rad or mm.
    pub(crate) range: RangeOf<'a>,
    pub(crate) own_limits: OwnLimitsOf<'a>,
}

impl MotionContext<'_> {
    /// An amount in words, as far as it is known before the run.
    pub(super) fn amount(&self, expression: &Expression, unit: DegOrMm) -> String {
        match self.time.known(expression) {
            Some(number) => format!("{} {}", rounded(number), unit.symbol()),
            None => format!("`{}` {}, known in the run", expression.text(), unit.symbol()),
        }
    }
}

/// A number for people, without the tail that binary arithmetic leaves.
pub(crate) fn rounded(number: f64) -> f64 {
    (number * 1e6).round() / 1e6
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use plumb_document::{MapReader, Problems, parse};
    use serde_json::{Map, json};

    use super::*;
    use crate::expression::Calculator;

    /// An amount written so, where `travel` is 12.5 before the run and nothing else is known.
    fn amount(text: &str) -> String {
        let (calculator, problems) = (Calculator::new(), Problems::default());
        let file = format!("by: {text}\n");
        let node = parse(Path::new("p.yaml"), &file, &problems).unwrap();
        let by = MapReader::new(&node, "a test", &problems)
            .and_then(|mut map| map.optional("by").cloned())
            .unwrap();
        let expression = Expression::read(&by, "`by`", &calculator, &file, &problems).unwrap();
        let values = Map::from_iter([("travel".to_owned(), json!(12.5))]);
        let time = TimeContext { calculator: &calculator, values, robots: &[] };
        let context = MotionContext {
            time: &time,
            limits: &|_, _| String::new(),
            range: &|_, _| None,
            own_limits: &|_, _| None,
        };
        context.amount(&expression, DegOrMm::Deg)
    }

    #[test]
    fn an_amount_is_a_number_where_it_is_known_before_the_run_and_else_its_expression() {
        assert_eq!(amount("0.1 + 0.2"), "0.3 deg");
        assert_eq!(amount("-2 * travel"), "-25 deg");
        assert_eq!(amount("found.waist_deg"), "`found.waist_deg` deg, known in the run");
    }
}
