//! `apply`: what was found is put in force.

use plumb_document::{MapReader, Node, Span};
use plumb_record::{Budget, CorrectionKey, JOINT_ZERO, NewCorrection, record_option};
use serde_json::{Map, Value, json};

use super::declaration::{Action, StepQuestion, numbers_shape};
use super::error_terms::{self, ErrorTerm};
use super::kind::{Kind, StepKind};
use super::time::{CALCULATION_S, TimeContext};
use crate::cell_names::CellNames;
use crate::check_context::CheckContext;
use crate::deg_or_mm::DegOrMm;
use crate::engine::Engine;
use crate::engine::journal::Question;
use crate::engine::step_context::{Done, StepContext};
use crate::engine::step_error::StepError;
use crate::event::{LogLevel, NamedValue};
use crate::expression::{Expression, Shape};
use crate::in_words::{give_or_take, left_open};
use crate::prompt::{Answer, ChoiceOption, PromptKind};
use crate::read_context::ReadContext;

mod unusual;

/// A declared correction of joint zeros.
#[derive(Debug, Clone)]
pub(crate) struct ApplyStep {
    /// Which robot.
    pub(crate) robot: String,
    /// Where its name is written.
    pub(crate) robot_span: Span,
    /// The joints whose zeros shift.
    pub(crate) shifts: Vec<ZeroShift>,
    /// A person (or the answers file) accepts it first.
    pub(crate) ask: bool,
}

/// The shift of one joint's zero.
#[derive(Debug, Clone)]
pub(crate) struct ZeroShift {
    /// The joint.
    pub(crate) joint: String,
    /// Where it is.
    pub(crate) span: Span,
    /// How its numbers are written.
    pub(crate) unit: DegOrMm,
    /// Where the joint truly was, less where it was thought to be.
    pub(crate) shift: Expression,
    /// How far off the shift may be.
    pub(crate) uncertainty: ShiftUncertainty,
    /// A greater shift is a mistake, not a correction.
    pub(crate) plausible: f64,
}

/// What is said of the uncertainty of a shift.
#[derive(Debug, Clone)]
pub(crate) enum ShiftUncertainty {
    /// One standard uncertainty, or a budget of a `compute` step.
    Stated(Expression),
    /// What the shift depends on and is not known exactly; the shift names them.
    Errors(Vec<ErrorTerm>),
}

fn read(node: &Node, context: &ReadContext<'_>) -> Option<ApplyStep> {
    let mut map = MapReader::new(node, "`apply`", context.problems)?;
    let robot = context.required_text(&mut map, "robot");
    let zeros = map.required("joint_zero").and_then(|node| node.entries("`joint_zero`", context.problems));
    let ask = map.optional("ask").and_then(|node| node.boolean("`ask`", context.problems)).unwrap_or(true);
    map.finish();
    let (robot, robot_span) = robot?;
    let shifts: Vec<ZeroShift> = zeros?
        .iter()
        .filter_map(|(joint, node)| read_shift(&joint.name, joint.span, node, context))
        .collect();
    Some(ApplyStep { robot, robot_span, shifts, ask })
}

fn read_shift(joint: &str, span: Span, node: &Node, context: &ReadContext<'_>) -> Option<ZeroShift> {
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
        span,
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
    let (stated, span) = (map.optional(key), map.span());
    match (stated, errors.is_empty()) {
        (None, false) => Some(ShiftUncertainty::Errors(errors)),
        (Some(node), true) => context.expression(node, "the uncertainty").map(ShiftUncertainty::Stated),
        _ => {
            let help = format!(
                "give either `errors:`, what the shift depends on and is not known exactly, or `{key}:`"
            );
            context.problems.add(span, "how uncertain is this shift?", help);
            None
        }
    }
}

impl Action for ApplyStep {
    fn check(&self, context: &CheckContext<'_>) {
        let robot = context.robot(&self.robot, self.robot_span);
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
                && let Some(unit) = context.joint(robot, &shift.joint, shift.span)
                && unit != shift.unit
            {
                let message = format!("joint `{}` goes by {}", shift.joint, unit.symbol());
                context.problems.add(shift.span, message, format!("write `shift_{}`", unit.symbol()));
            }
        }
    }

    fn result_shape(&self, _cell: &CellNames) -> Shape {
        numbers_shape(&["revision", "applied"])
    }

    fn estimated_time_s(&self, _context: &TimeContext<'_>) -> Option<f64> {
        Some(CALCULATION_S)
    }

    fn question(&self) -> Option<StepQuestion<'_>> {
        self.ask.then_some(StepQuestion::Acceptance)
    }

    fn zero_shift(&self, robot: &str, joint: &str) -> f64 {
        let own = self.shifts.iter().filter(|shift| self.robot == robot && shift.joint == joint);
        own.map(|shift| shift.unit.to_internal(shift.plausible)).fold(0.0, f64::max)
    }
}

pub(super) const KIND: Kind = Kind::entry::<ApplyStep>();

impl StepKind for ApplyStep {
    const NAME: &'static str = "apply";
    const SENTENCE: &'static str = "puts what was found in force as a new revision of the arm's joint zeros";
    const SCHEMA: &'static str = r##"{
  "type": "object",
  "additionalProperties": false,
  "required": ["robot", "joint_zero"],
  "properties": {
    "robot": {"$ref": "#/definitions/text"},
    "ask": {"description": "A person (or the answers) accepts it first; true if left out.", "type": "boolean"},
    "joint_zero": {
      "type": "object",
      "additionalProperties": {
        "type": "object",
        "additionalProperties": false,
        "properties": {
          "shift_deg": {"$ref": "#/definitions/expression"},
          "uncertainty_deg": {"$ref": "#/definitions/expression"},
          "errors": {"$ref": "#/definitions/errors"},
          "plausible_deg": {"type": "number", "minimum": 0.000001, "maximum": 10000},
          "shift_mm": {"$ref": "#/definitions/expression"},
          "uncertainty_mm": {"$ref": "#/definitions/expression"},
          "plausible_mm": {"type": "number", "minimum": 0.000001, "maximum": 10000}
        },
        "oneOf": [
          {"required": ["shift_deg", "uncertainty_deg"]},
          {"required": ["shift_deg", "errors"]},
          {"required": ["shift_mm", "uncertainty_mm"]},
          {"required": ["shift_mm", "errors"]}
        ]
      }
    }
  }
}"##;

    fn read(node: &Node, context: &ReadContext<'_>) -> Option<Self> {
        read(node, context)
    }

    fn execute(&self, engine: &mut Engine, at: &StepContext) -> Result<Done, StepError> {
        engine.execute_apply(self, at)
    }
}

impl Engine {
    fn execute_apply(&mut self, step: &ApplyStep, at: &StepContext) -> Result<Done, StepError> {
        if let Some(applied) = self.applied_before(at)? {
            self.take_over_zeros(&step.robot)?;
            return Ok(done(&applied.corrections, applied.revision));
        }
        let corrections = self.found_corrections(step, at)?;
        let cell = self.cell.name.clone();
        let numbers = self.journal.proposed(&at.path, &cell, &corrections)?;
        if step.ask && !self.is_accepted(step, &corrections, at)? {
            let message = "the corrections were rejected: what was in force stays".to_owned();
            return Ok(Done {
                result: json!({"applied": false, "revision": 0}),
                values: Vec::new(),
                message,
            });
        }
        let reason = format!("run {}, step {}", self.journal.run, at.path);
        let revision = self.journal.applied(&cell, &step.robot, &numbers, &corrections, &reason)?;
        self.take_over_zeros(&step.robot)?;
        Ok(done(&corrections, revision))
    }

    fn found_corrections(
        &mut self,
        step: &ApplyStep,
        at: &StepContext,
    ) -> Result<Vec<NewCorrection>, StepError> {
        let mut corrections = Vec::new();
        for zero in &step.shifts {
            let (shift, budget) = self.shift_of(zero, at)?;
            let unit = zero.unit.symbol();
            check_plausible(&zero.joint, shift, zero.plausible, unit).map_err(StepError::Error)?;
            let arm = self.arm(&step.robot)?;
            let old = zero.unit.from_internal(arm.zero(arm.joint(&zero.joint)?));
            let key = CorrectionKey {
                device: step.robot.clone(),
                quantity: JOINT_ZERO.to_owned(),
                site: zero.joint.clone(),
            };
            corrections.push(NewCorrection {
                key,
                old,
                new: old + shift,
                uncertainty: budget.as_ref().and_then(Budget::standard),
                budget,
                unit: unit.to_owned(),
            });
        }
        Ok(corrections)
    }

    /// The shift of a zero, and what its uncertainty is made of.
    fn shift_of(&mut self, zero: &ZeroShift, at: &StepContext) -> Result<(f64, Option<Budget>), StepError> {
        match &zero.uncertainty {
            ShiftUncertainty::Stated(uncertainty) => {
                let shift = self.number(at.scope, &zero.shift)?;
                Ok((shift, self.stated(uncertainty, zero.unit.symbol(), at)?))
            }
            ShiftUncertainty::Errors(errors) => {
                const SHIFT: &str = "shift";
                let evaluated =
                    self.evaluate_with_errors(errors, &[zero.shift.text()], at, |engine, values| {
                        let shift = zero.shift.number(&engine.calculator, values)?;
                        Ok(Map::from_iter([(SHIFT.to_owned(), shift.into())]))
                    })?;
                let shift = evaluated.results.get(SHIFT).and_then(Value::as_f64).ok_or_else(|| {
                    StepError::Error(format!("`{}` gives no number to shift a zero by", zero.shift.text()))
                })?;
                Ok((shift, evaluated.budgets.into_iter().next().map(|(_, budget)| budget)))
            }
        }
    }

    fn is_accepted(
        &mut self,
        step: &ApplyStep,
        corrections: &[NewCorrection],
        at: &StepContext,
    ) -> Result<bool, StepError> {
        let mut lines = Vec::new();
        for one in corrections {
            let (site, unit) = (&one.key.site, &one.unit);
            let around = give_or_take(one.uncertainty, unit);
            lines.push(format!("zero of {site}: {:.4} -> {:.4} {unit} ({around})", one.old, one.new));
            lines.extend(one.budget.as_ref().and_then(|budget| left_open(budget, unit)));
        }
        for warning in self.unusual(step, corrections)? {
            self.journal.log(LogLevel::Warning, "apply", Some(&at.path), &warning)?;
            lines.push(format!("LOOK AT THIS FIRST: {warning}"));
        }
        let option = |key: &str, label: &str| ChoiceOption { key: key.to_owned(), label: label.to_owned() };
        let question = Question {
            step: &at.path,
            title: &at.title,
            text: format!("Apply these corrections?\n{}", lines.join("\n")),
            help: Some(format!(
                "The old values stay in the record and can be restored: `plumb record zeros {}{}` lists the revisions.",
                self.cell.name,
                record_option(self.journal.record.directory())
            )),
            kind: PromptKind::Choice {
                options: vec![option("accept", "Apply"), option("reject", "Discard (keep the old values)")],
                default: Some("accept".to_owned()),
            },
            simulated: false,
        };
        let answer = self.ask(question, at)?;
        Ok(answer == Answer::Choice { key: "accept".to_owned() })
    }
}

/// Whether a zero may shift by so much. A shift that is no number may not.
fn check_plausible(joint: &str, shift: f64, plausible: f64, unit: &str) -> Result<(), String> {
    if shift.abs() <= plausible {
        return Ok(());
    }
    Err(format!(
        "the zero of {joint} would shift by {shift:.3} {unit}, more than the {plausible} {unit} that are plausible: the target may lie elsewhere, \
         or something else than its edge was found"
    ))
}

fn done(corrections: &[NewCorrection], revision: i64) -> Done {
    let values = corrections.iter().map(|one| NamedValue {
        name: format!("zero of {}", one.key.site),
        value: one.new,
        unit: one.unit.clone(),
        uncertainty: one.uncertainty,
    });
    let shifts =
        corrections.iter().map(|one| format!("{} by {:+.4} {}", one.key.site, one.new - one.old, one.unit));
    Done {
        values: values.collect(),
        result: json!({"applied": true, "revision": revision}),
        message: format!("zeros shifted: {} (revision {revision})", shifts.collect::<Vec<_>>().join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::check_plausible;

    #[test]
    fn a_shift_beyond_what_is_plausible_is_refused_and_so_is_one_that_is_no_number() {
        let check = |shift| check_plausible("waist", shift, 2.0, "deg");
        assert_eq!((check(2.0), check(-2.0), check(0.0)), (Ok(()), Ok(()), Ok(())));
        for (shift, shown) in
            [(2.001, "2.001"), (-2.001, "-2.001"), (f64::NAN, "NaN"), (f64::INFINITY, "inf")]
        {
            let message = check(shift).unwrap_err();
            assert!(
                message.starts_with(&format!("the zero of waist would shift by {shown} deg")),
                "{message}"
            );
        }
    }
}
