//! What every part of a file format needs while it is read and checked.

use std::path::Path;

use crate::expression::{Calculator, Expression, Names, Template};
use crate::yaml::{MapReader, Node, Place, Problems};

/// The file being read.
pub(crate) struct ReadContext<'a> {
    pub(crate) calculator: &'a Calculator,
    /// The file's text.
    pub(crate) file: &'a str,
    /// Where files named in it lie.
    pub(crate) folder: &'a Path,
    pub(crate) problems: &'a Problems,
}

impl ReadContext<'_> {
    pub(crate) fn expression(&self, node: &Node, what: &str) -> Option<Expression> {
        Expression::read(node, what, self.calculator, self.file, self.problems)
    }

    pub(crate) fn template(&self, node: &Node, what: &str) -> Option<Template> {
        Template::read(node, what, self.calculator, self.file, self.problems)
    }

    /// A short text that has to be there.
    pub(crate) fn required_text(
        &self,
        map: &mut MapReader<'_>,
        key: &'static str,
    ) -> Option<(String, Place)> {
        let node = map.required(key)?;
        node.text(&format!("`{key}`"), self.problems).map(|text| (text.to_owned(), node.place))
    }

    /// A number that has a default.
    pub(crate) fn number_or(
        &self,
        map: &mut MapReader<'_>,
        key: &'static str,
        range: (f64, f64),
        default: f64,
    ) -> f64 {
        map.optional(key)
            .and_then(|node| node.number_between(&format!("`{key}`"), range.0, range.1, self.problems))
            .unwrap_or(default)
    }
}

/// The cell a procedure is checked against, and the names its expressions may use at this point.
pub(crate) struct CheckContext<'a> {
    pub(crate) file: &'a str,
    pub(crate) problems: &'a Problems,
    pub(crate) names: &'a Names,
    pub(crate) robots: &'a [RobotNames],
    pub(crate) sensors: &'a [String],
}

/// What a procedure may name of a robot.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct RobotNames {
    pub(crate) name: String,
    pub(crate) joints: Vec<(String, DegOrMm)>,
    /// Surfaces of its model file.
    pub(crate) surfaces: Vec<String>,
    /// Levels of its model file.
    pub(crate) levels: Vec<String>,
    /// Targets of its model file.
    pub(crate) targets: Vec<String>,
}

/// How people write a joint's numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DegOrMm {
    /// A turning joint, in degrees.
    Deg,
    /// A sliding joint or a gripper's opening, in millimetres.
    Mm,
}

impl DegOrMm {
    /// `deg` or `mm`.
    pub fn symbol(self) -> &'static str {
        match self {
            DegOrMm::Deg => "deg",
            DegOrMm::Mm => "mm",
        }
    }

    /// From what people write to the unit inside: rad or mm.
    pub fn to_internal(self, value: f64) -> f64 {
        match self {
            DegOrMm::Deg => value.to_radians(),
            DegOrMm::Mm => value,
        }
    }

    /// From rad or mm to what people read.
    pub fn from_internal(self, value: f64) -> f64 {
        match self {
            DegOrMm::Deg => value.to_degrees(),
            DegOrMm::Mm => value,
        }
    }
}

impl CheckContext<'_> {
    pub(crate) fn check_expression(&self, expression: &Expression) {
        expression.check_names(self.names, self.file, self.problems);
    }

    pub(crate) fn check_template(&self, template: &Template) {
        template.check_names(self.names, self.file, self.problems);
    }

    /// The robot of this name; its absence is reported.
    pub(crate) fn robot(&self, name: &str, place: Place) -> Option<&RobotNames> {
        let found = self.robots.iter().find(|robot| robot.name == name);
        if found.is_none() {
            let help = crate::yaml::did_you_mean(name, self.robots.iter().map(|robot| robot.name.as_str()));
            self.problems.add(place, format!("there is no robot `{name}` in the cell"), help);
        }
        found
    }

    /// Whether there is a sensor of this name; its absence is reported.
    pub(crate) fn sensor(&self, name: &str, place: Place) -> bool {
        let found = self.sensors.iter().any(|sensor| sensor == name);
        if !found {
            let help = crate::yaml::did_you_mean(name, self.sensors.iter().map(String::as_str));
            self.problems.add(place, format!("there is no sensor `{name}` in the cell"), help);
        }
        found
    }

    /// The unit of a robot's joint; its absence is reported.
    pub(crate) fn joint(&self, robot: &RobotNames, joint: &str, place: Place) -> Option<DegOrMm> {
        let found = robot.joints.iter().find(|(name, _)| name == joint);
        if found.is_none() {
            let help = crate::yaml::did_you_mean(joint, robot.joints.iter().map(|(name, _)| name.as_str()));
            self.problems.add(place, format!("robot `{}` has no joint `{joint}`", robot.name), help);
        }
        found.map(|(_, unit)| *unit)
    }
}
