//! `correct`: what a calibration found of a sensor is applied, as corrections of its parameters.

use plumb_document::{Key, MapReader, Node, Span};
use plumb_record::{Budget, CorrectionKey, NewCorrection, SENSOR_PARAMETER, record_option};
use serde_json::json;

use super::declaration::{Action, StepQuestion, numbers_shape};
use super::kind::{Kind, StepKind};
use super::time::{EXCHANGE_S, TimeContext};
use crate::cell_names::CellNames;
use crate::check_context::CheckContext;
use crate::engine::Engine;
use crate::engine::journal::Question;
use crate::engine::sensor_corrections::CORRECTIONS;
use crate::engine::step_context::{Done, StepContext};
use crate::engine::step_error::StepError;
use crate::event::NamedValue;
use crate::expression::{Expression, Shape};
use crate::in_words::{change_in_words, give_or_take};
use crate::parameter_name::name_and_unit;
use crate::prompt::{Answer, ChoiceOption, PromptKind};
use crate::read_context::ReadContext;

/// Declared corrections of a sensor's parameters.
#[derive(Debug, Clone)]
pub(crate) struct CorrectStep {
    /// Which sensor.
    pub(crate) sensor: String,
    /// Where its name is written.
    pub(crate) sensor_span: Span,
    /// The parameters that change.
    pub(crate) parameters: Vec<ParameterCorrection>,
    /// A person (or the answers file) accepts it first.
    pub(crate) ask: bool,
}

/// The correction of one parameter.
#[derive(Debug, Clone)]
pub(crate) struct ParameterCorrection {
    /// The parameter, as the sensor's plugin names it under `corrections`: its unit is the end of its name.
    pub(crate) key: String,
    /// How it changes.
    pub(crate) change: Change,
    /// One standard uncertainty of the change, or its budget.
    pub(crate) uncertainty: Expression,
    /// A greater change is a mistake, not a correction.
    pub(crate) plausible: f64,
}

/// How a parameter changes.
#[derive(Debug, Clone)]
pub(crate) enum Change {
    /// By this much; 0 changes nothing, and is the parameter's value before any correction.
    Shift(Expression),
    /// By this factor; 1 changes nothing, and is the parameter's value before any correction.
    Factor(Expression),
}

impl Change {
    /// The parameter's value before any correction.
    pub(crate) fn uncorrected(&self) -> f64 {
        match self {
            Change::Shift(_) => 0.0,
            Change::Factor(_) => 1.0,
        }
    }
}

fn read(node: &Node, context: &ReadContext<'_>) -> Option<CorrectStep> {
    let mut map = MapReader::new(node, "`correct`", context.problems)?;
    let sensor = context.required_text(&mut map, "sensor");
    let parameters =
        map.required("parameters").and_then(|node| node.entries("`parameters`", context.problems));
    let ask = map.optional("ask").and_then(|node| node.boolean("`ask`", context.problems)).unwrap_or(true);
    let span = map.span();
    map.finish();
    let (sensor, sensor_span) = sensor?;
    let parameters = parameters?;
    if parameters.is_empty() {
        let help = "name what changes, as in `parameters: {camera_roll_deg: {shift: found.roll_deg, uncertainty: 0.02, plausible: 5}}`";
        context.problems.add(span, "this corrects nothing", help);
    }
    let parameters: Vec<ParameterCorrection> =
        parameters.iter().filter_map(|(key, node)| read_parameter(key, node, context)).collect();
    Some(CorrectStep { sensor, sensor_span, parameters, ask })
}

fn read_parameter(key: &Key, node: &Node, context: &ReadContext<'_>) -> Option<ParameterCorrection> {
    let mut map = MapReader::new(node, "a parameter's correction", context.problems)?;
    let factor = map.optional("factor");
    let change = match factor {
        Some(node) => context.expression(node, "the factor").map(Change::Factor),
        None => {
            map.required("shift").and_then(|node| context.expression(node, "the shift")).map(Change::Shift)
        }
    };
    let uncertainty =
        map.required("uncertainty").and_then(|node| context.expression(node, "the uncertainty"));
    let plausible = map
        .required("plausible")
        .and_then(|node| node.number_between("`plausible`", 1e-9, 1e6, context.problems));
    map.finish();
    Some(ParameterCorrection {
        key: key.name.clone(),
        change: change?,
        uncertainty: uncertainty?,
        plausible: plausible?,
    })
}

impl Action for CorrectStep {
    fn check(&self, context: &CheckContext<'_>) {
        context.sensor(&self.sensor, self.sensor_span);
        for parameter in &self.parameters {
            let (Change::Shift(change) | Change::Factor(change)) = &parameter.change;
            context.check_expression(change);
            context.check_expression(&parameter.uncertainty);
        }
    }

    fn result_shape(&self, _cell: &CellNames) -> Shape {
        numbers_shape(&["revision", "applied"])
    }

    fn estimated_time_s(&self, _context: &TimeContext<'_>) -> Option<f64> {
        Some(EXCHANGE_S)
    }

    fn question(&self) -> Option<StepQuestion<'_>> {
        self.ask.then_some(StepQuestion::Acceptance)
    }

    fn corrected_parameters(&self, sensor: &str) -> Vec<&str> {
        match self.sensor == sensor {
            true => self.parameters.iter().map(|parameter| parameter.key.as_str()).collect(),
            false => Vec::new(),
        }
    }
}

pub(super) const KIND: Kind = Kind::entry::<CorrectStep>();

impl StepKind for CorrectStep {
    const NAME: &'static str = "correct";
    const SENTENCE: &'static str =
        "applies what was found of a sensor, as a new revision of the corrections of its parameters";
    const SCHEMA: &'static str = r##"{
  "type": "object",
  "additionalProperties": false,
  "required": ["sensor", "parameters"],
  "properties": {
    "sensor": {"$ref": "#/definitions/text"},
    "ask": {"description": "A person (or the answers) accepts it first; true if left out.", "type": "boolean"},
    "parameters": {
      "description": "What changes, as the sensor's plugin names it under `corrections`; a name ends in its unit.",
      "type": "object",
      "additionalProperties": {
        "type": "object",
        "additionalProperties": false,
        "required": ["uncertainty", "plausible"],
        "properties": {
          "shift": {"$ref": "#/definitions/expression"},
          "factor": {"$ref": "#/definitions/expression"},
          "uncertainty": {"$ref": "#/definitions/expression"},
          "plausible": {"description": "A greater shift, or a factor farther from 1, is a mistake.", "type": "number", "minimum": 1e-9, "maximum": 1000000}
        },
        "oneOf": [{"required": ["shift"]}, {"required": ["factor"]}]
      }
    }
  }
}"##;

    fn read(node: &Node, context: &ReadContext<'_>) -> Option<Self> {
        read(node, context)
    }

    fn execute(&self, engine: &mut Engine, at: &StepContext) -> Result<Done, StepError> {
        engine.execute_correct(self, at)
    }
}

impl Engine {
    fn execute_correct(&mut self, step: &CorrectStep, at: &StepContext) -> Result<Done, StepError> {
        if let Some(applied) = self.applied_before(at)? {
            self.give_corrections(&step.sensor)?;
            return Ok(done(&applied.corrections, applied.revision));
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
        let requested = self.corrections_with(&step.sensor, &corrections)?;
        let configured = self.sensor(&step.sensor)?.link.configure(&json!({CORRECTIONS: requested}));
        configured.map_err(|error| self.device_error(error))?;
        let reason = format!("run {}, step {}", self.journal.run, at.path);
        let revision = self.journal.applied(&cell, &step.sensor, &numbers, &corrections, &reason)?;
        Ok(done(&corrections, revision))
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
                site: name.to_owned(),
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
            let (name, unit) = (one.key.site.replace('_', " "), &one.unit);
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
                 `plumb record zeros {}{}` lists the revisions.",
                self.cell.name,
                record_option(self.journal.record.directory())
            )),
            kind: PromptKind::Choice {
                options: vec![option("accept", "Apply"), option("reject", "Discard")],
                default: Some("accept".to_owned()),
            },
            simulated: false,
        };
        let answer = self.ask(question, at)?;
        Ok(answer == Answer::Choice { key: "accept".to_owned() })
    }
}

fn done(corrections: &[NewCorrection], revision: i64) -> Done {
    let values = corrections.iter().map(|one| NamedValue {
        name: one.key.site.clone(),
        value: one.new,
        unit: one.unit.clone(),
        uncertainty: one.uncertainty,
    });
    let changes = corrections.iter().map(|one| {
        format!("{} {}", one.key.site.replace('_', " "), change_in_words(one.old, one.new, &one.unit))
    });
    Done {
        values: values.collect(),
        result: json!({"applied": true, "revision": revision}),
        message: format!("applied: {} (revision {revision})", changes.collect::<Vec<_>>().join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use crate::expression::Calculator;
    use crate::workcell::load_workcell;

    /// What is said of a step that corrects so.
    fn reported(correct: &str) -> String {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
        write("cell.yaml", "cell: bench\ndevices: {eye: {plugin: light-stripe}}\nprocedures: [go.yaml]\n");
        write("go.yaml", &format!("procedure: go\nsteps:\n  - {{id: set, do: {{correct: {correct}}}}}\n"));
        match load_workcell(&folder.path().join("cell.yaml"), &Calculator::new()) {
            Ok(_) => String::new(),
            Err(problems) => problems.iter().map(ToString::to_string).collect(),
        }
    }

    #[test]
    fn a_correction_names_a_sensor_of_the_cell_and_what_it_is_worked_out_from() {
        let parameters = "parameters: {tilt_deg: {shift: 0.1, uncertainty: 0.1, plausible: 5}}";
        assert_eq!(reported(&format!("{{sensor: eye, {parameters}}}")), "");
        let unknown = reported(&format!("{{sensor: eyes, {parameters}}}"));
        assert!(unknown.contains("eyes") && unknown.contains("eye"), "{unknown}");
        for (wrong, word) in [
            (parameters.replace("shift: 0.1", "shift: found.x"), "found"),
            (parameters.replace("uncertainty: 0.1", "uncertainty: known.y"), "known"),
            ("parameters: {}".to_owned(), "this corrects nothing"),
            (parameters.replace("plausible: 5", "plausible: 0"), "`plausible`"),
        ] {
            let reported = reported(&format!("{{sensor: eye, {wrong}}}"));
            assert!(reported.contains(word), "{wrong}: {reported}");
        }
    }
}
