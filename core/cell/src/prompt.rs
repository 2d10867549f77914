//! Questions the engine asks and the answers it takes.

use serde::{Deserialize, Serialize};

use crate::named_value::NamedValue;
use crate::step_path::StepPath;

/// Unique within the record: an answer to another prompt, or to one asked before a restart, is never mistaken for this one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct PromptId(pub i64);

/// A question with all a screen needs to show it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Prompt {
    /// Names this prompt in the answer.
    pub id: PromptId,
    /// The step that asks.
    pub step: StepPath,
    /// One line.
    pub title: String,
    /// The question or instruction; may hold several lines.
    pub text: String,
    /// More, for who wants to know.
    pub help: Option<String>,
    /// What is asked for.
    pub kind: PromptKind,
    /// The world of a simulated cell does or reads what is asked, so that nobody's hands or eyes are needed.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub simulated: bool,
}

/// What a prompt asks for.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum PromptKind {
    /// To be done and confirmed.
    Acknowledge {
        /// What the operator confirms: "Done".
        label: String,
    },
    /// One of several.
    Choice {
        /// In the order to show them.
        options: Vec<ChoiceOption>,
        /// Key of the option to offer first.
        default: Option<String>,
    },
    /// A number.
    Number {
        /// Unit of the number and its bounds; empty for a bare number.
        unit: String,
        /// Smallest allowed.
        minimum: Option<f64>,
        /// Greatest allowed.
        maximum: Option<f64>,
        /// Offered first.
        default: Option<f64>,
        /// Digits after the point to show.
        decimals: Option<u32>,
    },
    /// A line of text: a serial number, what the paper is.
    Text {
        /// The most characters it may have.
        longest: usize,
    },
    /// A spirit level read along two axes.
    Level {
        /// Furthest it can show to either side, deg.
        most: f64,
    },
    /// A picture that was taken: its file.
    Photo,
    /// Bring the arm somewhere by hand (pendant, or jog commands), then confirm.
    JogTo {
        /// The robot.
        device: String,
        /// Bounds the pose has to be within before it is accepted; joints not named are free.
        goals: Vec<JogGoal>,
        /// Joints a jog command may name, with where they are now.
        joints: Vec<NamedValue>,
        /// Whether [`Command::HandOver`](crate::command::Command::HandOver) hands the arm to its pendant, which alone stops it and gives it
        /// back then.
        #[serde(default)]
        hand_over: bool,
        /// The joint to offer first, where `goals` name none.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        joint: Option<String>,
        /// A sensor that is read while the arm is moved: its [`Event::Signal`](crate::event::Event::Signal) says whether it has fired.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        sensor: Option<String>,
    },
    /// A run goes on after an interruption: is the arm where it was left?
    ConfirmPose {
        /// The robot.
        device: String,
        /// Last pose in the record.
        recorded: Vec<NamedValue>,
        /// Pose the robot reports now.
        reported: Vec<NamedValue>,
    },
    /// A step went wrong: what now?
    Decision {
        /// What went wrong and what would be right.
        error: String,
        /// What may be decided, in the order to show them.
        options: Vec<Decision>,
        /// What each of them does in this case, for people; in the same order.
        #[serde(default)]
        labels: Vec<String>,
    },
}

impl PromptKind {
    /// The same question as `before` with what has changed since: a jog keeps what it offers first and the sensor it shows.
    pub(crate) fn with_offers_of(mut self, before: &Self) -> Self {
        if let (Self::JogTo { joint, sensor, .. }, Self::JogTo { joint: first, sensor: shown, .. }) =
            (&mut self, before)
        {
            joint.clone_from(first);
            sensor.clone_from(shown);
        }
        self
    }
}

/// One option of a choice.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ChoiceOption {
    /// What the answer names: `light`.
    pub key: String,
    /// What people read.
    pub label: String,
}

/// Bounds on one joint of a jog.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct JogGoal {
    /// The joint.
    pub joint: String,
    /// Smallest allowed, in `unit`.
    pub minimum: f64,
    /// Greatest allowed, in `unit`.
    pub maximum: f64,
    /// Unit of both.
    pub unit: String,
}

/// What to do about a step that went wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Decision {
    /// Begin the step again (a lost device is started again first); a check again with what it judges, so that an answer can be given anew.
    Retry,
    /// Move the arm by hand, in a jog prompt, then do as for `Retry`, from where the arm is then.
    Move,
    /// Go back to the step before that placed the arm, or asked something, and go on from there.
    Back,
    /// Go on without it.
    Skip,
    /// End the run.
    Abort,
}

impl Decision {
    /// As files and people write it.
    pub fn name(self) -> &'static str {
        match self {
            Decision::Retry => "retry",
            Decision::Move => "move",
            Decision::Back => "back",
            Decision::Skip => "skip",
            Decision::Abort => "abort",
        }
    }
}

/// An answer to a prompt; its kind has to fit the prompt's.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Answer {
    /// To an acknowledgement, and to a jog: the arm is where it should be.
    Done,
    /// To a choice.
    Choice {
        /// Key of the option.
        key: String,
    },
    /// To a number, in the prompt's unit.
    Number {
        /// The number.
        value: f64,
    },
    /// To a text.
    Text {
        /// The line, without blanks around it.
        text: String,
    },
    /// To a level: how much higher the end is to which each of its axes points, deg.
    Level {
        /// Along the level's x.
        x: f64,
        /// Along its y.
        y: f64,
    },
    /// To a photo.
    Photo {
        /// The file, as the operator names it.
        file: String,
    },
    /// To a jog, where no hand is there to jog: the arm is moved to these joints, the others stay.
    Pose {
        /// Joints by name, each with its unit.
        joints: Vec<NamedValue>,
    },
    /// To a pose confirmation: the arm is there, go on.
    Confirmed,
    /// To a decision.
    Decision {
        /// What to do.
        decision: Decision,
    },
    /// To a prompt that is `simulated`: the world of the cell does or reads what is asked, here and in every later prompt of the run that asks for such a thing. The
    /// record keeps what it did or read, as by [`SIMULATED_OPERATOR`].
    Simulated,
}

/// Who is said to have answered what was left to the simulated world; for whom follows.
pub const SIMULATED_OPERATOR: &str = "simulated operator";
