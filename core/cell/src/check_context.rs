//! What every step needs while a procedure is checked against a cell.

use plumb_document::{Problems, Span};

use crate::deg_or_mm::DegOrMm;
use crate::expression::{Expression, Names, Template};
use crate::stream_names::DeviceStreams;

/// The cell a procedure is checked against, and the names its expressions may use at this point.
pub(crate) struct CheckContext<'a> {
    pub(crate) file: &'a str,
    pub(crate) problems: &'a Problems,
    pub(crate) names: &'a Names,
    pub(crate) robots: &'a [RobotNames],
    pub(crate) sensors: &'a [String],
    /// Of each device whose manifest is known.
    pub(crate) streams: &'a [DeviceStreams],
}

/// What a procedure may name of a robot.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct RobotNames {
    pub(crate) name: String,
    pub(crate) joints: Vec<(String, DegOrMm)>,
    /// Limits that the cell gives joints: joint, least, most; rad or mm.
    pub(crate) limits: Vec<(String, f64, f64)>,
    /// Limits of the robot's own, where they are known before it is started.
    pub(crate) own_limits: Vec<OwnLimits>,
    /// Surfaces of its model file.
    pub(crate) surfaces: Vec<String>,
    /// Levels of its model file.
    pub(crate) levels: Vec<String>,
    /// Targets of its model file.
    pub(crate) targets: Vec<String>,
    /// Boards of its model file that have names.
    pub(crate) boards: Vec<String>,
}

/// How far a joint goes by what its robot allows, rad or mm.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct OwnLimits {
    /// The joint.
    pub(crate) joint: String,
    /// The lowest its drive goes.
    pub(crate) least: f64,
    /// The highest its drive goes.
    pub(crate) most: f64,
    /// How far the cell's procedures may correct its zero: a position beyond by no more may be within once that has been done.
    pub(crate) zero_shift: f64,
}

impl CheckContext<'_> {
    pub(crate) fn check_expression(&self, expression: &Expression) {
        expression.check_names(self.names, self.file, self.problems);
    }

    pub(crate) fn check_template(&self, template: &Template) {
        template.check_names(self.names, self.file, self.problems);
    }

    /// The robot of this name; its absence is reported.
    pub(crate) fn robot(&self, name: &str, span: Span) -> Option<&RobotNames> {
        let found = self.robots.iter().find(|robot| robot.name == name);
        if found.is_none() {
            let help =
                plumb_document::did_you_mean(name, self.robots.iter().map(|robot| robot.name.as_str()));
            self.problems.add(span, format!("there is no robot `{name}` in the cell"), help);
        }
        found
    }

    /// Whether there is a sensor of this name; its absence is reported.
    pub(crate) fn sensor(&self, name: &str, span: Span) -> bool {
        let found = self.sensors.iter().any(|sensor| sensor == name);
        if !found {
            let help = plumb_document::did_you_mean(name, self.sensors.iter().map(String::as_str));
            self.problems.add(span, format!("there is no sensor `{name}` in the cell"), help);
        }
        found
    }

    /// The unit of a robot's joint; its absence is reported.
    pub(crate) fn joint(&self, robot: &RobotNames, joint: &str, span: Span) -> Option<DegOrMm> {
        let found = robot.joints.iter().find(|(name, _)| name == joint);
        if found.is_none() {
            let help =
                plumb_document::did_you_mean(joint, robot.joints.iter().map(|(name, _)| name.as_str()));
            self.problems.add(span, format!("robot `{}` has no joint `{joint}`", robot.name), help);
        }
        found.map(|(_, unit)| *unit)
    }
}
