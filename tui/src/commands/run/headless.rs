//! A run that nobody watches on screens: lines of text, or of JSON.

use std::io::{self, Write};

use plumb_cell::command::Command;
use plumb_cell::engine::RunningRun;
use plumb_cell::event::{Event, LogLevel, PlannedStep, RunOutcome, StampedEvent, StepOutcome, StepPath};
use plumb_cell::prompt::Prompt;
use plumb_cell::{change_in_words, corrected_quantity, give_or_take};

use super::json_events::{self, Requested};
use crate::commands::answer::{SIMULATE, SIMULATES, ways_to_answer};
use crate::step_numbers::{step_numbers, steps_in_words};

/// Prints what happens until the run has ended. A run whose standard output cannot be written is aborted, which is reported on standard error: its
/// outcome is that of any other aborted run, also where its reader merely went away.
///
/// # Errors
/// The system does not let it wait for events.
pub(super) fn watch(
    mut running: RunningRun,
    json: Option<Vec<Requested>>,
    attended: bool,
) -> io::Result<RunOutcome> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    let handle = running.handle.clone();
    let printed: io::Result<()> = runtime.block_on(async {
        let mut printer = Printer { json, attended, plan: Vec::new() };
        while let Some(event) = running.events.recv().await {
            printer.print(&event)?;
            if matches!(event.event, Event::Paused { .. }) {
                // Stopped at the arm itself, and nobody is here to resume: kept, for who comes.
                handle.send(Command::Keep);
            }
        }
        Ok(())
    });
    let unread = printed.err().map(|cause| format!("its standard output, which cannot be written: {cause}"));
    if let Some(by) = unread.clone() {
        handle.send(Command::EndFromOutside { by, keep: false });
    }
    let outcome = running.thread.join().unwrap_or(RunOutcome::Error);
    if let Some(by) = unread {
        // Standard error may have gone with standard output: the exit code is left.
        let _ = writeln!(io::stderr(), "plumb: the run {}: ended by {by}", in_words(outcome));
    }
    Ok(outcome)
}

struct Printer {
    /// As JSON, and which events; none for lines that people read.
    json: Option<Vec<Requested>>,
    /// Somebody answers from another terminal.
    attended: bool,
    plan: Vec<PlannedStep>,
}

impl Printer {
    fn print(&mut self, event: &StampedEvent) -> io::Result<()> {
        if let Event::Planned { steps, .. } = &event.event {
            self.plan.clone_from(steps);
        }
        let mut out = io::stdout().lock();
        if let Some(requested) = &self.json {
            json_events::write(event, requested, &mut out)?;
        } else if let Some(line) = self.line(&event.event) {
            writeln!(out, "{line}")?;
        }
        out.flush()
    }

    /// What a person reads of an event; none where it is too small to be reported.
    fn line(&self, event: &Event) -> Option<String> {
        Some(match event {
            Event::RunStarted { run, cell, title, resumed_at: None, .. } => {
                format!("run {run} of {cell}: {title}")
            }
            Event::RunStarted { run, cell, title, resumed_at: Some(step), .. } => {
                format!("run {run} of {cell}, resumed at {step}: {title}")
            }
            Event::Planned { steps, estimate_s } => {
                let count = steps_in_words(&depths(steps));
                format!("{count}, about {}, prompts left out", duration(*estimate_s))
            }
            Event::StepFinished { step, outcome, message, .. } => self.finished(step, *outcome, message)?,
            Event::PromptAsked { prompt } if self.attended => asked(prompt),
            Event::AnswerRefused { reason, .. } => format!("        not taken: {reason}"),
            Event::PromptAnswered { step, by, .. } => format!("        {step}: answered by {by}"),
            Event::CorrectionProposed { correction: c } => format!(
                "        {}: {} ({})",
                corrected_quantity(&c.quantity, &c.device, &c.site),
                change_in_words(c.old, c.new, &c.unit),
                give_or_take(c.uncertainty, &c.unit)
            ),
            Event::ZerosLost { device, joints, reason } => {
                format!("        ZEROS LOST: {device} ({}): {reason}", joints.join(", "))
            }
            Event::Paused { reason, .. } => format!("paused: {reason}"),
            Event::Resumed => "resumed".to_owned(),
            Event::Stopped { reason } => format!("stopped: {reason}"),
            Event::Device { device, message: Some(message), .. } => format!("        {device}: {message}"),
            Event::Log { level, source, message, .. } if *level >= LogLevel::Warning => {
                format!("        {source}: {message}")
            }
            Event::RunEnded { run, outcome, message } => {
                format!("run {run} {}: {message}", in_words(*outcome))
            }
            _ => return None,
        })
    }

    fn finished(&self, step: &StepPath, outcome: StepOutcome, message: &str) -> Option<String> {
        let index = self.plan.iter().position(|planned| planned.step == *step)?;
        let planned = self.plan.get(index)?;
        let is_frame = matches!(planned.kind.as_str(), "repeat" | "call");
        if is_frame && outcome == StepOutcome::Passed {
            return None;
        }
        let numbers = step_numbers(&depths(&self.plan));
        let count = numbers.iter().flatten().count();
        // A step that only holds others has no number of its own.
        let label = match numbers.get(index).copied().flatten() {
            Some(number) => format!("[{number:>2}/{count}]"),
            None => "       ".to_owned(),
        };
        Some(match outcome {
            StepOutcome::Passed => format!("{label} {step}: {}: {message}", planned.title),
            StepOutcome::NotNeeded => format!("{label} {step}: not needed"),
            StepOutcome::Skipped => format!("{label} {step}: left out"),
            StepOutcome::Interrupted => format!("{label} {step}: interrupted: {message}"),
            StepOutcome::Failed => format!("{label} {step}: FAILED: {message}"),
            StepOutcome::Error => format!("{label} {step}: ERROR: {message}"),
        })
    }
}

fn depths(plan: &[PlannedStep]) -> Vec<u32> {
    plan.iter().map(|step| step.depth).collect()
}

/// A question, for who answers it from another terminal.
fn asked(prompt: &Prompt) -> String {
    let text = prompt.text.replace('\n', "\n            ");
    let id = prompt.id.0;
    let simulate = match prompt.simulated {
        true => format!("\n            or: plumb answer --prompt {id} {SIMULATE}   ({SIMULATES})"),
        false => String::new(),
    };
    format!(
        "        {} asks: {}\n            {text}\n            answer from another terminal: plumb answer --prompt {id} {}{simulate}",
        prompt.step,
        prompt.title,
        ways_to_answer(&prompt.kind)
    )
}

pub(super) fn in_words(outcome: RunOutcome) -> &'static str {
    match outcome {
        RunOutcome::Passed => "passed",
        RunOutcome::Failed => "failed",
        RunOutcome::Error => "ended with an error",
        RunOutcome::Aborted => "was aborted",
        RunOutcome::NeedsOperator => "needs an operator",
    }
}

pub(super) fn duration(seconds: f64) -> String {
    let whole = seconds.round().max(0.0) as u64;
    match whole / 60 {
        0 => format!("{whole} s"),
        minutes => format!("{minutes} min {} s", whole % 60),
    }
}
