//! What a user defines: where it acts, what it adds, its parameters.

use plumb_kinematics::DhParameter;
use thiserror::Error;

use super::formula::{Formula, FormulaError};
use super::variables::Variable;
use crate::effect::{Contribution, Dof, LooksAt, Parameter, Sample, Site};
use crate::file::FilePosition;
use crate::table::Table;

/// What a formula is added to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FormulaTarget {
    /// A joint's coordinate, rad or mm.
    Coordinate(usize),
    /// Another number of a joint's row, mm or rad.
    Row(usize, DhParameter),
    /// A coordinate of a target in the flange's frame, mm.
    Target(usize, usize),
    /// Shift of the base along an axis, mm.
    BaseShift(usize),
    /// Turn of the base about an axis, rad.
    BaseRotation(usize),
    /// What the instrument reads along an axis, mm.
    Reading(usize),
    /// The distance over a surface at which the arm's own sensor triggers, mm.
    TriggerHeight,
}

/// One formula and what it is added to.
#[derive(Debug)]
pub struct Addend {
    /// What it is added to.
    pub target: FormulaTarget,
    /// Key of the model file: `deg`, `x_mm`, ...
    pub key: String,
    /// The formula.
    pub(crate) formula: Formula,
    /// Internal unit per unit of the formula.
    pub(crate) scale: f64,
    /// Where it is in the model file.
    pub(crate) at: FilePosition,
}

impl Addend {
    /// Reads the formula.
    ///
    /// # Errors
    /// See [`FormulaError`]; instruments alone may look at the measured point.
    pub fn new(
        target: FormulaTarget,
        key: &str,
        text: &str,
        parameters: &[String],
        joints: usize,
        at: FilePosition,
    ) -> Result<Self, FormulaError> {
        let formula = Formula::read(text, parameters, joints)?;
        let of_point = formula.variables().find(|variable| variable.looks_at() == LooksAt::Point);
        if let (Some(_), false) = (of_point, matches!(target, FormulaTarget::Reading(_))) {
            let reason = "x, y, z of the measured point can only change what an instrument reads (`reading_x_mm`, ...)";
            return Err(FormulaError::Syntax { text: text.to_owned(), reason: reason.to_owned() });
        }
        let scale = if key.ends_with("deg") { 1.0_f64.to_radians() } else { 1.0 };
        Ok(Self { target, key: key.to_owned(), formula, scale, at })
    }

    /// The formula as it was written.
    pub fn text(&self) -> &str {
        &self.formula.text
    }

    fn values(&self, sample: &Sample<'_>) -> Vec<f64> {
        self.formula.variables().map(|variable| variable.value(sample)).collect()
    }
}

/// A defined effect.
#[derive(Debug)]
pub struct Definition {
    /// Its name.
    pub name: String,
    /// Where it acts.
    pub site: Site,
    /// What it adds.
    pub addends: Vec<Addend>,
    /// Its parameters.
    pub parameters: Vec<Parameter>,
    /// What it is, if the user said.
    pub sentence: Option<String>,
    pub(super) looks_at: LooksAt,
}

impl PartialEq for Definition {
    fn eq(&self, other: &Self) -> bool {
        let mut addends = self.addends.iter().zip(&other.addends);
        self.name == other.name
            && self.site == other.site
            && self.parameters == other.parameters
            && self.addends.len() == other.addends.len()
            && addends.all(|(own, other)| own.target == other.target && own.text() == other.text())
    }
}

/// Shows the sample of a row to who asks for it.
type Samples<'a> = dyn Fn(usize, &mut dyn FnMut(&Sample<'_>)) + 'a;

/// A formula that gives no number somewhere.
#[derive(Debug, Clone, PartialEq, Error)]
#[error(
    "{at}: `{name}`: the formula `{text}` gives no finite number in line {line} of {table} ({values}): {why}"
)]
pub struct DefinitionError {
    at: FilePosition,
    name: String,
    text: String,
    line: u32,
    table: String,
    values: String,
    why: String,
}

impl Definition {
    /// Puts a definition together.
    pub fn new(
        name: &str,
        site: Site,
        addends: Vec<Addend>,
        parameters: Vec<Parameter>,
        sentence: Option<String>,
    ) -> Self {
        let pulls = addends
            .iter()
            .flat_map(|addend| addend.formula.variables())
            .any(|variable| variable.looks_at() == LooksAt::Gravity);
        let reads = addends.iter().any(|addend| matches!(addend.target, FormulaTarget::Reading(_)));
        // What an instrument reads is worked out last, when the arm is and its moments are known.
        let looks_at = if reads {
            LooksAt::Point
        } else if pulls {
            LooksAt::Gravity
        } else {
            LooksAt::Conditions
        };
        Self { name: name.to_owned(), site, addends, parameters, sentence, looks_at }
    }

    /// Whether it can differ between two visits to one pose.
    pub fn depends_on_conditions(&self) -> bool {
        self.variables().any(|variable| {
            !matches!(variable, Variable::Coordinate(_) | Variable::Moment(_) | Variable::Point(_))
        })
    }

    fn variables(&self) -> impl Iterator<Item = Variable> {
        self.addends.iter().flat_map(|addend| addend.formula.variables())
    }

    pub(super) fn contribute(&self, sample: &Sample<'_>, contributions: &mut Vec<Contribution>) {
        for addend in &self.addends {
            let rates = addend.formula.remembered(&addend.values(sample));
            for (parameter, rate) in rates.into_iter().enumerate() {
                let rate = if rate.is_finite() { rate * addend.scale } else { 0.0 };
                contributions.push(match addend.target {
                    FormulaTarget::Coordinate(joint) => sample.contribute_to_joint(joint, parameter, rate),
                    FormulaTarget::Row(joint, dh_parameter) => {
                        Contribution { parameter, dof: Dof::Joint(joint, dh_parameter), rate }
                    }
                    FormulaTarget::Target(target, axis) => {
                        Contribution { parameter, dof: Dof::Target(target, axis), rate }
                    }
                    FormulaTarget::BaseShift(axis) => {
                        Contribution { parameter, dof: Dof::BaseShift(axis), rate }
                    }
                    FormulaTarget::BaseRotation(axis) => {
                        Contribution { parameter, dof: Dof::BaseRotation(axis), rate }
                    }
                    FormulaTarget::Reading(axis) => Contribution { parameter, dof: Dof::Reading(axis), rate },
                    FormulaTarget::TriggerHeight => Contribution { parameter, dof: Dof::Trigger, rate },
                });
            }
        }
    }

    /// Works every formula out in every row, so that none fails later.
    pub(crate) fn check(&self, table: &Table, samples: &Samples<'_>) -> Result<(), Box<DefinitionError>> {
        let mut found = None;
        for row in 0..table.len() {
            samples(row, &mut |sample| {
                for addend in &self.addends {
                    let values = addend.values(sample);
                    let rates = addend.formula.rates(&values);
                    let finite = rates.as_ref().is_ok_and(|rates| rates.iter().all(|rate| rate.is_finite()));
                    if !finite && found.is_none() {
                        found = Some(Box::new(DefinitionError {
                            at: addend.at.clone(),
                            name: self.name.clone(),
                            text: addend.text().to_owned(),
                            line: table.lines.get(row).copied().unwrap_or(0),
                            table: table.source.clone(),
                            values: addend.formula.format_values(&values),
                            why: rates.err().unwrap_or_else(|| why(addend.text())),
                        }));
                    }
                }
            });
            if let Some(found) = found {
                return Err(found);
            }
        }
        Ok(())
    }
}

fn why(text: &str) -> String {
    let reasons = [
        (text.contains('/'), "it divides by zero there; shift the denominator, such as /(1 + q2^2)"),
        (text.contains("tan"), "a tangent has no value at a right angle"),
        (
            text.contains("sqrt") || text.contains("ln") || text.contains("log"),
            "a root or logarithm has no value there",
        ),
    ];
    let reason = reasons.into_iter().find(|(applies, _)| *applies).map(|(_, reason)| reason);
    reason.unwrap_or("it grows beyond all numbers there").to_owned()
}
