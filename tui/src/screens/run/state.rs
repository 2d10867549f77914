//! What is known of the run, gathered from the engine's events.

use std::time::Duration;

use plumb_cell::event::{Correction, Event, NamedValue, PlannedStep, RunOutcome, StepOutcome, StepPath};
use plumb_cell::prompt::{Prompt, PromptKind};

use super::OpenPrompt;
use crate::screens::keys::Context;
use crate::step_numbers::step_numbers;

/// The run as the screen shows it.
#[derive(Clone, Debug, Default)]
pub(crate) struct RunState {
    /// Number in the record, once it has one.
    pub number: Option<i64>,
    /// Title of the procedure.
    pub title: String,
    /// Where the run is.
    pub phase: Phase,
    /// The whole plan, with what became of it.
    pub steps: Vec<Step>,
    /// Estimate of the whole, prompts left out, seconds.
    pub estimate_s: f64,
    /// The prompt that waits.
    pub prompt: Option<OpenPrompt>,
    /// The joint and the size of a jog as they were chosen last, for the prompt of that step when it is asked again: a key that is pressed then moves
    /// the same joint as before.
    pub jogged: Option<(StepPath, usize, usize)>,
    /// Where there is no room for both, the other of steps and arm is shown than would be.
    pub views_swapped: bool,
    /// The prompt is shown in large letters.
    pub large: bool,
    /// Trigger poses, in the order they were found.
    pub triggers: Vec<Trigger>,
    /// Corrections, in the order they were proposed.
    pub corrections: Vec<CorrectionRow>,
    /// When the run began, by the screens' clock.
    pub began: Option<Duration>,
    /// When it ended, by the screens' clock.
    pub ended: Option<Duration>,
}

/// Where a run is.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) enum Phase {
    /// The engine starts: processes, devices, record.
    #[default]
    Starting,
    /// Steps are being done.
    Running,
    /// Nothing moves until an explicit resume.
    Paused {
        /// Who or what paused it.
        reason: String,
    },
    /// Over.
    Ended {
        /// How.
        outcome: RunOutcome,
        /// In one sentence.
        message: String,
    },
}

/// One step of the plan.
#[derive(Clone, Debug)]
pub(crate) struct Step {
    /// As planned.
    pub planned: PlannedStep,
    /// What became of it.
    pub status: Status,
    /// 1 at first, more after a retry.
    pub attempt: u32,
    /// How far it is, where that can be known.
    pub fraction: Option<f64>,
    /// What it does now, or what it found.
    pub message: String,
    /// What it found.
    pub values: Vec<NamedValue>,
}

/// What became of a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Status {
    /// Not begun.
    Waiting,
    /// Under way.
    Running,
    /// Over.
    Over(StepOutcome),
}

/// A pose at which a search found what it looked for.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Trigger {
    /// Which search.
    pub step: StepPath,
    /// The joint searched along, at the edge.
    pub joint: NamedValue,
    /// It is known to within this, either way, in the joint's unit.
    pub half_width: f64,
}

/// A correction and whether it is in force.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct CorrectionRow {
    /// The change.
    pub correction: Correction,
    /// What became of it.
    pub fate: Fate,
}

/// What became of a correction that was proposed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Fate {
    /// It waits to be accepted.
    Proposed,
    /// It is in force.
    Applied,
    /// Its step is over, and it was not accepted.
    Discarded,
    /// It was in force and was taken back, as the operator went back past its step.
    Undone,
}

/// Kinds of steps whose results are reported at the end.
const RESULTS: [&str; 4] = ["scan", "measure", "correct", "read"];

/// How many results are reported at the end: the last, which are what the others led to.
const MOST_RESULTS: usize = 6;

impl RunState {
    /// Takes in an event at `now`. Says whether somebody is needed.
    pub(crate) fn take(&mut self, event: &Event, now: Duration) -> bool {
        match event {
            Event::RunStarted { run, title, .. } => {
                self.number = Some(*run);
                self.title.clone_from(title);
                self.phase = Phase::Running;
                self.began = Some(now);
            }
            Event::Planned { steps, estimate_s } => {
                self.steps = steps.iter().cloned().map(Step::planned).collect();
                self.estimate_s = *estimate_s;
            }
            Event::StepStarted { .. } | Event::StepProgress { .. } => self.take_step(event),
            Event::StepFinished { .. } => {
                self.take_step(event);
                self.take_found(event);
            }
            Event::PromptAsked { prompt } => {
                self.open_prompt(prompt);
                return true;
            }
            Event::PromptAnswered { prompt, .. } | Event::PromptWithdrawn { prompt } => {
                if let Some(open) = self.prompt.take_if(|open| open.prompt.id == *prompt)
                    && matches!(open.prompt.kind, PromptKind::JogTo { .. })
                {
                    self.jogged = Some((open.prompt.step, open.chosen, open.jog_step));
                }
            }
            Event::AnswerRefused { prompt, reason } => {
                if let Some(open) = self.prompt.as_mut().filter(|open| open.prompt.id == *prompt) {
                    open.refuse(reason);
                }
            }
            Event::Joints { .. }
            | Event::Clearance { .. }
            | Event::Signal { .. }
            | Event::InstrumentRead { .. } => {
                self.prompt.iter_mut().for_each(|open| open.take_live(event));
            }
            Event::WentBack { from, to } => self.go_back(from, to),
            Event::Paused { reason, .. } => {
                self.phase = Phase::Paused { reason: reason.clone() };
                // Nothing is answered or jogged before a resume, and then the prompt is asked anew.
                self.prompt = None;
                return true;
            }
            Event::Resumed => self.phase = Phase::Running,
            Event::RunEnded { outcome, message, .. } => {
                self.phase = Phase::Ended { outcome: *outcome, message: message.clone() };
                self.ended = Some(now);
                self.prompt = None;
                return true;
            }
            other => self.take_found(other),
        }
        false
    }

    /// Opens a prompt; jogging goes on with the joint and the step it had in the same step of the procedure.
    fn open_prompt(&mut self, prompt: &Prompt) {
        let mut open = OpenPrompt::new(prompt.clone());
        if let Some((_, joint, size)) = self.jogged.as_ref().filter(|(step, ..)| *step == prompt.step) {
            open.take_up_jogging(*joint, *size);
        }
        self.prompt = Some(open);
    }

    fn take_step(&mut self, event: &Event) {
        match event {
            Event::StepStarted { step, attempt } => {
                if let Some(known) = self.step(step) {
                    known.status = Status::Running;
                    known.attempt = *attempt;
                    known.fraction = None;
                    known.message.clear();
                }
            }
            Event::StepProgress { step, fraction, text } => {
                if let Some(known) = self.step(step) {
                    known.fraction = *fraction;
                    known.message.clone_from(text);
                }
            }
            Event::StepFinished { step, outcome, message, values, .. } => {
                if let Some(known) = self.step(step) {
                    known.status = Status::Over(*outcome);
                    known.fraction = None;
                    known.message.clone_from(message);
                    known.values.clone_from(values);
                }
            }
            _ => {}
        }
    }

    /// Steps that are to be done again have not been begun, and found nothing.
    fn go_back(&mut self, from: &StepPath, to: &StepPath) {
        let index = |path: &StepPath| self.steps.iter().position(|step| step.planned.step == *path);
        let (Some(to), Some(from)) = (index(to), index(from)) else { return };
        for step in self.steps.iter_mut().skip(to).take((from + 1).saturating_sub(to)) {
            *step = Step { attempt: step.attempt, ..Step::planned(step.planned.clone()) };
            self.triggers.retain(|trigger| trigger.step != step.planned.step);
        }
    }

    fn take_found(&mut self, event: &Event) {
        match event {
            Event::TriggerFound { step, joints, half_width, .. } => {
                if let Some(joint) = joints.iter().find(|joint| joint.name == half_width.name) {
                    self.triggers.push(Trigger {
                        step: step.clone(),
                        joint: joint.clone(),
                        half_width: half_width.value,
                    });
                }
            }
            Event::CorrectionProposed { correction } => self.take_correction(correction, Fate::Proposed),
            Event::CorrectionApplied { correction, .. } => self.take_correction(correction, Fate::Applied),
            Event::CorrectionUndone { correction, .. } => self.take_correction(correction, Fate::Undone),
            Event::StepFinished { outcome: StepOutcome::Passed, .. } => self.discard_what_waits(),
            _ => {}
        }
    }

    /// What is still only proposed when its step has passed was not accepted.
    fn discard_what_waits(&mut self) {
        for row in self.corrections.iter_mut().filter(|row| row.fate == Fate::Proposed) {
            row.fate = Fate::Discarded;
        }
    }

    fn take_correction(&mut self, correction: &Correction, fate: Fate) {
        let same = |row: &&mut CorrectionRow| {
            let known = &row.correction;
            known.device == correction.device
                && known.quantity == correction.quantity
                && known.site == correction.site
        };
        let taken = CorrectionRow { correction: correction.clone(), fate };
        match self.corrections.iter_mut().find(same) {
            Some(row) => *row = taken,
            None => self.corrections.push(taken),
        }
    }

    fn step(&mut self, path: &StepPath) -> Option<&mut Step> {
        self.steps.iter_mut().find(|step| step.planned.step == *path)
    }

    /// Whether the run has not ended.
    pub(crate) fn is_open(&self) -> bool {
        !matches!(self.phase, Phase::Ended { .. })
    }

    /// The innermost step under way, with its index in the plan.
    pub(crate) fn current(&self) -> Option<(usize, &Step)> {
        self.steps.iter().enumerate().rev().find(|(_, step)| step.status == Status::Running)
    }

    /// Steps that are over, and all steps; those that only hold others are not counted.
    pub(crate) fn count(&self) -> (usize, usize) {
        let is_over = |step: &&Step| matches!(step.status, Status::Over(outcome) if outcome != StepOutcome::Interrupted);
        let over = self.leaves().filter(is_over).count();
        (over, self.leaves().count())
    }

    /// The steps that hold no others.
    fn leaves(&self) -> impl Iterator<Item = &Step> {
        let depths: Vec<u32> = self.steps.iter().map(|step| step.planned.depth).collect();
        step_numbers(&depths).into_iter().zip(&self.steps).filter_map(|(number, step)| number.map(|_| step))
    }

    /// Estimated seconds that are left, prompts left out.
    pub(crate) fn left_s(&self) -> f64 {
        let left = |step: &Step| match step.status {
            Status::Waiting => 1.0,
            Status::Running => 1.0 - step.fraction.unwrap_or(0.0).clamp(0.0, 1.0),
            Status::Over(StepOutcome::Interrupted) => 1.0,
            Status::Over(_) => 0.0,
        };
        self.leaves().map(|step| left(step) * step.planned.estimate_s.unwrap_or(0.0)).sum()
    }

    /// How long the run has been going, or went, at `now`.
    pub(crate) fn elapsed(&self, now: Duration) -> Duration {
        self.began.map_or(Duration::ZERO, |began| self.ended.unwrap_or(now).saturating_sub(began))
    }

    /// What steps have found, a sentence each: of scans and measurements, and what was worked out where nothing was corrected.
    pub(crate) fn results(&self) -> Vec<String> {
        let computed = if self.corrections.is_empty() { &["compute"][..] } else { &[] };
        let has_result = |step: &&Step| {
            let kind = step.planned.kind.as_str();
            let passed = step.status == Status::Over(StepOutcome::Passed) && !step.message.is_empty();
            passed && (RESULTS.contains(&kind) || computed.contains(&kind))
        };
        let lines: Vec<String> = self
            .leaves()
            .filter(has_result)
            .map(|step| format!("{}: {}", step.planned.title, step.message))
            .collect();
        lines.iter().skip(lines.len().saturating_sub(MOST_RESULTS)).cloned().collect()
    }

    /// Where keys are looked up on the Run screen, the narrowest context first.
    pub(crate) fn contexts(&self) -> Vec<Context> {
        let mut contexts = Vec::new();
        match self.prompt.as_ref().map(|open| &open.prompt.kind) {
            Some(PromptKind::JogTo { .. }) => contexts.extend([Context::Jog, Context::Prompt]),
            Some(PromptKind::Decision { .. }) => contexts.extend([Context::Decision, Context::Prompt]),
            Some(_) => contexts.push(Context::Prompt),
            None => {}
        }
        if self.prompt.as_ref().is_some_and(|open| open.prompt.simulated) {
            contexts.push(Context::Simulated);
        }
        contexts.push(Context::RunPage);
        contexts
    }
}

impl Step {
    fn planned(planned: PlannedStep) -> Self {
        Self {
            planned,
            status: Status::Waiting,
            attempt: 1,
            fraction: None,
            message: String::new(),
            values: Vec::new(),
        }
    }
}
