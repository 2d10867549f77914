//! The Log screen: what happened, newest last. Every event of the run leaves one line, but those that come many times a
//! second (joints, signals, progress).

use std::collections::VecDeque;

use plumb_cell::event::{Event, LogLevel, StampedEvent};
use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::text::{Line, Span};
use ratatui::widgets::Paragraph;

use super::pane;
use super::state::State;

/// Lines kept.
const KEPT: usize = 5000;

/// The lines and how far the view is scrolled back from the newest.
#[derive(Clone, Debug, Default)]
pub(crate) struct LogState {
    lines: VecDeque<LogLine>,
    scrolled_back: usize,
}

/// One line.
#[derive(Clone, Debug)]
struct LogLine {
    /// Time of day, UTC, as `hh:mm:ss`.
    time: String,
    level: LogLevel,
    source: String,
    message: String,
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
            run(format!("{} steps planned, about {estimate_s:.0} s", steps.len()))
        }
        Event::StepStarted { step, attempt: 1 } => run(format!("{step} begins")),
        Event::StepStarted { step, attempt } => run(format!("{step} begins, attempt {attempt}")),
        Event::StepFinished { step, outcome, message, seconds, .. } => {
            run(format!("{step} {} after {seconds:.1} s: {message}", super::run::outcome_word(*outcome)))
        }
        Event::PromptAsked { prompt } => run(format!("asks: {}", prompt.title)),
        Event::PromptAnswered { step, by, .. } => run(format!("{step} answered by {by}")),
        Event::AnswerRefused { reason, .. } => run(format!("answer not taken: {reason}")),
        Event::PromptWithdrawn { .. } => run("the question is withdrawn".to_owned()),
        Event::Device { device, state, message, .. } => {
            let text = message.as_deref().unwrap_or_default();
            let state = super::cell::state_word(*state);
            Some((LogLevel::Info, device.clone(), format!("{state} {text}").trim_end().to_owned()))
        }
        Event::TriggerFound { step, device, half_width, .. } => {
            let text = format!(
                "{step} found its edge, {} within \u{b1}{:.2e} {}",
                half_width.name, half_width.value, half_width.unit
            );
            Some((LogLevel::Info, device.clone(), text))
        }
        Event::CorrectionProposed { correction } => {
            run(format!("proposes {} {}", correction.quantity, correction.place))
        }
        Event::CorrectionApplied { correction, revision } => {
            run(format!("{} {} in force, revision {revision}", correction.quantity, correction.place))
        }
        Event::Paused { reason, .. } => run(format!("paused: {reason}")),
        Event::Resumed => run("goes on".to_owned()),
        Event::Stopped { reason } => {
            Some((LogLevel::Warning, "run".to_owned(), format!("stopped: {reason}")))
        }
        Event::Log { level, source, message, .. } => Some((*level, source.clone(), message.clone())),
        Event::RunEnded { message, .. } => run(message.clone()),
        Event::StepProgress { .. } | Event::Joints { .. } | Event::Signal { .. } => None,
    }
}

/// Draws the page.
pub(crate) fn view(state: &State, frame: &mut Frame, area: Rect) {
    let inner = pane::open(frame, area, &state.theme, "Log, times in UTC", false);
    let shown = usize::from(inner.height);
    let log = &state.log;
    let end = log.lines.len().saturating_sub(log.scrolled_back).max(shown.min(log.lines.len()));
    let lines: Vec<Line> = log
        .lines
        .range(end.saturating_sub(shown)..end)
        .map(|line| {
            let (word, style) = match line.level {
                LogLevel::Debug => ("debug: ", state.theme.faint),
                LogLevel::Info => ("", state.theme.text),
                LogLevel::Warning => ("warning: ", state.theme.warning),
                LogLevel::Error => ("error: ", state.theme.bad),
            };
            Line::from(vec![
                Span::styled(format!("{:<8} ", line.time), state.theme.faint),
                Span::styled(format!("{:<6} ", line.source), state.theme.heading),
                Span::styled(word, style),
                Span::styled(line.message.clone(), style),
            ])
        })
        .collect();
    frame.render_widget(Paragraph::new(lines), inner);
}
