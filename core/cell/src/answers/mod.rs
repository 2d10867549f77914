//! Answers for unattended runs: what the operator would say, written down before.
//!
//! ```yaml
//! answers:
//!   ready: done                                   # an acknowledgement
//!   paper: light                                  # a choice, by its key
//!   gauge: 8.02                                   # a number, in the prompt's unit
//!   paper_maker: Clairefontaine, 80 g              # a line of text
//!   level: offered                                # the number the prompt offers, as a simulated instrument reads it
//!   start: {pose_deg: {shoulder: 45, elbow: -70}} # a jog: where the arm is to be brought
//!   reading: [8.1, 8.0, 8.2]                      # asked in every turn of a repetition: one answer each
//!   waist.ready: done                             # a prompt of a procedure called by the step `waist`
//! on_error: {lower: retry}                        # for steps that would ask what to do
//! confirm_pose: true                              # the arm may be taken to be where a resumed run left it
//! ```

mod check;
mod load;

use std::path::PathBuf;

pub use check::missing_answers;
pub use load::load_answers;

use crate::event::NamedValue;
use crate::prompt::{Answer, Decision, PromptKind};
use plumb_document::Span;

/// Answers out of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct Answers {
    /// The file.
    pub file: PathBuf,
    /// The file's text.
    pub text: String,
    /// Who is said to have answered.
    pub by: String,
    /// By step.
    pub entries: Vec<AnswerEntry>,
    /// What to do about steps that fail and would ask.
    pub on_error: Vec<(String, Decision, Span)>,
    /// The arm may be taken to be where a resumed run left it.
    pub confirm_pose: bool,
}

/// The answers to one step's prompts.
#[derive(Debug, Clone, PartialEq)]
pub struct AnswerEntry {
    /// The step; inside a called procedure with the call's id before it, turns of repetitions left out.
    pub step: String,
    /// Where it is.
    pub span: Span,
    /// One answer for all, or one for each time it is asked.
    pub given: Given,
    /// Where each of these answers is.
    pub spans: Vec<AnswerSpans>,
}

/// Where an answer is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AnswerSpans {
    /// The whole of it.
    pub whole: Span,
    /// The names of the joints of a pose, in their order.
    pub joints: Vec<Span>,
}

/// One answer or several.
#[derive(Debug, Clone, PartialEq)]
pub enum Given {
    /// The same whenever asked.
    Always(WrittenAnswer),
    /// In order.
    InTurn(Vec<WrittenAnswer>),
}

/// An answer as it is written.
#[derive(Debug, Clone, PartialEq)]
pub enum WrittenAnswer {
    /// A word: `done`, or the key of a choice.
    Word(String),
    /// A number.
    Number(f64),
    /// Joints and where they are to go.
    Pose(Vec<NamedValue>),
}

impl Answers {
    /// The answer to the prompt of `step` when it is asked for the `times`-th time (from 0), if there is one.
    pub fn find(&self, step: &str, times: usize) -> Option<&WrittenAnswer> {
        match &self.entries.iter().find(|entry| entry.step == step)?.given {
            Given::Always(answer) => Some(answer),
            Given::InTurn(answers) => answers.get(times),
        }
    }

    /// What to do about a step that failed, if it says.
    pub fn decision(&self, step: &str) -> Option<Decision> {
        self.on_error.iter().find(|(name, ..)| name == step).map(|(_, decision, _)| *decision)
    }
}

impl WrittenAnswer {
    /// As an answer to a prompt of this kind.
    ///
    /// # Errors
    /// A sentence that says what kind of answer the prompt takes.
    pub fn for_prompt(&self, kind: &PromptKind) -> Result<Answer, String> {
        match (kind, self) {
            (PromptKind::Acknowledge { .. } | PromptKind::JogTo { .. }, Self::Word(word))
                if word == "done" =>
            {
                Ok(Answer::Done)
            }
            (PromptKind::Choice { .. }, Self::Word(key)) => Ok(Answer::Choice { key: key.clone() }),
            (PromptKind::Number { .. }, Self::Number(value)) => Ok(Answer::Number { value: *value }),
            (PromptKind::Number { default, .. }, Self::Word(word)) if word == "offered" => match default {
                Some(value) => Ok(Answer::Number { value: *value }),
                None => Err("no number is offered here: write one".to_owned()),
            },
            (PromptKind::Text { .. }, Self::Word(text)) => Ok(Answer::Text { text: text.clone() }),
            // A serial number is a number to YAML.
            (PromptKind::Text { .. }, Self::Number(value)) => Ok(Answer::Text { text: value.to_string() }),
            (PromptKind::Photo, Self::Word(file)) => Ok(Answer::Photo { file: file.clone() }),
            (PromptKind::Level { .. }, Self::Word(readings)) => {
                level_readings(readings).map(|(x, y)| Answer::Level { x, y })
            }
            (PromptKind::JogTo { .. }, Self::Pose(joints)) => Ok(Answer::Pose { joints: joints.clone() }),
            (kind, _) => Err(format!("this prompt is answered by {}", requested(kind))),
        }
    }
}

/// What answers a level.
const TWO_READINGS: &str = "two readings in degrees, along x and along y, as in `0.2 -0.1`";

/// The two readings of a level as people write them: `0.2 -0.1`, with a blank between them; a decimal comma is understood.
///
/// # Errors
/// A sentence that says what would be right.
pub fn level_readings(text: &str) -> Result<(f64, f64), String> {
    let number = |word: &str| word.replace(',', ".").parse::<f64>().ok().filter(|value| value.is_finite());
    let words: Vec<Option<f64>> =
        text.split([' ', ';', '/']).filter(|word| !word.is_empty()).map(number).collect();
    match words.as_slice() {
        [Some(x), Some(y)] => Ok((*x, *y)),
        _ => Err(format!("write {TWO_READINGS}")),
    }
}

fn requested(kind: &PromptKind) -> String {
    match kind {
        PromptKind::Acknowledge { .. } => "`done`".to_owned(),
        PromptKind::Choice { options, .. } => {
            let keys: Vec<String> = options.iter().map(|option| format!("`{}`", option.key)).collect();
            format!("one of {}", keys.join(", "))
        }
        PromptKind::Number { .. } => "a number, or `offered` for the one that is offered".to_owned(),
        PromptKind::Text { .. } => "a line of text".to_owned(),
        PromptKind::Level { .. } => TWO_READINGS.to_owned(),
        PromptKind::Photo => "the path of a PNG or JPEG file".to_owned(),
        PromptKind::JogTo { .. } => "a pose, as in `{pose_deg: {shoulder: 45}}`, or `done`".to_owned(),
        PromptKind::ConfirmPose { .. } => "a person who looks at the arm".to_owned(),
        PromptKind::Decision { .. } => "`retry`, `skip` or `abort`".to_owned(),
    }
}
