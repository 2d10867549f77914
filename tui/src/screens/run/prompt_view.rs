//! Draws the prompt: what is asked, the field or the choices, what would be right, why an answer was not taken.

use plumb_cell::event::{NamedValue, PlaneClearance};
use plumb_cell::prompt::{ChoiceOption, Decision, JogGoal, PromptKind};
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::text::{Line, Span};
use ratatui::widgets::Paragraph;

use super::level_view::level;
use super::prompt::{OpenPrompt, bounds};
use super::words::padded;
use crate::screens::hits::{Hit, Hits};
use crate::screens::pane::{columns, fitted, reflowed, wrapped};
use crate::screens::theme::Theme;

/// Draws the prompt into the room inside its pane. Where room is short the controls stay and the text is cut.
pub(crate) fn view(prompt: &OpenPrompt, theme: &Theme, hits: &Hits, frame: &mut Frame, area: Rect) {
    let area = padded(area);
    let width = usize::from(area.width);
    let controls = controls(prompt, theme, width);
    let style =
        if matches!(prompt.prompt.kind, PromptKind::Decision { .. }) { theme.bad } else { theme.text };
    let mut text: Vec<Line> =
        question(prompt, width).into_iter().map(|line| Line::styled(line, style)).collect();
    if let Some(help) = &prompt.prompt.help {
        text.push(Line::default());
        text.extend(wrapped(&reflowed(help), width).into_iter().map(|line| Line::styled(line, theme.faint)));
    }
    let rows = |count: usize| u16::try_from(count).unwrap_or(u16::MAX);
    let air = u16::from(usize::from(area.height) > text.len() + controls.len());
    let [above, _, below, _] = Layout::vertical([
        Constraint::Max(rows(text.len())),
        Constraint::Length(air),
        Constraint::Length(rows(controls.len()).min(area.height)),
        Constraint::Fill(1),
    ])
    .areas(area);
    frame.render_widget(Paragraph::new(text), above);
    // Where not all of the controls fit, the chosen row stays in sight.
    let hidden = controls.len().saturating_sub(usize::from(below.height));
    let scrolled = prompt.chosen.saturating_sub(usize::from(below.height) / 2).min(hidden);
    frame.render_widget(Paragraph::new(controls).scroll((rows(scrolled), 0)), below);
    note_hits(prompt, scrolled, hits, below);
}

/// Notes which rows of the controls can be clicked.
pub(crate) fn note_hits(prompt: &OpenPrompt, scrolled: usize, hits: &Hits, area: Rect) {
    let (options, button) = match &prompt.prompt.kind {
        PromptKind::Acknowledge { .. } => (0, Some(0)),
        PromptKind::Choice { options, .. } => (options.len(), None),
        PromptKind::Decision { options, .. } => (options.len(), None),
        PromptKind::Number { .. }
        | PromptKind::Text { .. }
        | PromptKind::Level { .. }
        | PromptKind::Photo => (0, None),
        PromptKind::JogTo { goals, joints, hand_over, .. } => {
            let before_the_keys = joints.len() + goals.len() + prompt.clearances.len();
            (joints.len(), Some(before_the_keys + 1 + usize::from(*hand_over)))
        }
        PromptKind::ConfirmPose { recorded, .. } => (0, Some(recorded.len() + 1)),
    };
    for (place, row) in area.rows().enumerate().map(|(row, area)| (row + scrolled, area)) {
        if place < options {
            hits.note(row, Hit::Option(place));
        } else if Some(place) == button {
            hits.note(row, Hit::Answer);
        }
    }
}

/// The question itself; for a step that went wrong, what went wrong.
pub(crate) fn question(prompt: &OpenPrompt, width: usize) -> Vec<String> {
    let mut lines = wrapped(&reflowed(&prompt.prompt.text), width);
    if let PromptKind::Decision { error, .. } = &prompt.prompt.kind
        && *error != prompt.prompt.text
    {
        lines.extend(wrapped(error, width));
    }
    lines
}

/// What the operator works with, below the question.
pub(crate) fn controls(prompt: &OpenPrompt, theme: &Theme, width: usize) -> Vec<Line<'static>> {
    let mut lines = match &prompt.prompt.kind {
        PromptKind::Acknowledge { label } => vec![button(label, theme)],
        PromptKind::Choice { options, .. } => choices(options, prompt.chosen, theme, width),
        PromptKind::Number { unit, minimum, maximum, .. } => {
            field(prompt, unit, *minimum, *maximum, theme, width)
        }
        PromptKind::Text { longest } => {
            line_of_text(prompt, &format!("up to {longest} characters"), theme, width)
        }
        PromptKind::Level { most } => level(prompt, *most, theme, width),
        PromptKind::Photo => {
            line_of_text(prompt, "the path of the picture you took, PNG or JPEG", theme, width)
        }
        PromptKind::JogTo { goals, joints, .. } => jog(prompt, goals, joints, theme),
        PromptKind::ConfirmPose { recorded, reported, .. } => poses(recorded, reported, theme),
        PromptKind::Decision { options, .. } => decisions(options, prompt.chosen, theme),
    };
    if let Some(reason) = &prompt.refused {
        let reason = wrapped(&format!("\u{2717} {reason}"), width);
        lines.extend(reason.into_iter().map(|line| Line::styled(line, theme.bad)));
    } else if prompt.answered {
        lines.push(Line::styled("Answer given.", theme.faint));
    }
    lines
}

fn button(label: &str, theme: &Theme) -> Line<'static> {
    Line::from(vec![Span::styled(format!(" Enter  {label} "), theme.chosen)])
}

fn choices(options: &[ChoiceOption], chosen: usize, theme: &Theme, width: usize) -> Vec<Line<'static>> {
    let row = |(place, option): (usize, &ChoiceOption)| {
        choice(&fitted(&option.label, width.saturating_sub(4)), place == chosen, theme)
    };
    options.iter().enumerate().map(row).collect()
}

fn choice(label: &str, chosen: bool, theme: &Theme) -> Line<'static> {
    let (sign, style) = if chosen { ("\u{25b8} ", theme.chosen) } else { ("  ", theme.text) };
    Line::styled(format!("{sign}{label} "), style)
}

fn field(
    prompt: &OpenPrompt,
    unit: &str,
    minimum: Option<f64>,
    maximum: Option<f64>,
    theme: &Theme,
    width: usize,
) -> Vec<Line<'static>> {
    let text = &prompt.field;
    let gap = " ".repeat(12_usize.saturating_sub(columns(text)));
    let (text, cursor) = if prompt.offered {
        (Span::styled(text.clone(), theme.chosen), Span::raw(" "))
    } else {
        (Span::styled(text.clone(), theme.heading), Span::styled("\u{2588}", theme.focus))
    };
    let frame = |sign: &'static str| Span::styled(sign, theme.focus);
    let mut lines = vec![Line::from(vec![
        frame("\u{2590} "),
        text,
        cursor,
        Span::raw(gap),
        frame("\u{258c}"),
        Span::styled(format!(" {unit}"), theme.heading),
    ])];
    let bounds = bounds(minimum, maximum, unit);
    if prompt.refused.is_none() {
        let hint = if prompt.offered { "Enter takes it, or type another number" } else { "Enter answers" };
        let comma = if bounds.is_empty() { "" } else { " \u{b7} " };
        let hint = wrapped(&format!("{bounds}{comma}{hint}"), width);
        lines.extend(hint.into_iter().map(|line| Line::styled(line, theme.faint)));
    }
    lines
}

/// What is written, cut at its beginning where it is too long for the room, with what may be.
fn line_of_text(prompt: &OpenPrompt, what: &str, theme: &Theme, width: usize) -> Vec<Line<'static>> {
    let room = width.saturating_sub(4);
    let written: Vec<char> = prompt.field.chars().collect();
    let seen: String = written.iter().skip(written.len().saturating_sub(room)).collect();
    let mut lines = vec![Line::from(vec![
        Span::styled("\u{2590} ", theme.focus),
        Span::styled(seen, theme.heading),
        Span::styled("\u{2588}", theme.focus),
    ])];
    if prompt.refused.is_none() {
        let hint = format!("{what} \u{b7} Enter answers");
        lines.extend(wrapped(&hint, width).into_iter().map(|line| Line::styled(line, theme.faint)));
    }
    lines
}

fn jog(prompt: &OpenPrompt, goals: &[JogGoal], joints: &[NamedValue], theme: &Theme) -> Vec<Line<'static>> {
    let mut lines: Vec<Line<'static>> = joints
        .iter()
        .enumerate()
        .map(|(place, joint)| {
            let chosen = place == prompt.chosen;
            let name = format!("{}{:<12}", if chosen { "\u{25b8} " } else { "  " }, joint.name);
            Line::from(vec![
                Span::styled(name, if chosen { theme.focus } else { theme.text }),
                Span::styled(format!("{:>9.2} {}", joint.value, joint.unit), theme.heading),
            ])
        })
        .collect();
    lines.extend(goals.iter().map(|goal| goal_line(goal, joints, theme)));
    lines.extend(prompt.clearances.iter().map(|clearance| clearance_line(clearance, theme)));
    let unit = joints.get(prompt.chosen).map_or("", |joint| joint.unit.as_str());
    lines.push(Line::from(vec![
        Span::styled("\u{2190} \u{2192}", theme.key),
        Span::styled(format!(" jog by {} {unit}  ", prompt.step()), theme.text),
        Span::styled("] [", theme.key),
        Span::styled(" more, less  ", theme.text),
        Span::styled("\u{2191} \u{2193}", theme.key),
        Span::styled(" joint", theme.text),
    ]));
    if matches!(prompt.prompt.kind, PromptKind::JogTo { hand_over: true, .. }) {
        lines.push(Line::from(vec![
            Span::styled("h", theme.key),
            Span::styled(" hand it to its pendant, which alone stops it then", theme.text),
        ]));
    }
    lines.push(button("the arm is in position", theme));
    lines
}

fn goal_line(goal: &JogGoal, joints: &[NamedValue], theme: &Theme) -> Line<'static> {
    let value = joints.iter().find(|joint| joint.name == goal.joint).map(|joint| joint.value);
    let met = value.is_some_and(|value| (goal.minimum..=goal.maximum).contains(&value));
    let (sign, style) = if met { ("\u{2713}", theme.good) } else { ("\u{2717}", theme.warning) };
    let bounds = bounds(Some(goal.minimum), Some(goal.maximum), &goal.unit);
    Line::styled(format!("{sign} {} {bounds}", goal.joint), style)
}

/// How far the arm is clear of a keep-out plane; beyond it with a sign, for who sees no colours.
fn clearance_line(clearance: &PlaneClearance, theme: &Theme) -> Line<'static> {
    let PlaneClearance { plane, clearance_mm } = clearance;
    match clearance_mm {
        Some(mm) if *mm < 0.0 => Line::styled(format!("\u{2717} {:.1} mm BEYOND {plane}", -mm), theme.bad),
        Some(mm) => Line::styled(format!("  {mm:.1} mm clear of {plane}"), theme.text),
        None => Line::styled(
            format!("? distance to {plane} unknown: a joint's position is unknown"),
            theme.warning,
        ),
    }
}

fn poses(recorded: &[NamedValue], reported: &[NamedValue], theme: &Theme) -> Vec<Line<'static>> {
    let mut lines =
        vec![Line::styled(format!("{:<12}{:>11}{:>11}", "joint", "recorded", "reported"), theme.faint)];
    lines.extend(recorded.iter().map(|joint| {
        let now = reported.iter().find(|value| value.name == joint.name);
        let reported = now.map_or_else(|| "?".to_owned(), |value| format!("{:.3}", value.value));
        Line::styled(
            format!("{:<12}{:>11.3}{reported:>11} {}", joint.name, joint.value, joint.unit),
            theme.text,
        )
    }));
    lines.push(button("the arm is there: continue", theme));
    lines
}

fn decisions(options: &[Decision], chosen: usize, theme: &Theme) -> Vec<Line<'static>> {
    let label = |decision: &Decision| match decision {
        Decision::Retry => "t  Do the step again",
        Decision::Skip => "k  Go on without it",
        Decision::Abort => "a  Abort the run",
    };
    options
        .iter()
        .enumerate()
        .map(|(place, decision)| choice(label(decision), place == chosen, theme))
        .collect()
}
