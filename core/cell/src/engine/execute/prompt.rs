//! `prompt`

use serde_json::json;

use super::pendant::Pendant;
use crate::device::Act;
use crate::drawing::two_views;
use crate::engine::Engine;
use crate::engine::journal::Question as Asked;
use crate::engine::step_context::{Done, StepContext};
use crate::engine::step_error::StepError;
use crate::event::NamedValue;
use crate::expression::{Expression, Template};
use crate::photo;
use crate::prompt::{Answer, JogGoal, PromptKind};
use crate::step::{PromptStep, Question};

impl Engine {
    pub(super) fn execute_prompt(&mut self, step: &PromptStep, at: &StepContext) -> Result<Done, StepError> {
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
        if let PromptKind::Number { default, .. } = &mut kind
            && let Some(read) = self.simulate(step, at)?
        {
            *default = Some(read);
        }
        let question = Asked { step: &at.path, title: &at.title, text, help, kind };
        if let Question::JogTo { robot, .. } = &step.question {
            return self.jog_to(robot, step, question, at);
        }
        let answer = self.ask(question, at)?;
        if !matches!(step.question, Question::Number { .. }) {
            self.simulate(step, at)?;
        }
        Ok(match answer {
            Answer::Choice { key } => {
                Done { result: json!({"choice": key}), message: format!("chosen: {key}"), ..Done::default() }
            }
            Answer::Number { value } => {
                let unit = match &step.question {
                    Question::Number { unit, .. } => unit.clone(),
                    _ => String::new(),
                };
                let message = format!("answered: {value} {unit}").trim_end().to_owned();
                let shown = NamedValue { name: "value".to_owned(), value, unit, uncertainty: None };
                Done { result: json!({"value": value}), values: vec![shown], message }
            }
            Answer::Level { x, y } => {
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
            Answer::Photo { file } => {
                let photo = photo::examine(&file).map_err(StepError::Error)?;
                Done {
                    message: format!("photo: {} ({} bytes)", photo.file, photo.bytes),
                    result: serde_json::to_value(&photo).unwrap_or_default(),
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

    /// In a simulated cell, does what the operator does there, and tells what an instrument reads.
    pub(super) fn simulate(&mut self, step: &PromptStep, at: &StepContext) -> Result<Option<f64>, StepError> {
        let Some(simulated) = &step.simulated else { return Ok(None) };
        let mut numbers = Vec::new();
        for (name, value) in &simulated.numbers {
            numbers.push((name.clone(), self.number(at.scope, value)?));
        }
        let act = Act { name: simulated.act.clone(), numbers, words: simulated.words.clone() };
        let read = self.links.simulate(&act);
        // Who only reads an instrument has moved nothing.
        if !matches!(read, Ok(Some(_))) {
            self.standing.forget();
        }
        read.map_err(StepError::Error)
    }

    /// The robot the prompt is about, as it stands now; none without a model of it.
    fn drawing(&mut self, step: &PromptStep) -> Result<Option<String>, StepError> {
        let Some((robot, _)) = &step.draw else { return Ok(None) };
        let here = self.read_pose(robot)?.joints;
        Ok(self.arm(robot)?.outline(&here).map(|points| two_views(&points)))
    }

    pub(super) fn prompt_kind(
        &mut self,
        question: &Question,
        at: &StepContext,
    ) -> Result<PromptKind, StepError> {
        Ok(match question {
            Question::Acknowledge { label } => PromptKind::Acknowledge { label: label.clone() },
            Question::Choice { options, default } => {
                PromptKind::Choice { options: options.clone(), default: default.clone() }
            }
            Question::Number { unit, minimum, maximum, default } => PromptKind::Number {
                unit: unit.clone(),
                minimum: self.optional_number(at, minimum.as_ref())?,
                maximum: self.optional_number(at, maximum.as_ref())?,
                default: self.optional_number(at, default.as_ref())?,
                decimals: None,
            },
            Question::Text { longest } => PromptKind::Text { longest: *longest },
            Question::Level { most } => PromptKind::Level { most: *most },
            Question::Photo => PromptKind::Photo,
            Question::JogTo { robot, goals, .. } => {
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
                let hand_over = Pendant::of(&arm.description.capabilities).is_on_request();
                PromptKind::JogTo { device: robot.clone(), goals: bounds, joints, hand_over }
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
