//! `correct`

use plumb_record::{AppliedCorrection, Budget, CorrectionKey, NewCorrection};
use serde_json::{Map, Value, json};

use crate::engine::Engine;
use crate::engine::journal::Question;
use crate::engine::step_context::{Done, StepContext};
use crate::engine::step_error::StepError;
use crate::event::{LogLevel, NamedValue};
use crate::in_words::{change_in_words, give_or_take};
use crate::prompt::{Answer, ChoiceOption, PromptKind};
use crate::step::{Change, CorrectStep, ParameterCorrection, key_of, name_and_unit};

/// Name of the correction of a sensor's parameter.
pub(crate) const SENSOR_PARAMETER: &str = "sensor_parameter";

/// The key of a sensor's configuration that takes corrections.
const CORRECTIONS: &str = "corrections";

impl Engine {
    pub(super) fn execute_correct(
        &mut self,
        step: &CorrectStep,
        at: &StepContext,
    ) -> Result<Done, StepError> {
        if let Some(done) = self.corrected_before(step, at)? {
            return Ok(done);
        }
        let corrections = self.parameter_corrections(step, at)?;
        let cell = self.cell.name.clone();
        let numbers = self.journal.proposed(&at.path, &cell, &corrections)?;
        if step.ask && !self.are_parameters_accepted(&corrections, at)? {
            let message = format!("discarded: {} works with the values it had", step.sensor);
            return Ok(Done {
                result: json!({"applied": false, "revision": 0}),
                values: Vec::new(),
                message,
            });
        }
        // The sensor takes them before the record says that they apply: a plugin may refuse them.
        let wanted = self.corrections_with(&step.sensor, &corrections)?;
        let configured = self.sensor(&step.sensor)?.link.configure(&json!({CORRECTIONS: wanted}));
        configured.map_err(|error| self.device_error(error))?;
        let reason = format!("run {}, step {}", self.journal.run, at.path);
        let revision = self.journal.applied(&cell, &step.sensor, &numbers, &corrections, &reason)?;
        Ok(done(&corrections, revision))
    }

    /// A run that was killed after it applied corrections and before it said so does not apply them twice.
    fn corrected_before(&mut self, step: &CorrectStep, at: &StepContext) -> Result<Option<Done>, StepError> {
        let stored = self.journal.record.corrections_of_run(self.journal.run)?;
        let mine: Vec<_> =
            stored.into_iter().filter(|known| known.step == at.path.0 && known.revision.is_some()).collect();
        let Some(revision) = mine.last().and_then(|known| known.revision) else { return Ok(None) };
        self.give_corrections(&step.sensor)?;
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

    fn parameter_corrections(
        &mut self,
        step: &CorrectStep,
        at: &StepContext,
    ) -> Result<Vec<NewCorrection>, StepError> {
        let in_force = self.journal.record.corrections_in_force(&self.cell.name, &step.sensor)?;
        let mut corrections = Vec::new();
        for parameter in &step.parameters {
            let (name, unit) = name_and_unit(&parameter.key);
            let key = CorrectionKey {
                device: step.sensor.clone(),
                quantity: SENSOR_PARAMETER.to_owned(),
                place: name.to_owned(),
            };
            let known = in_force.iter().find(|known| known.key == key);
            let old = known.map_or(parameter.change.uncorrected(), |known| known.value);
            let new = self.corrected_value(parameter, old, at)?;
            let budget = self.stated(&parameter.uncertainty, unit, at)?;
            let uncertainty = budget.as_ref().and_then(Budget::standard);
            corrections.push(NewCorrection { key, old, new, uncertainty, budget, unit: unit.to_owned() });
        }
        Ok(corrections)
    }

    /// A parameter's value with its change; an error where the change is implausible.
    fn corrected_value(
        &mut self,
        parameter: &ParameterCorrection,
        old: f64,
        at: &StepContext,
    ) -> Result<f64, StepError> {
        let (new, change) = match &parameter.change {
            Change::Shift(shift) => {
                let shift = self.number(at.scope, shift)?;
                (old + shift, shift)
            }
            Change::Factor(factor) => {
                let factor = self.number(at.scope, factor)?;
                (old * factor, factor - 1.0)
            }
        };
        // Written this way round, a number that is none is implausible too.
        if change.abs() <= parameter.plausible {
            return Ok(new);
        }
        let (name, unit) = name_and_unit(&parameter.key);
        let (is, at_most) = match &parameter.change {
            Change::Shift(_) => {
                (format!("would shift by {change:.3} {unit}"), format!("{} {unit}", parameter.plausible))
            }
            Change::Factor(_) => (
                format!("would change by {:.1} %", 100.0 * change),
                format!("{} %", 100.0 * parameter.plausible),
            ),
        };
        Err(StepError::error(format!(
            "{name} {is}, more than the plausible {at_most}: nothing was changed. Is the file of this device, \
             is everything set up as the procedure asks?",
            at_most = at_most.trim_end()
        )))
    }

    fn are_parameters_accepted(
        &mut self,
        corrections: &[NewCorrection],
        at: &StepContext,
    ) -> Result<bool, StepError> {
        let lines = corrections.iter().map(|one| {
            let (name, unit) = (one.key.place.replace('_', " "), &one.unit);
            let change = change_in_words(one.old, one.new, unit);
            format!("{name}: {change} ({})", give_or_take(one.uncertainty, unit))
        });
        let option = |key: &str, label: &str| ChoiceOption { key: key.to_owned(), label: label.to_owned() };
        let question = Question {
            step: &at.path,
            title: &at.title,
            text: format!("Apply these corrections?\n{}", lines.collect::<Vec<_>>().join("\n")),
            help: Some(format!(
                "They apply from now on, in this run and later ones. The values before them stay in the record and can be rolled back: \
                 `plumb record zeros {}` lists the revisions.",
                self.cell.name
            )),
            kind: PromptKind::Choice {
                options: vec![option("accept", "Apply"), option("reject", "Discard")],
                default: Some("accept".to_owned()),
            },
        };
        let answer = self.ask(question, at)?;
        Ok(answer == Answer::Choice { key: "accept".to_owned() })
    }

    /// Gives a sensor the corrections in force, where there are any: a device that starts knows nothing of them.
    pub(in crate::engine) fn give_corrections(&mut self, sensor: &str) -> Result<(), StepError> {
        let wanted = self.corrections_with(sensor, &[])?;
        if wanted.is_empty() {
            return Ok(());
        }
        let shown: Vec<String> = wanted
            .iter()
            .map(|(key, value)| format!("{key} {value:.4}", value = value.as_f64().unwrap_or(f64::NAN)))
            .collect();
        let configured = self.sensor(sensor)?.link.configure(&json!({CORRECTIONS: wanted}));
        configured.map_err(|error| self.device_error(error))?;
        let message = format!("{sensor} works with the corrections of the record: {}", shown.join(", "));
        Ok(self.journal.log(LogLevel::Info, sensor, None, &message)?)
    }

    /// All corrections of a sensor, as its configuration takes them: those in force, and `more` in their place.
    fn corrections_with(
        &mut self,
        sensor: &str,
        more: &[NewCorrection],
    ) -> Result<Map<String, Value>, StepError> {
        let in_force = self.journal.record.corrections_in_force(&self.cell.name, sensor)?;
        let mut wanted = sensor_corrections(&in_force);
        wanted.extend(more.iter().map(|one| (key_of(&one.key.place, &one.unit), json!(one.new))));
        Ok(wanted)
    }
}

/// Those of the corrections in force that are a sensor's, by the names its configuration has for them.
pub fn sensor_corrections(in_force: &[AppliedCorrection]) -> Map<String, Value> {
    let mine = in_force.iter().filter(|known| known.key.quantity == SENSOR_PARAMETER);
    mine.map(|known| (key_of(&known.key.place, &known.unit), json!(known.value))).collect()
}

fn done(corrections: &[NewCorrection], revision: i64) -> Done {
    let values = corrections.iter().map(|one| NamedValue {
        name: one.key.place.clone(),
        value: one.new,
        unit: one.unit.clone(),
        uncertainty: one.uncertainty,
    });
    let changes = corrections.iter().map(|one| {
        format!("{} {}", one.key.place.replace('_', " "), change_in_words(one.old, one.new, &one.unit))
    });
    Done {
        values: values.collect(),
        result: json!({"applied": true, "revision": revision}),
        message: format!("applied: {} (revision {revision})", changes.collect::<Vec<_>>().join(", ")),
    }
}
