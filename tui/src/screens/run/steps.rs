//! The plan with what became of each step, kept so that the step under way is in sight.

use plumb_cell::event::StepOutcome;
use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::Style;
use ratatui::text::{Line, Span};
use ratatui::widgets::Paragraph;

use super::state::{RunState, Status, Step};
use super::words::spoken;
use crate::screens::pane;
use crate::screens::state::State;
use crate::screens::theme::Theme;

/// Draws the plan.
pub(crate) fn view(state: &State, run: &RunState, frame: &mut Frame, area: Rect) {
    let inner = pane::open(frame, area, &state.theme, "Steps", false);
    let room = usize::from(inner.height);
    let here = run.current().map(|(index, _)| index).or_else(|| next(run)).unwrap_or(run.steps.len());
    let first = here.saturating_sub(room / 3).min(run.steps.len().saturating_sub(room));
    let lines: Vec<Line> = run
        .steps
        .iter()
        .skip(first)
        .take(room)
        .map(|step| line(step, &state.theme, usize::from(inner.width)))
        .collect();
    frame.render_widget(Paragraph::new(lines), inner);
}

/// The step that comes next.
fn next(run: &RunState) -> Option<usize> {
    run.steps.iter().position(|step| step.status == Status::Waiting)
}

fn line(step: &Step, theme: &Theme, width: usize) -> Line<'static> {
    let (sign, style) = look(step.status, theme);
    let indent = "  ".repeat(usize::try_from(step.planned.depth.min(6)).unwrap_or(0));
    let end = match step.status {
        Status::Running => {
            step.fraction.map_or(String::new(), |fraction| format!(" {:>3.0}%", 100.0 * fraction))
        }
        Status::Waiting => step
            .planned
            .estimate_s
            .filter(|seconds| *seconds >= 1.0)
            .map_or(String::new(), |seconds| format!(" {}", spoken(seconds))),
        Status::Over(StepOutcome::Passed | StepOutcome::NotNeeded) => String::new(),
        Status::Over(outcome) => format!(" {}", short_word(outcome)),
    };
    let attempt = if step.attempt > 1 { format!(" (attempt {})", step.attempt) } else { String::new() };
    let room = width.saturating_sub(indent.len() + 2 + end.len());
    let title = pane::fitted(&format!("{}{}{attempt}", turn(step), step.planned.title), room);
    let gap = " ".repeat(room.saturating_sub(Span::raw(title.as_str()).width()));
    let text = match step.status {
        Status::Running => theme.heading,
        Status::Waiting => theme.text,
        Status::Over(StepOutcome::NotNeeded | StepOutcome::Skipped) => theme.faint,
        Status::Over(_) => theme.text,
    };
    Line::from(vec![
        Span::raw(indent),
        Span::styled(format!("{sign} "), style),
        Span::styled(title, text),
        Span::raw(gap),
        Span::styled(end, theme.faint),
    ])
}

/// How a step ended, in a word that leaves room for its title.
fn short_word(outcome: StepOutcome) -> &'static str {
    match outcome {
        StepOutcome::Error => "error",
        StepOutcome::Interrupted => "stopped",
        other => super::words::outcome_word(other),
    }
}

/// The turn of the repetition a step belongs to, before its title.
fn turn(step: &Step) -> String {
    let above = step.planned.step.0.rsplit('.').nth(1).and_then(|above| above.split_once('['));
    above.map_or_else(String::new, |(_, turn)| format!("{} ", turn.trim_end_matches(']')))
}

fn look(status: Status, theme: &Theme) -> (&'static str, Style) {
    match status {
        Status::Waiting => ("\u{b7}", theme.faint),
        Status::Running => ("\u{25b8}", theme.focus),
        Status::Over(StepOutcome::Passed) => ("\u{2713}", theme.good),
        Status::Over(StepOutcome::Failed | StepOutcome::Error) => ("\u{2717}", theme.bad),
        Status::Over(StepOutcome::Skipped) => ("\u{21b7}", theme.warning),
        Status::Over(StepOutcome::NotNeeded) => ("-", theme.faint),
        Status::Over(StepOutcome::Interrupted) => ("\u{2016}", theme.warning),
    }
}
