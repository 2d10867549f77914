//! What the Log screen holds. Every event of the run leaves one line, but those that come many times a
//! second (joints, signals, progress).

use std::collections::VecDeque;

use crate::screens::cell::state_word;
use crate::screens::run::outcome_word;
use crate::step_numbers::steps_in_words;
use plumb_cell::event::{Correction, Event, LogLevel, StampedEvent};
use plumb_cell::give_or_take;

/// Lines kept.
const KEPT: usize = 5000;

/// The lines and how far the view is scrolled back from the newest.
#[derive(Clone, Debug, Default)]
pub(crate) struct LogState {
    pub(super) lines: VecDeque<LogLine>,
    pub(super) scrolled_back: usize,
}

/// One line.
#[derive(Clone, Debug)]
pub(super) struct LogLine {
    /// Time of day, UTC, as `hh:mm:ss`.
    pub(super) time: String,
    pub(super) level: LogLevel,
    pub(super) source: String,
    pub(super) message: String,
}

impl LogState {
    /// Takes in what is worth a line.
    pub(crate) fn take(&mut self, stamped: &StampedEvent) {
        let Some((level, source, message)) = line_of(&stamped.event) else { return };
        // RFC 3339: the time of day follows the T.
        let time = stamped.time.split_once('T').map_or("", |(_, time)| time).chars().take(8).collect();
        self.push(LogLine { time, level, source, message });
    }

    /// Adds a line of the screens' own.
    pub(crate) fn note(&mut self, level: LogLevel, source: &str, message: String) {
        self.push(LogLine { time: String::new(), level, source: source.to_owned(), message });
    }

    fn push(&mut self, line: LogLine) {
        if self.lines.len() >= KEPT {
            self.lines.pop_front();
        }
        self.lines.push_back(line);
        if self.scrolled_back > 0 {
            self.scroll(-1);
        }
    }

    /// Moves the view by `lines`, down where positive.
    pub(crate) fn scroll(&mut self, lines: isize) {
        self.scrolled_back = self.scrolled_back.saturating_add_signed(-lines).min(self.lines.len());
    }
}

/// What an event says in the log; nothing for those that come many times a second.
fn line_of(event: &Event) -> Option<(LogLevel, String, String)> {
    let run = |message: String| Some((LogLevel::Info, "run".to_owned(), message));
    match event {
        Event::RunStarted { run: number, procedure, cell, .. } => {
            run(format!("run {number}: {procedure} in {cell}"))
        }
        Event::Planned { steps, estimate_s } => {
            let depths: Vec<u32> = steps.iter().map(|step| step.depth).collect();
            run(format!("{} planned, about {estimate_s:.0} s", steps_in_words(&depths)))
        }
        Event::StepStarted { step, attempt: 2.. } => run(format!("{step} restarts")),
        Event::StepFinished { step, outcome, message, seconds, .. } => {
            let (outcome, comma) = (outcome_word(*outcome), if message.is_empty() { "" } else { ": " });
            run(format!("{step} {outcome} after {seconds:.1} s{comma}{message}"))
        }
        Event::PromptAsked { prompt } => run(format!("asks: {}", prompt.title)),
        Event::PromptAnswered { step, by, .. } => run(format!("{step} answered by {by}")),
        Event::AnswerRefused { reason, .. } => run(format!("answer not taken: {reason}")),
        Event::PromptWithdrawn { .. } => run("the question is withdrawn".to_owned()),
        Event::Device { device, state, message, .. } => {
            let text = message.as_deref().unwrap_or_default();
            let state = state_word(*state);
            Some((LogLevel::Info, device.clone(), format!("{state} {text}").trim_end().to_owned()))
        }
        Event::CorrectionProposed { correction } => run(format!("proposes {}", in_words(correction))),
        Event::CorrectionApplied { correction, revision } => {
            run(format!("in force, revision {revision}: {}", in_words(correction)))
        }
        Event::CorrectionUndone { correction, revision } => {
            run(format!("undone, revision {revision}: {}", in_words(correction)))
        }
        Event::ZerosLost { device, reason, .. } => Some((LogLevel::Warning, device.clone(), reason.clone())),
        Event::Paused { reason, .. } => run(format!("paused: {reason}")),
        Event::Resumed => run("goes on".to_owned()),
        Event::Stopped { reason } => {
            Some((LogLevel::Warning, "run".to_owned(), format!("stopped: {reason}")))
        }
        Event::Log { level, source, message, .. } => Some((*level, source.clone(), message.clone())),
        Event::RunEnded { message, .. } => run(message.clone()),
        // The line that says how a step ended says that it had begun, and what it found.
        Event::StepStarted { .. } | Event::TriggerFound { .. } => None,
        Event::StepProgress { .. } | Event::StripeTaken { .. } => None,
        // Going back has a line of the engine's own.
        Event::Joints { .. }
        | Event::Clearance { .. }
        | Event::Signal { .. }
        | Event::WentBack { .. }
        | Event::InstrumentRead { .. } => None,
    }
}

fn in_words(correction: &Correction) -> String {
    let what = correction.quantity.strip_prefix("joint_").unwrap_or(&correction.quantity).replace('_', " ");
    format!(
        "{what} of {} {:.4} -> {:.4} {} ({})",
        correction.site,
        correction.old,
        correction.new,
        correction.unit,
        give_or_take(correction.uncertainty, &correction.unit)
    )
}
