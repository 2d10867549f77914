//! `prompt`: something a person does or knows.

use plumb_document::{MapReader, Node, NodeValue, Span};
use serde_json::json;

use super::declaration::{Action, StepQuestion};
use super::kind::{Kind, StepKind};
use super::motions::{MotionContext, PlannedMotion};
use super::question::PromptQuestion;
use super::read_question::{read_choice, read_jog, read_level, read_number, read_photo, read_write};
use super::time::TimeContext;
use crate::cell_names::CellNames;
use crate::check_context::CheckContext;
use crate::device::Act;
use crate::drawing::two_views;
use crate::engine::Engine;
use crate::engine::journal::Question as Asked;
use crate::engine::step_context::{Done, StepContext};
use crate::engine::step_error::StepError;
use crate::event::NamedValue;
use crate::expression::{Expression, Shape, Template};
use crate::photo;
use crate::prompt::{Answer, JogGoal, PromptKind};
use crate::read_context::ReadContext;

mod jog;
mod pendant;

use pendant::Pendant;

/// Fraction of full speed at which an operator jogs a robot.
const JOG_SPEED: f64 = 0.5;

/// A declared prompt.
#[derive(Debug, Clone)]
pub(crate) struct PromptStep {
    /// What is asked, or to be done.
    pub(crate) text: Template,
    /// More, for who wants to know.
    pub(crate) help: Option<Template>,
    /// The robot that is drawn under the text as it is, and where its name is written.
    pub(crate) draw: Option<(String, Span)>,
    /// What counts as an answer.
    pub(crate) question: PromptQuestion,
    /// In a simulated cell, what the operator's hands do when this is answered, or what the instrument reads that is asked for.
    pub(crate) simulated: Option<SimulatedAct>,
}

/// Something an operator does in a simulated world: the world knows it by name. Where the world is real, people do it.
#[derive(Debug, Clone)]
pub(crate) struct SimulatedAct {
    /// Its name.
    pub(crate) act: String,
    /// Its numbers.
    pub(crate) numbers: Vec<(String, Expression)>,
    /// Its words.
    pub(crate) words: Vec<(String, String)>,
}

/// What an act is given in words; all else are numbers.
const WORDS: [&str; 7] = ["at", "joint", "axis", "turned", "from", "laser", "filter"];

fn read(node: &Node, context: &ReadContext<'_>) -> Option<PromptStep> {
    let mut map = MapReader::new(node, "a prompt", context.problems)?;
    let text = map.required("text").and_then(|node| context.template(node, "`text`"));
    let help = map.optional("help").and_then(|node| context.template(node, "`help`"));
    let draw = map
        .optional("draw")
        .and_then(|node| Some((node.text("`draw`", context.problems)?.to_owned(), node.span)));
    let acknowledge = map.optional("acknowledge");
    let choice = map.optional("choice");
    let default = map.optional("default");
    let number = map.optional("number");
    let write = map.optional("write");
    let level = map.optional("level");
    let photo = map.optional("photo");
    let jog_to = map.optional("jog_to");
    let simulated = map.optional("simulated").and_then(|node| read_simulated(node, context));
    let span = map.span();
    map.finish();
    let given = [acknowledge, choice, number, write, level, photo, jog_to].iter().flatten().count();
    if given > 1 {
        context.problems.add(
            span,
            "a prompt asks for one thing",
            "keep one of `acknowledge`, `choice`, `number`, `write`, `level`, `photo`, `jog_to`",
        );
    }
    let question = match (choice, number, write, (level, photo), jog_to) {
        (Some(node), ..) => read_choice(node, default, context),
        (_, Some(node), ..) => read_number(node, context),
        (_, _, Some(node), ..) => read_write(node, context),
        (_, _, _, (Some(node), _), _) => read_level(node, context),
        (_, _, _, (_, Some(node)), _) => read_photo(node, context),
        (.., Some(node)) => read_jog(node, context),
        _ => {
            let label =
                acknowledge.and_then(|node| node.text("`acknowledge`", context.problems)).unwrap_or("Done");
            Some(PromptQuestion::Acknowledge { label: label.to_owned() })
        }
    };
    Some(PromptStep { text: text?, help, draw, question: question?, simulated })
}

fn read_simulated(node: &Node, context: &ReadContext<'_>) -> Option<SimulatedAct> {
    let entries = node.entries("`simulated`", context.problems)?;
    let [(act, values)] = entries else {
        let help = "write the act and its numbers, as in `simulated: {rest_on_gauge: {height_mm: h_mm}}`";
        context.problems.add(node.span, "a simulated operator does one thing", help);
        return None;
    };
    let mut read = SimulatedAct { act: act.name.clone(), numbers: Vec::new(), words: Vec::new() };
    for (key, node) in values.entries("the values of an act", context.problems)? {
        let what = format!("`{}`", key.name);
        match &node.value {
            NodeValue::Bool(word) if WORDS.contains(&key.name.as_str()) => {
                read.words.push((key.name.clone(), word.to_string()));
            }
            _ if WORDS.contains(&key.name.as_str()) => {
                read.words.push((key.name.clone(), node.text(&what, context.problems)?.to_owned()));
            }
            _ => read.numbers.push((key.name.clone(), context.expression(node, &what)?)),
        }
    }
    Some(read)
}

impl Action for PromptStep {
    fn check(&self, context: &CheckContext<'_>) {
        context.check_template(&self.text);
        if let Some(help) = &self.help {
            context.check_template(help);
        }
        for (_, value) in self.simulated.iter().flat_map(|simulated| &simulated.numbers) {
            context.check_expression(value);
        }
        if let Some((robot, span)) = &self.draw {
            context.robot(robot, *span);
        }
        self.question.check(context);
    }

    fn result_shape(&self, cell: &CellNames) -> Shape {
        self.question.result_shape(cell)
    }

    fn estimated_time_s(&self, _context: &TimeContext<'_>) -> Option<f64> {
        None
    }

    fn question(&self) -> Option<StepQuestion<'_>> {
        Some(StepQuestion::Prompt(&self.question))
    }

    fn moved_robots(&self) -> Vec<String> {
        match &self.question {
            PromptQuestion::JogTo { robot, .. } => vec![robot.clone()],
            _ => Vec::new(),
        }
    }

    fn planned_motions(&self, context: &MotionContext<'_>) -> Vec<PlannedMotion> {
        let PromptQuestion::JogTo { robot, goals, .. } = &self.question else { return Vec::new() };
        vec![PlannedMotion {
            robot: robot.clone(),
            joint: None,
            how: "where the operator jogs it".to_owned(),
            speed: JOG_SPEED,
            limits: "the limits of each joint".to_owned(),
            beyond: goals.iter().find_map(|goal| goal.beyond(robot, context)),
        }]
    }
}

pub(super) const KIND: Kind = Kind::entry::<PromptStep>();

impl StepKind for PromptStep {
    const NAME: &'static str = "prompt";
    const SENTENCE: &'static str =
        "asks a person: to do something and confirm, to choose, for a number, or to bring the arm somewhere";
    const SCHEMA: &'static str = r##"{
  "type": "object",
  "additionalProperties": false,
  "required": ["text"],
  "properties": {
    "text": {"$ref": "#/definitions/template"},
    "help": {"$ref": "#/definitions/template"},
    "acknowledge": {"description": "What the operator confirms; Done if left out.", "$ref": "#/definitions/text"},
    "choice": {"description": "Keys and what people read.", "type": "object", "minProperties": 2, "additionalProperties": {"$ref": "#/definitions/text"}},
    "default": {"description": "The key of a choice to offer first.", "$ref": "#/definitions/text"},
    "write": {
      "description": "A line of text is asked for.",
      "type": "object",
      "additionalProperties": false,
      "properties": {"longest": {"description": "The most characters; 80 if left out.", "type": "number", "minimum": 1, "maximum": 400}}
    },
    "level": {
      "description": "A spirit level is read along two axes, deg.",
      "type": "object",
      "additionalProperties": false,
      "properties": {"most_deg": {"description": "The most it shows to either side; 10 if left out.", "type": "number", "minimum": 0.01, "maximum": 90}}
    },
    "photo": {
      "description": "A picture is taken, and its file named: PNG or JPEG. The record keeps its SHA-256.",
      "type": "object",
      "additionalProperties": false
    },
    "number": {
      "type": "object",
      "additionalProperties": false,
      "required": ["unit"],
      "properties": {
        "unit": {"description": "The unit, or `none`.", "$ref": "#/definitions/text"},
        "minimum": {"$ref": "#/definitions/expression"},
        "maximum": {"$ref": "#/definitions/expression"},
        "default": {"$ref": "#/definitions/expression"}
      }
    },
    "draw": {"description": "The robot that is drawn under the text in its present pose.", "$ref": "#/definitions/text"},
    "simulated": {
      "description": "What the operator's hands do in a simulated world when this is answered, or what the instrument reads that is asked for: `read_ruler`, `read_level`, `read_tracker`, `read_board`, `read_board_turn`, `read_profile`, `read_probe`, `drive_to_level`, `hang`, `rest_on_gauge`, `trim_to_fire`, `place_hand`, `shine`.",
      "type": "object",
      "minProperties": 1,
      "maxProperties": 1,
      "additionalProperties": {"type": "object", "additionalProperties": {"$ref": "#/definitions/expression"}}
    },
    "jog_to": {
      "type": "object",
      "additionalProperties": false,
      "required": ["robot"],
      "properties": {
        "robot": {"$ref": "#/definitions/text"},
        "within_deg": {"$ref": "#/definitions/bounds"},
        "within_mm": {"$ref": "#/definitions/bounds"},
        "from": {
          "description": "From which side a joint has to arrive: `below` (its reading increases) or `above`. The row that is written afterwards says so.",
          "type": "object",
          "additionalProperties": {"enum": ["below", "above"]}
        }
      }
    }
  }
}"##;

    fn read(node: &Node, context: &ReadContext<'_>) -> Option<Self> {
        read(node, context)
    }

    fn execute(&self, engine: &mut Engine, at: &StepContext) -> Result<Done, StepError> {
        engine.execute_prompt(self, at)
    }
}

impl Engine {
    fn execute_prompt(&mut self, step: &PromptStep, at: &StepContext) -> Result<Done, StepError> {
        let expressions: Vec<&str> = [Some(&step.text), step.help.as_ref()]
            .into_iter()
            .flatten()
            .flat_map(Template::expressions)
            .collect();
        let values = self.values(at.scope, &expressions)?;
        let mut text = step.text.fill(&self.calculator, &values)?;
        if let Some(drawing) = self.drawing(step)? {
            text = format!("{}\n\n{drawing}", text.trim_end());
        }
        let help = step.help.as_ref().map(|help| help.fill(&self.calculator, &values)).transpose()?;
        let mut kind = self.prompt_kind(&step.question, at)?;
        // Hands need not confirm what the world does for them; it may be asked to drive the arm, and has read its instruments.
        let mut simulated = match &kind {
            PromptKind::Acknowledge { .. } => self.cell.world.is_some(),
            PromptKind::JogTo { .. } => self.cell.world.is_some() && step.simulated.is_some(),
            _ => false,
        };
        if let PromptKind::Number { default, .. } = &mut kind
            && let Some(read) = self.simulate(step.simulated.as_ref(), at)?
        {
            *default = Some(read);
            simulated = true;
        }
        let question = Asked { step: &at.path, title: &at.title, text, help, kind, simulated };
        if matches!(step.question, PromptQuestion::JogTo { .. }) {
            return self.jog_to(&step.question, step.simulated.as_ref(), question, at);
        }
        let answer = self.ask(question, at)?;
        if !matches!(step.question, PromptQuestion::Number { .. }) {
            self.simulate(step.simulated.as_ref(), at)?;
        }
        answered(answer, &step.question)
    }

    /// In a simulated cell, does what the operator does there, and reports what an instrument reads.
    pub(crate) fn simulate(
        &mut self,
        simulated: Option<&SimulatedAct>,
        at: &StepContext,
    ) -> Result<Option<f64>, StepError> {
        let Some(simulated) = simulated else { return Ok(None) };
        let mut numbers = Vec::new();
        for (name, value) in &simulated.numbers {
            numbers.push((name.clone(), self.number(at.scope, value)?));
        }
        let act = Act { name: simulated.act.clone(), numbers, words: simulated.words.clone() };
        let read = self.links.simulate(&act);
        // Who only reads an instrument has moved nothing.
        if !matches!(read, Ok(Some(_))) {
            self.pose_cache.forget();
        }
        read.map_err(StepError::Error)
    }

    /// The robot the prompt is about, as it is now; none without a model of it.
    fn drawing(&mut self, step: &PromptStep) -> Result<Option<String>, StepError> {
        let Some((robot, _)) = &step.draw else { return Ok(None) };
        let here = self.read_pose(robot)?.joints;
        Ok(self.arm(robot)?.outline(&here).map(|points| two_views(&points)))
    }

    pub(crate) fn prompt_kind(
        &mut self,
        question: &PromptQuestion,
        at: &StepContext,
    ) -> Result<PromptKind, StepError> {
        Ok(match question {
            PromptQuestion::Acknowledge { label } => PromptKind::Acknowledge { label: label.clone() },
            PromptQuestion::Choice { options, default } => {
                PromptKind::Choice { options: options.clone(), default: default.clone() }
            }
            PromptQuestion::Number { unit, minimum, maximum, default } => PromptKind::Number {
                unit: unit.clone(),
                minimum: self.optional_number(at, minimum.as_ref())?,
                maximum: self.optional_number(at, maximum.as_ref())?,
                default: self.optional_number(at, default.as_ref())?,
                decimals: None,
            },
            PromptQuestion::Text { longest } => PromptKind::Text { longest: *longest },
            PromptQuestion::Level { most } => PromptKind::Level { most: *most },
            PromptQuestion::Photo => PromptKind::Photo,
            PromptQuestion::JogTo { robot, goals, .. } => {
                let mut bounds = Vec::new();
                for goal in goals {
                    bounds.push(JogGoal {
                        joint: goal.joint.clone(),
                        minimum: self.number(at.scope, &goal.minimum)?,
                        maximum: self.number(at.scope, &goal.maximum)?,
                        unit: goal.unit.symbol().to_owned(),
                    });
                }
                let state = self.read_pose_anywhere(robot)?;
                let joints = self.arm(robot)?.named(&state.joints);
                let arm = self.arm(robot)?;
                let hand_over = Pendant::for_robot(&arm.description.capabilities).is_on_request();
                let device = robot.clone();
                PromptKind::JogTo { device, goals: bounds, joints, hand_over, joint: None, sensor: None }
            }
        })
    }

    fn optional_number(
        &mut self,
        at: &StepContext,
        expression: Option<&Expression>,
    ) -> Result<Option<f64>, StepError> {
        expression.map(|expression| self.number(at.scope, expression)).transpose()
    }
}

/// The result of a prompt that was answered.
fn answered(answer: Answer, question: &PromptQuestion) -> Result<Done, StepError> {
    Ok(match answer {
        Answer::Choice { key } => {
            Done { result: json!({"choice": key}), message: format!("chosen: {key}"), ..Done::default() }
        }
        Answer::Number { value } => answered_number(value, question),
        Answer::Level { x, y } => answered_level(x, y),
        Answer::Photo { file } => {
            let photo = photo::examine(&file).map_err(StepError::Error)?;
            Done {
                message: format!("photo: {} ({} bytes)", photo.file, photo.bytes),
                result: json!(photo),
                ..Done::default()
            }
        }
        Answer::Text { text } => {
            let message = format!("written: {text}");
            Done { result: json!({"text": text}), message, ..Done::default() }
        }
        _ => Done { result: json!({}), message: "done".to_owned(), ..Done::default() },
    })
}

fn answered_number(value: f64, question: &PromptQuestion) -> Done {
    let unit = match question {
        PromptQuestion::Number { unit, .. } => unit.clone(),
        _ => String::new(),
    };
    let message = format!("answered: {value} {unit}").trim_end().to_owned();
    let shown = NamedValue { name: "value".to_owned(), value, unit, uncertainty: None };
    Done { result: json!({"value": value}), values: vec![shown], message }
}

/// A level read along two axes, deg. The tilt is that of the plane which has these two slopes.
fn answered_level(x: f64, y: f64) -> Done {
    let tilt = x.to_radians().tan().hypot(y.to_radians().tan()).atan().to_degrees();
    let named = [("x", x), ("y", y), ("tilt", tilt)].map(|(name, value)| NamedValue {
        name: name.to_owned(),
        value,
        unit: "deg".to_owned(),
        uncertainty: None,
    });
    Done {
        result: json!({"x_deg": x, "y_deg": y, "tilt_deg": tilt}),
        message: format!("read: x {x} deg, y {y} deg, tilted {tilt:.2} deg"),
        values: named.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tilt_of_a_level_is_that_of_the_plane_with_both_slopes() {
        let tilt = |x, y| answered_level(x, y).values[2].value;
        assert!((tilt(3.0, 0.0) - 3.0).abs() < 1e-12);
        assert!((tilt(0.0, -4.0) - 4.0).abs() < 1e-12);
        // tan(45 deg) along both axes: the slope is sqrt(2).
        assert!((tilt(45.0, 45.0) - 2.0_f64.sqrt().atan().to_degrees()).abs() < 1e-12);
        assert_eq!(answered_level(3.0, 0.0).message, "read: x 3 deg, y 0 deg, tilted 3.00 deg");
    }

    #[test]
    fn a_number_is_answered_in_the_unit_that_was_asked_for() {
        let question =
            PromptQuestion::Number { unit: "mm".into(), minimum: None, maximum: None, default: None };
        let done = answered_number(2.5, &question);
        assert_eq!((done.message.as_str(), done.values[0].unit.as_str()), ("answered: 2.5 mm", "mm"));
        let bare =
            PromptQuestion::Number { unit: String::new(), minimum: None, maximum: None, default: None };
        assert_eq!(answered_number(2.0, &bare).message, "answered: 2");
    }
}
