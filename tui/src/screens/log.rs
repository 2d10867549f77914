//! The Log screen: what happened, newest last. Every event of the run leaves one line, but those that come many times a
//! second (joints, signals, progress).

use std::collections::VecDeque;

use plumb_cell::event::{Correction, Event, LogLevel, StampedEvent};
use plumb_cell::give_or_take;
use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::text::{Line, Span};
use ratatui::widgets::Paragraph;

use super::pane;
use super::state::State;
use super::theme::Theme;

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
        Event::StepStarted { step, attempt: 2.. } => run(format!("{step} begins again")),
        Event::StepFinished { step, outcome, message, seconds, .. } => {
            let (outcome, comma) =
                (super::run::outcome_word(*outcome), if message.is_empty() { "" } else { ": " });
            run(format!("{step} {outcome} after {seconds:.1} s{comma}{message}"))
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
        Event::CorrectionProposed { correction } => run(format!("proposes {}", in_words(correction))),
        Event::CorrectionApplied { correction, revision } => {
            run(format!("in force, revision {revision}: {}", in_words(correction)))
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
        Event::Joints { .. } | Event::Clearance { .. } | Event::Signal { .. } => None,
    }
}

fn in_words(correction: &Correction) -> String {
    let what = correction.quantity.strip_prefix("joint_").unwrap_or(&correction.quantity).replace('_', " ");
    format!(
        "{what} of {} {:.4} -> {:.4} {} ({})",
        correction.place,
        correction.old,
        correction.new,
        correction.unit,
        give_or_take(correction.uncertainty, &correction.unit)
    )
}

/// Draws the page: the newest lines that fit, long ones on as many rows as they take.
pub(crate) fn view(state: &State, frame: &mut Frame, area: Rect) {
    let inner = pane::open(frame, area, &state.theme, "Log, times in UTC", false);
    let (room, width) = (usize::from(inner.height), usize::from(inner.width));
    let log = &state.log;
    let end = log.lines.len().saturating_sub(log.scrolled_back);
    let mut rows: VecDeque<Line> = VecDeque::new();
    for line in log.lines.range(..end).rev() {
        if rows.len() >= room {
            break;
        }
        for row in rows_of(line, width, &state.theme).into_iter().rev() {
            rows.push_front(row);
        }
    }
    // Of the oldest of these only its last rows may fit.
    let cut = rows.len().saturating_sub(room);
    // Scrolled back to the first line, the page stays full from there on.
    for line in log.lines.range(end..) {
        if rows.len() >= room {
            break;
        }
        rows.extend(rows_of(line, width, &state.theme));
    }
    frame.render_widget(Paragraph::new(rows.into_iter().skip(cut).collect::<Vec<_>>()), inner);
}

/// One line of the log on as many rows as it takes; those after the first are indented to where its message begins.
fn rows_of(line: &LogLine, width: usize, theme: &Theme) -> Vec<Line<'static>> {
    let (word, style) = match line.level {
        LogLevel::Debug => ("debug: ", theme.faint),
        LogLevel::Info => ("", theme.text),
        LogLevel::Warning => ("warning: ", theme.warning),
        LogLevel::Error => ("error: ", theme.bad),
    };
    let (time, source) = (format!("{:<8} ", line.time), format!("{:<6} ", line.source));
    let margin = pane::columns(&time) + pane::columns(&source);
    let message = format!("{word}{}", line.message);
    let parts = pane::wrapped(&message, width.saturating_sub(margin).max(20));
    let mut head = Some((Span::styled(time, theme.faint), Span::styled(source, theme.heading)));
    parts
        .into_iter()
        .map(|part| match head.take() {
            Some((time, source)) => Line::from(vec![time, source, Span::styled(part, style)]),
            None => Line::from(vec![Span::raw(" ".repeat(margin)), Span::styled(part, style)]),
        })
        .collect()
}
