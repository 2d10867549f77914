//! Draws the Run screen.

use plumb_cell::event::{DeviceState, RunOutcome};
use plumb_cell::sentence_case;
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::Style;
use ratatui::text::{Line, Span};
use ratatui::widgets::{LineGauge, Paragraph, Wrap};

use super::prompt::OpenPrompt;
use super::state::{Fate, Phase, RunState};
use super::words::{padded, spoken};
use super::{found, large, prompt_view, steps};
use crate::screens::cell::{HandPosition, joint_line, views};
use crate::screens::hits::Hit;
use crate::screens::pane;
use crate::screens::state::State;
use crate::screens::theme::Theme;

/// Rows of the pane that matters most where the arm is drawn below it.
const ATTENTION: u16 = 20;
/// Rows from which there is room for both.
const ROOM_TO_DRAW: u16 = ATTENTION + 9;

/// Rows the pane that matters most has at least.
const LEAST: u16 = 7;
/// Rows it has at least where somebody is asked.
const LEAST_OF_A_PROMPT: u16 = 12;

/// Draws the page.
pub(crate) fn view(state: &State, frame: &mut Frame, area: Rect) {
    let Some(run) = &state.run else { return };
    if let (true, Some(prompt)) = (run.large, &run.prompt) {
        large::view(prompt, &state.theme, &state.hits, frame, area);
        return;
    }
    let [title, body] =
        Layout::vertical([Constraint::Length(u16::from(area.height > 7)), Constraint::Fill(1)]).areas(area);
    title_line(state, run, frame, title);
    if body.width < 64 {
        attention(state, run, frame, body);
        return;
    }
    let [left, right] = Layout::horizontal([Constraint::Percentage(38), Constraint::Fill(1)]).areas(body);
    // A prompt needs its room; what was found can wait for the end.
    let least = least_rows(state, run, right.width);
    let found_rows = found::rows(run, body.height.saturating_sub(least));
    let drawn = state.cell.shape.is_some()
        && right.height.saturating_sub(found_rows) >= ROOM_TO_DRAW.max(least + ROOM_TO_DRAW - ATTENTION);
    // Where there is no room for both, the arm takes the place of the steps while it is jogged, or when asked for.
    let jogged = run.prompt.as_ref().is_some_and(OpenPrompt::is_jog);
    if !drawn && state.cell.shape.is_some() {
        state.hits.note(left, Hit::Views);
    }
    if !drawn && state.cell.shape.is_some() && jogged != run.views_swapped {
        views(state, frame, left, false);
    } else {
        let live = if body.height >= 16 { joint_rows(state).min(8) } else { 0 };
        let [plan, values] = Layout::vertical([Constraint::Fill(1), Constraint::Length(live)]).areas(left);
        steps::view(state, run, frame, plan);
        live_values(state, frame, values);
    }
    let above = if drawn { Constraint::Length(ATTENTION.max(least)) } else { Constraint::Fill(1) };
    let between = if drawn { Constraint::Fill(1) } else { Constraint::Length(0) };
    let [above, between, below] =
        Layout::vertical([above, between, Constraint::Length(found_rows)]).areas(right);
    attention(state, run, frame, above);
    if drawn {
        views(state, frame, between, true);
    }
    found::view(run, &state.theme, frame, below);
}

/// Columns that the title keeps, with the blanks around it, where it would be the time that is left or the title.
const LEAST_TITLE: usize = 14;

/// The title of the procedure, how far it is, what is left.
fn title_line(state: &State, run: &RunState, frame: &mut Frame, area: Rect) {
    let (over, all) = run.count();
    let mut right = if all > 0 { format!("{over} of {all} steps") } else { String::new() };
    let left = run.left_s();
    let time = format!(" \u{b7} about {} of motion left", spoken(left));
    let has_room = pane::columns(&right) + pane::columns(&time) + LEAST_TITLE <= usize::from(area.width);
    if run.is_open() && left >= 1.0 && has_room {
        right.push_str(&time);
    }
    let room = usize::from(area.width).saturating_sub(Span::raw(right.as_str()).width() + 4);
    frame.render_widget(
        Span::styled(format!(" {}", pane::fitted(&run.title, room)), state.theme.heading),
        area,
    );
    frame.render_widget(
        Line::from(Span::styled(format!("{right} "), state.theme.faint)).right_aligned(),
        area,
    );
}

/// Where the hand of the arm is that a prompt lets be jogged.
fn hand_of(state: &State, prompt: &OpenPrompt) -> Option<HandPosition> {
    prompt.jogged_robot().and_then(|robot| HandPosition::of(&state.cell, robot))
}

/// The pane that matters most: the prompt, or what is being done, or how it ended.
fn attention(state: &State, run: &RunState, frame: &mut Frame, area: Rect) {
    let theme = &state.theme;
    if let Some(prompt) = &run.prompt {
        let inner = pane::open(frame, area, theme, &prompt.prompt.title, true);
        let hand = hand_of(state, prompt);
        prompt_view::view(prompt, hand.as_ref(), theme, &state.hits, frame, inner);
        return;
    }
    match &run.phase {
        Phase::Starting => {
            paragraph(frame, area, theme, "Starting", "Starting the devices of the cell.", false)
        }
        Phase::Running => doing(state, run, frame, area),
        Phase::Paused { reason } => {
            let text = format!(
                "{}.\n\nNothing moves until you press r to resume.\nOn resume the current step restarts; a scan continues with its next stripe.\n\na aborts the run, f ends it with \
                 what it has found.",
                sentence_case(reason.trim_end_matches('.'))
            );
            paragraph(frame, area, theme, "\u{2016} Paused", &text, true);
        }
        Phase::Ended { outcome, message } => {
            let (sign, word, _) = outcome_look(*outcome, theme);
            let text = ended_text(state, run, message);
            paragraph(frame, area, theme, &format!("{sign} {word}"), &text, true);
        }
    }
}

/// How the run ended, what it found, and where to look further.
fn ended_text(state: &State, run: &RunState, message: &str) -> String {
    let option = &state.record_option;
    let certified = |number: i64| match run.corrections.iter().any(|one| one.fate == Fate::Applied) {
        true => format!(", `plumb certificate {number}{option} -o FILE.html` writes its certificate"),
        false => String::new(),
    };
    let printed = run.number.map_or_else(String::new, |number| {
        format!(" `plumb show {number}{option}` prints it later{}.", certified(number))
    });
    let history = if state.history.is_some() { " 4 shows it among the others in the record." } else { "" };
    let results: String = run.results().iter().map(|result| format!("\n{result}")).collect();
    format!("{}.{results}\n\nq leaves.{history}{printed}", sentence_case(message.trim_end_matches('.')))
}

/// Rows that what is shown now takes with its frame; what was found takes no more than the rest.
fn least_rows(state: &State, run: &RunState, columns: u16) -> u16 {
    if let Some(prompt) = &run.prompt {
        return prompt_view::rows_needed(prompt, hand_of(state, prompt).as_ref(), &state.theme, columns)
            .max(LEAST_OF_A_PROMPT);
    }
    let Phase::Ended { message, .. } = &run.phase else { return LEAST };
    // The frame and the air at the sides.
    let width = usize::from(columns.saturating_sub(4));
    let lines = pane::wrapped(&ended_text(state, run, message), width).len();
    u16::try_from(lines.saturating_add(2)).unwrap_or(u16::MAX).max(LEAST)
}

fn paragraph(frame: &mut Frame, area: Rect, theme: &Theme, title: &str, text: &str, focus: bool) {
    let inner = pane::open(frame, area, theme, title, focus);
    frame.render_widget(Paragraph::new(text).wrap(Wrap { trim: true }), padded(inner));
}

/// The step under way: what it is, how far, what it says.
fn doing(state: &State, run: &RunState, frame: &mut Frame, area: Rect) {
    let theme = &state.theme;
    let Some((_, step)) = run.current() else {
        return paragraph(frame, area, theme, "Running", "Between two steps.", false);
    };
    let inner = padded(pane::open(frame, area, theme, &step.planned.title, false));
    let fraction = step.fraction.filter(|fraction| fraction.is_finite());
    let height = if fraction.is_some() { 2 } else { 0 };
    let [bar, text] = Layout::vertical([Constraint::Length(height), Constraint::Fill(1)]).areas(inner);
    if let Some(fraction) = fraction {
        let gauge = LineGauge::default()
            .filled_symbol("\u{2588}")
            .unfilled_symbol("\u{2591}")
            .filled_style(theme.measured)
            .unfilled_style(theme.faint);
        frame.render_widget(gauge.ratio(fraction.clamp(0.0, 1.0)), bar);
    }
    let moves = step.planned.moves.join(", ");
    let mut lines = Vec::new();
    if !step.message.is_empty() {
        lines.extend([Line::raw(sentence_case(&step.message)), Line::default()]);
    }
    if !moves.is_empty() {
        let stops = if state.only_watches() { "" } else { " Esc stops." };
        lines.push(Line::styled(format!("Moves {moves}: keep clear.{stops}"), theme.warning));
    }
    frame.render_widget(Paragraph::new(lines).wrap(Wrap { trim: true }), text);
}

fn joint_rows(state: &State) -> u16 {
    state.cell.robot().map_or(0, |robot| u16::try_from(robot.joints.len().saturating_add(2)).unwrap_or(0))
}

fn live_values(state: &State, frame: &mut Frame, area: Rect) {
    let Some(robot) = state.cell.robot().filter(|_| area.height >= 3) else { return };
    let word = match (robot.state, robot.moving) {
        (DeviceState::Lost, _) => "LOST, last seen here",
        (_, true) => "moving",
        (_, false) => "at rest",
    };
    let inner = pane::open(frame, area, &state.theme, &format!("{} {word}", robot.name), false);
    let width = usize::from(inner.width);
    let lines = robot.joints.iter().map(|joint| joint_line(&joint.name, joint, &state.theme, width));
    frame.render_widget(Paragraph::new(pane::marked(lines.collect(), width)), inner);
}

/// How a run ended: a sign, a word, a style.
pub(crate) fn outcome_look(outcome: RunOutcome, theme: &Theme) -> (&'static str, &'static str, Style) {
    match outcome {
        RunOutcome::Passed => ("\u{2713}", "passed", theme.good),
        RunOutcome::Failed => ("\u{2717}", "failed", theme.bad),
        RunOutcome::Error => ("\u{2717}", "ended with an error", theme.bad),
        RunOutcome::Aborted => ("\u{25a0}", "aborted", theme.warning),
        RunOutcome::NeedsOperator => ("?", "needs an operator", theme.warning),
    }
}
