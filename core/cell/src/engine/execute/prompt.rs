//! `prompt`

use plumb_plugin::JointVector;
use serde_json::{Value, json};

use super::pendant::Pendant;
use crate::device::Act;
use crate::drawing::two_views;
use crate::engine::Engine;
use crate::engine::journal::Question as Asked;
use crate::engine::prompting::Heard;
use crate::engine::scope::joints_value;
use crate::engine::step_context::{Done, StepContext};
use crate::engine::step_error::StepError;
use crate::event::NamedValue;
use crate::expression::{Expression, Template};
use crate::photo;
use crate::prompt::{Answer, JogGoal, Prompt, PromptKind};
use crate::step::{Arrival, PromptStep, Question};

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
    fn simulate(&mut self, step: &PromptStep, at: &StepContext) -> Result<Option<f64>, StepError> {
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

    fn prompt_kind(&mut self, question: &Question, at: &StepContext) -> Result<PromptKind, StepError> {
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
                let state = self.read_pose(robot)?;
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

    /// The operator brings the arm somewhere: with its pendant, or joint by joint from here.
    fn jog_to(
        &mut self,
        robot: &str,
        step: &PromptStep,
        question: Asked<'_>,
        at: &StepContext,
    ) -> Result<Done, StepError> {
        let before = self.read_pose(robot)?.joints;
        self.arm(robot)?.begin_manual(&before);
        let goals = match &question.kind {
            PromptKind::JogTo { goals, .. } => goals.clone(),
            _ => Vec::new(),
        };
        let arrivals = match &step.question {
            Question::JogTo { arrivals, .. } => arrivals.as_slice(),
            _ => &[],
        };
        let prompt = self.journal.ask(question)?;
        if self.unattended {
            let (answer, by) = self.answer_from_file(&prompt, at)?;
            self.simulate_unless_moved(robot, step, &before, &answer, at)?;
            let here = self.bring_to(robot, &answer, at)?;
            self.goals_met(robot, &here, &goals).map_err(StepError::Error)?;
            self.end_manual(robot, &here, arrivals).map_err(StepError::Error)?;
            self.journal.answered(&prompt, &answer, &by)?;
            return self.jog_done(robot, &here);
        }
        let mut pendant = Pendant::of(&self.arm(robot)?.description.capabilities);
        loop {
            match self.hear(&prompt, at) {
                Ok(Heard::Answer(answer, by)) => {
                    let taken_back = self.take_back(robot, &mut pendant);
                    let simulated = taken_back
                        .and_then(|()| self.simulate_unless_moved(robot, step, &before, &answer, at));
                    let here = match simulated.and_then(|()| self.bring_to(robot, &answer, at)) {
                        Ok(here) => here,
                        Err(StepError::Error(reason)) => {
                            self.refuse(&prompt, &reason);
                            continue;
                        }
                        Err(other) => return Err(other),
                    };
                    let met = self.goals_met(robot, &here, &goals);
                    match met.and_then(|()| self.end_manual(robot, &here, arrivals)) {
                        Ok(()) => {
                            self.journal.answered(&prompt, &answer, &by)?;
                            return self.jog_done(robot, &here);
                        }
                        Err(reason) => self.refuse(&prompt, &reason),
                    }
                }
                Ok(Heard::Jog { joint, by }) => match self.take_back(robot, &mut pendant) {
                    Ok(()) => self.jog_joint(robot, &joint, by, &prompt, at)?,
                    Err(StepError::Error(reason)) => self.refuse(&prompt, &reason),
                    Err(other) => return Err(other),
                },
                Ok(Heard::HandOver) => self.hand_over(robot, &mut pendant, &prompt)?,
                Ok(Heard::Silence) => self.look_on(robot, &mut pendant, &prompt)?,
                Err(error) => {
                    // What ends the prompt counts, not whether the pendant gives the robot back.
                    let _ = self.take_back(robot, &mut pendant);
                    return Err(error);
                }
            }
        }
    }

    /// Whoever says it is done without having moved the arm leaves the driving to the simulated operator, who has the pendant in the hand
    /// where there is one to be had.
    fn simulate_unless_moved(
        &mut self,
        robot: &str,
        step: &PromptStep,
        before: &JointVector,
        answer: &Answer,
        at: &StepContext,
    ) -> Result<(), StepError> {
        if step.simulated.is_none() || *answer != Answer::Done || self.read_pose(robot)?.joints != *before {
            return Ok(());
        }
        let mut pendant = Pendant::of(&self.arm(robot)?.description.capabilities);
        if matches!(pendant, Pendant::Shared) {
            self.jog(robot, true)?;
        }
        let done = self.simulate(step, at);
        self.take_back(robot, &mut pendant)?;
        done.map(drop)
    }

    fn jog_joint(
        &mut self,
        robot: &str,
        joint: &str,
        by: f64,
        prompt: &Prompt,
        at: &StepContext,
    ) -> Result<(), StepError> {
        let here = self.read_pose(robot)?.joints;
        let arm = self.arm(robot)?;
        let Some(column) = arm.column(joint) else {
            let help = crate::yaml::did_you_mean(
                joint,
                arm.description.joints.iter().map(|joint| joint.name.as_str()),
            );
            self.refuse(prompt, &format!("{robot} has no joint {joint}: {help}"));
            return Ok(());
        };
        let mut target = here;
        target.set(column, here.get(column).unwrap_or(0.0) + arm.unit(column).to_internal(by));
        match arm.check_move(&here, &target) {
            Ok(()) => self.move_arm(robot, &here, &target, 0.5, at).map(|_| ()),
            Err(reason) => {
                self.refuse(prompt, &reason.to_string());
                Ok(())
            }
        }
    }

    /// For an answer that names a pose, the arm goes there; else it is where it is.
    fn bring_to(&mut self, robot: &str, answer: &Answer, at: &StepContext) -> Result<JointVector, StepError> {
        let here = self.read_pose(robot)?.joints;
        self.moved.insert(robot.to_owned(), here);
        let Answer::Pose { joints } = answer else { return Ok(here) };
        let arm = self.arm(robot)?;
        let mut target = here;
        for joint in joints {
            if let Some(column) = arm.column(&joint.name) {
                target.set(column, arm.unit(column).to_internal(joint.value) - arm.zero(column));
            }
        }
        arm.check_move(&here, &target).map_err(|reason| StepError::error(reason.to_string()))?;
        self.move_arm(robot, &here, &target, 0.5, at)
    }

    fn goals_met(&mut self, robot: &str, here: &JointVector, goals: &[JogGoal]) -> Result<(), String> {
        let joints = self.arm(robot).map(|arm| arm.named(here)).unwrap_or_default();
        for goal in goals {
            let stands =
                joints.iter().find(|joint| joint.name == goal.joint).map_or(f64::NAN, |joint| joint.value);
            if !(goal.minimum..=goal.maximum).contains(&stands) {
                return Err(format!(
                    "{} stands at {stands:.2} {unit}; it has to be between {:.2} and {:.2} {unit}",
                    goal.joint,
                    goal.minimum,
                    goal.maximum,
                    unit = goal.unit
                ));
            }
        }
        Ok(())
    }

    /// The operator is done: from now on only this program moves the robot, and it is known from which side the joints of `arrivals` have come.
    fn end_manual(&mut self, robot: &str, here: &JointVector, arrivals: &[Arrival]) -> Result<(), String> {
        let Ok(arm) = self.arm(robot) else { return Ok(()) };
        let columns: Vec<(usize, i8)> = arrivals
            .iter()
            .filter_map(|arrival| Some((arm.column(&arrival.joint)?, arrival.from.side())))
            .collect();
        arm.end_manual(here, &columns).map_err(|column| {
            let joint = arm.joint_name(column).to_owned();
            let arrival = arrivals.iter().find(|arrival| arrival.joint == joint);
            let from = arrival.map_or("the side asked for", |arrival| arrival.from.in_words());
            format!(
                "{joint} has not come from {from}, as it has to (play would falsify the reading): drive it back some degrees, and come again from there"
            )
        })
    }

    fn jog_done(&mut self, robot: &str, here: &JointVector) -> Result<Done, StepError> {
        let joints = self.arm(robot)?.named(here);
        let places = joints.iter().map(|joint| format!("{} {:.2} {}", joint.name, joint.value, joint.unit));
        let message = format!("stands at {}", places.collect::<Vec<_>>().join(", "));
        let result: Value = json!({"joints": joints_value(&joints)});
        Ok(Done { result, values: joints, message })
    }
}
