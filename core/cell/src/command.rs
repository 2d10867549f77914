//! What a person (or a program) sends a running engine.

use serde::{Deserialize, Serialize};

use crate::prompt::{Answer, PromptId};

/// A wish; the events report what became of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "command", rename_all = "snake_case")]
pub enum Command {
    /// Answers a prompt. The first valid answer wins; an answer to a prompt no longer open is ignored.
    Answer {
        /// Which prompt.
        prompt: PromptId,
        /// The answer.
        answer: Answer,
        /// Who gives it; kept in the record.
        by: String,
    },
    /// Moves one joint a little while a `jog_to` prompt is open. Bounded by limits and keep-out planes like every move.
    Jog {
        /// The open prompt.
        prompt: PromptId,
        /// The joint.
        joint: String,
        /// How far, relative, in degrees (mm for a linear joint).
        by: f64,
    },
    /// Hands the arm of an open `jog_to` prompt to its pendant, where nothing but the pendant can end that.
    HandOver {
        /// The open prompt.
        prompt: PromptId,
    },
    /// Waits. What moved is stopped where `when` says now; the step in hand begins again on resume.
    Pause {
        /// At once or before the next step.
        when: PauseWhen,
    },
    /// Goes on after a pause or stop. Nothing else sets an arm in motion again.
    Resume,
    /// Ends the run as aborted; devices are shut down in good order, corrections not yet applied are dropped.
    Abort,
    /// Stops all motion at once and pauses. Sent through [`crate::RunHandle`] it reaches the robots without waiting for the engine.
    Stop,
    /// Ends the run early in good order, as passed with what it has (Bluesky's `stop`).
    Finish,
    /// Leaves the run as it is, to be resumed later: everything is brought to rest and the devices are put away.
    Keep,
    /// Ends the run because a signal asks the program to end, or because what it reports can no longer be written: as [`Self::Abort`] does, or with
    /// `keep` as [`Self::Keep`] does. Nobody's wish, and recorded as what it is.
    EndFromOutside {
        /// The signal and who sent it, as `SIGTERM from process 4711 (htop)`, or what happened.
        by: String,
        /// Whether the run is left to be resumed.
        keep: bool,
    },
}

/// When a pause takes effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PauseWhen {
    /// Motion is stopped; the step in hand is interrupted.
    Now,
    /// The step in hand is finished first.
    BeforeNextStep,
}
