//! What the engine reports to anyone who watches a run: a terminal, a file of JSON lines, a test.
//!
//! Every event was committed to the record before it is sent, so what a watcher has seen is never lost by a crash.
//! Values at this edge are in degrees and millimetres, each with its unit beside it; inside they are mm and rad.

use plumb_record::Budget;
use serde::{Deserialize, Serialize};

use crate::prompt::{Answer, Prompt, PromptId};

pub use crate::named_value::{NamedValue, PlaneClearance};
pub use crate::step_path::StepPath;

/// An event with its position in the run's sequence. As JSON it is one flat object: `{"sequence": 3, "time": "...", "event": "step_started", ...}`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StampedEvent {
    /// Counts from 1 within one sitting (one start or resume of a run), without gaps.
    pub sequence: u64,
    /// Wall clock, RFC 3339 with milliseconds, UTC.
    pub time: String,
    /// What happened.
    #[serde(flatten)]
    pub event: Event,
}

/// Everything a watcher can learn about a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "event", rename_all = "snake_case")]
pub enum Event {
    /// The run has its place in the record. First event of a sitting.
    RunStarted {
        /// Number of the run in the record.
        run: i64,
        /// Name of the cell.
        cell: String,
        /// Name of the procedure.
        procedure: String,
        /// Title of the procedure, for people.
        title: String,
        /// Answers come from a file: nobody can be asked.
        unattended: bool,
        /// Set when an interrupted run goes on: the step it goes on with.
        resumed_at: Option<StepPath>,
    },
    /// All steps in the order they will run, known before anything moves.
    Planned {
        /// The expanded plan; repetitions are unrolled to their greatest count.
        steps: Vec<PlannedStep>,
        /// Estimated time of the whole run, prompts left out, seconds.
        estimate_s: f64,
    },
    /// A step begins.
    StepStarted {
        /// Which.
        step: StepPath,
        /// 1 at first, more after a retry.
        attempt: u32,
    },
    /// A step reports how far it is; at most a few times a second.
    StepProgress {
        /// Which.
        step: StepPath,
        /// Between 0 and 1, where it can be known.
        fraction: Option<f64>,
        /// What it does now, for people.
        text: String,
    },
    /// A scan has taken a stripe.
    StripeTaken {
        /// Which scan.
        step: StepPath,
        /// The light stripe sensor.
        device: String,
        /// Which of its stripes, counted from 0.
        stripe: u32,
        /// Where its points lie, mm in the robot's base frame.
        points: Vec<[f32; 3]>,
    },
    /// A step is over.
    StepFinished {
        /// Which.
        step: StepPath,
        /// How it ended.
        outcome: StepOutcome,
        /// One plain sentence: what was found, or what went wrong and what would be right.
        message: String,
        /// What it found, in the order it was found.
        values: Vec<NamedValue>,
        /// How long it took by the wall clock, seconds.
        seconds: f64,
    },
    /// The run waits for a person (or the answers file) to answer.
    PromptAsked {
        /// The question, complete enough to be shown without knowing the procedure.
        prompt: Prompt,
    },
    /// The first valid answer to a prompt; later ones are ignored.
    PromptAnswered {
        /// Which prompt.
        prompt: PromptId,
        /// Of which step.
        step: StepPath,
        /// The answer taken.
        answer: Answer,
        /// Who gave it: a person's name, or the answers file.
        by: String,
    },
    /// An answer was not taken; the prompt is still open.
    AnswerRefused {
        /// Which prompt.
        prompt: PromptId,
        /// What would be right.
        reason: String,
    },
    /// A prompt needs no answer any more (the run was stopped, or its time was up).
    PromptWithdrawn {
        /// Which prompt.
        prompt: PromptId,
    },
    /// A device changed state.
    Device {
        /// Name in the cell file.
        device: String,
        /// Plugin that serves it.
        plugin: String,
        /// Its state now.
        state: DeviceState,
        /// Why, where there is something to say.
        message: Option<String>,
    },
    /// Where a robot's joints are; while it moves, at most 20 times a second.
    Joints {
        /// Name in the cell file.
        device: String,
        /// Clock of the cell at the moment of measurement, nanoseconds.
        time_ns: u64,
        /// The arm is moving.
        moving: bool,
        /// Angles as corrected by the zeros in force.
        joints: Vec<NamedValue>,
    },
    /// How far a robot is clear of its keep-out planes; follows each [`Event::Joints`] of a robot that has some.
    Clearance {
        /// Name in the cell file.
        device: String,
        /// For each plane how far the nearest end of a link is on its free side, by the zeros now believed.
        planes: Vec<PlaneClearance>,
    },
    /// What the instrument shows that is on the arm (a spirit level, deg) or beside it (a ruler: height over the table, mm), while the arm of a
    /// simulated cell is jogged: where the world is real, the operator looks.
    InstrumentRead {
        /// The step that asks for the arm to be jogged.
        step: StepPath,
        /// What it shows; none where it is beyond its range.
        value: Option<f64>,
        /// Unit of the value.
        unit: String,
    },
    /// A robot's zeros no longer hold: its drive reads elsewhere than the record left it. Until a run has found them again its joints are somewhere
    /// else than its numbers say, and its keep-out planes are not watched.
    ZerosLost {
        /// Name in the cell file.
        device: String,
        /// The joints that have lost their zeros.
        joints: Vec<String>,
        /// What was noticed, and what to do.
        reason: String,
    },
    /// A digital line or sensor changed.
    Signal {
        /// Name in the cell file.
        device: String,
        /// Which line, as the device calls it.
        signal: String,
        /// Level now.
        on: bool,
        /// Clock of the cell at the moment of the change, nanoseconds.
        time_ns: u64,
    },
    /// A search found what it looked for, and the arm is there again.
    TriggerFound {
        /// Which search.
        step: StepPath,
        /// The robot.
        device: String,
        /// The pose at the moment of the edge, as corrected by the zeros in force.
        joints: Vec<NamedValue>,
        /// The joint that was searched along is known to within this, either way.
        half_width: NamedValue,
    },
    /// A procedure has found a better value for something about the machine; not yet in force.
    CorrectionProposed {
        /// The change.
        correction: Correction,
    },
    /// A correction is in force from now on.
    CorrectionApplied {
        /// The change.
        correction: Correction,
        /// Number of the revision it made for this device; rolling back makes a new one.
        revision: i64,
    },
    /// A correction is no longer in force: the operator went back past the step that had applied it.
    CorrectionUndone {
        /// The change back: `old` was in force until now, `new` is again.
        correction: Correction,
        /// Number of the revision that this made for the device.
        revision: i64,
    },
    /// The operator goes back to an earlier step: it and all that came after it are to be done again.
    WentBack {
        /// The step that failed.
        from: StepPath,
        /// The step that comes next.
        to: StepPath,
    },
    /// The run waits; nothing moves until an explicit resume.
    Paused {
        /// The step that waits to be begun (again).
        step: Option<StepPath>,
        /// Who or what paused it.
        reason: String,
    },
    /// The run goes on.
    Resumed,
    /// Every robot was commanded to stop.
    Stopped {
        /// Who or what stopped it.
        reason: String,
    },
    /// Something worth a line in the log.
    Log {
        /// How severe.
        level: LogLevel,
        /// The device or part that says it.
        source: String,
        /// The step it served, if any.
        step: Option<StepPath>,
        /// The line.
        message: String,
    },
    /// The last event of a sitting.
    RunEnded {
        /// Number of the run in the record.
        run: i64,
        /// How it ended.
        outcome: RunOutcome,
        /// One plain sentence.
        message: String,
    },
}

/// One row of the plan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PlannedStep {
    /// Its path; the same in every later event.
    pub step: StepPath,
    /// For people.
    pub title: String,
    /// What kind of step: `prompt`, `move`, `search`, ...
    pub kind: String,
    /// How many repetitions and calls it is inside of; 0 at the top.
    pub depth: u32,
    /// Robots it may move.
    pub moves: Vec<String>,
    /// It asks a person (or the answers file).
    pub asks: bool,
    /// Estimated time, seconds; none where a person sets the pace.
    pub estimate_s: Option<f64>,
}

/// A new value for something about the machine.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Correction {
    /// Device whose description changes.
    pub device: String,
    /// What changes: `joint_zero`.
    pub quantity: String,
    /// Where: the joint's name.
    #[serde(rename = "place")]
    pub site: String,
    /// Value in force before.
    pub old: f64,
    /// Value proposed.
    pub new: f64,
    /// One standard uncertainty of `new`; none where it was not determined.
    #[serde(default)]
    pub uncertainty: Option<f64>,
    /// What the uncertainty is made of, where the run worked that out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub budget: Option<Budget>,
    /// Unit of old, new and uncertainty.
    pub unit: String,
}

/// States of a device, as in ros2_control, and `lost` for one whose process ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DeviceState {
    /// Its process is being started.
    Unconfigured,
    /// Talks and can be read; does not move.
    Inactive,
    /// May move.
    Active,
    /// Shut down in good order.
    Finalized,
    /// Its process died, hung or was cut off; a robot is not started again by itself.
    Lost,
}

/// How a step ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StepOutcome {
    /// It did what it was to do.
    Passed,
    /// A check did not hold.
    Failed,
    /// Something went wrong.
    Error,
    /// Left out, by a person's or the file's decision after an error.
    Skipped,
    /// Not needed: its repetition ended before it.
    NotNeeded,
    /// Stopped in the middle; it will begin again on resume.
    Interrupted,
}

/// How a run ended; each has its exit code.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RunOutcome {
    /// All steps passed (or were finished early on request).
    Passed,
    /// A check did not hold.
    Failed,
    /// Something went wrong.
    Error,
    /// A person ended it.
    Aborted,
    /// It needs an answer that nobody is there to give.
    NeedsOperator,
}

impl RunOutcome {
    /// Exit code of a program that ran this: 0 passed, 1 failed, 2 error, 3 aborted, 4 needs an operator.
    pub fn exit_code(self) -> u8 {
        match self {
            RunOutcome::Passed => 0,
            RunOutcome::Failed => 1,
            RunOutcome::Error => 2,
            RunOutcome::Aborted => 3,
            RunOutcome::NeedsOperator => 4,
        }
    }
}

/// How severe a log line is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LogLevel {
    /// For finding faults.
    Debug,
    /// Worth knowing.
    Info,
    /// Goes on, but look at it.
    Warning,
    /// Something failed.
    Error,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_event_is_one_flat_json_object_and_comes_back_the_same() {
        let event = StampedEvent {
            sequence: 7,
            time: "2026-11-21T06:00:00.000Z".to_owned(),
            event: Event::StepStarted { step: StepPath("cycle[2].lower".to_owned()), attempt: 1 },
        };
        let line = serde_json::to_string(&event).expect("an event can be written");
        assert_eq!(
            line,
            r#"{"sequence":7,"time":"2026-11-21T06:00:00.000Z","event":"step_started","step":"cycle[2].lower","attempt":1}"#
        );
        assert_eq!(serde_json::from_str::<StampedEvent>(&line).expect("and read"), event);
    }
}
