//! `apply`

use plumb_record::{Budget, CorrectionKey, NewCorrection};
use serde_json::{Map, Value, json};

use crate::engine::Engine;
use crate::engine::arm::JOINT_ZERO;
use crate::engine::journal::Question;
use crate::engine::step_context::{Done, StepContext};
use crate::engine::step_error::StepError;
use crate::event::{LogLevel, NamedValue};
use crate::in_words::{give_or_take, left_open};
use crate::prompt::{Answer, ChoiceOption, PromptKind};
use crate::step::{ApplyStep, ShiftUncertainty, ZeroShift};

impl Engine {
    pub(super) fn execute_apply(&mut self, step: &ApplyStep, at: &StepContext) -> Result<Done, StepError> {
        if let Some(done) = self.applied_before(step, at)? {
            return Ok(done);
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

    /// A run that was killed after it applied and before it said so does not apply twice.
    fn applied_before(&mut self, step: &ApplyStep, at: &StepContext) -> Result<Option<Done>, StepError> {
        let stored = self.journal.record.corrections_of_run(self.journal.run)?;
        let mine: Vec<_> =
            stored.into_iter().filter(|known| known.step == at.path.0 && known.revision.is_some()).collect();
        let Some(revision) = mine.last().and_then(|known| known.revision) else { return Ok(None) };
        self.take_over_zeros(&step.robot)?;
        let corrections: Vec<NewCorrection> = mine
            .into_iter()
            .map(|known| NewCorrection {
                key: known.key,
                old: known.old,
                new: known.new,
                uncertainty: known.uncertainty,
                budget: known.budget,
                unit: known.unit,
            })
            .collect();
        Ok(Some(done(&corrections, revision)))
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
            if shift.abs() > zero.plausible {
                return Err(StepError::error(format!(
                    "the zero of {} would shift by {shift:.3} {unit}, more than the {} {unit} that are plausible: the target may lie elsewhere, \
                     or something else than its edge was found",
                    zero.joint, zero.plausible
                )));
            }
            let arm = self.arm(&step.robot)?;
            let old = arm.column(&zero.joint).map_or(0.0, |column| zero.unit.from_internal(arm.zero(column)));
            let key = CorrectionKey {
                device: step.robot.clone(),
                quantity: JOINT_ZERO.to_owned(),
                place: zero.joint.clone(),
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
            let (place, unit) = (&one.key.place, &one.unit);
            let around = give_or_take(one.uncertainty, unit);
            lines.push(format!("zero of {place}: {:.4} -> {:.4} {unit} ({around})", one.old, one.new));
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
            text: format!("Put these corrections in force?\n{}", lines.join("\n")),
            help: Some(format!(
                "What was in force before is kept in the record and can be brought back: `plumb record zeros {}` lists the revisions.",
                self.cell.name
            )),
            kind: PromptKind::Choice {
                options: vec![
                    option("accept", "Put them in force"),
                    option("reject", "Leave everything as it is"),
                ],
                default: Some("accept".to_owned()),
            },
        };
        let answer = self.ask(question, at)?;
        Ok(answer == Answer::Choice { key: "accept".to_owned() })
    }

    /// Reads the zeros in force from the record.
    pub(in crate::engine) fn take_over_zeros(&mut self, robot: &str) -> Result<(), StepError> {
        let corrections = self.zeros_in_force(robot)?;
        let trusted = self.trusts_zeros(robot);
        if let Some(arm) = self.arms.iter_mut().find(|arm| arm.name == robot) {
            arm.set_zeros(&corrections, trusted);
        }
        Ok(())
    }
}

fn done(corrections: &[NewCorrection], revision: i64) -> Done {
    let values = corrections.iter().map(|one| NamedValue {
        name: format!("zero of {}", one.key.place),
        value: one.new,
        unit: one.unit.clone(),
        uncertainty: one.uncertainty,
    });
    let shifts =
        corrections.iter().map(|one| format!("{} by {:+.4} {}", one.key.place, one.new - one.old, one.unit));
    Done {
        values: values.collect(),
        result: json!({"applied": true, "revision": revision}),
        message: format!("zeros shifted: {} (revision {revision})", shifts.collect::<Vec<_>>().join(", ")),
    }
}
