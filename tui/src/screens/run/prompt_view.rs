//! Draws the prompt: what is asked, the field or the choices, what would be right, why an answer was not taken.

use plumb_cell::event::{NamedValue, PlaneClearance};
use plumb_cell::prompt::{Decision, JogGoal, PromptKind};
use plumb_cell::with_decimals;
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::text::{Line, Span};
use ratatui::widgets::Paragraph;

use super::instrument_view::{bubble_line, ruler_line};
use super::level_view::level;
use super::prompt::{OpenPrompt, bounds};
use super::words::padded;
use crate::screens::cell::HandPosition;
use crate::screens::hits::{Hit, Hits};
use crate::screens::pane::{columns, fitted, marked, reflowed, wrapped};
use crate::screens::theme::Theme;

/// Draws the prompt into the room inside its pane. Where room is short the controls stay and the text is cut.
pub(crate) fn view(
    prompt: &OpenPrompt,
    hand: Option<&HandPosition>,
    theme: &Theme,
    hits: &Hits,
    frame: &mut Frame,
    area: Rect,
) {
    let area = padded(area);
    let width = usize::from(area.width);
    let text = text(prompt, theme, width);
    let labels = labels_that_fit(prompt, hand, theme, text.len(), area);
    let controls = marked(controls(prompt, hand, theme, width, labels), width);
    let air = u16::from(usize::from(area.height) > text.len() + controls.len());
    let [above, _, below, _] = Layout::vertical([
        Constraint::Max(rows(text.len())),
        Constraint::Length(air),
        Constraint::Length(rows(controls.len()).min(area.height)),
        Constraint::Fill(1),
    ])
    .areas(area);
    text_view(prompt, text, theme, hits, frame, above);
    // Where not all of the controls fit, the chosen row stays in sight.
    let hidden = controls.len().saturating_sub(usize::from(below.height));
    let scrolled = prompt.chosen.saturating_sub(usize::from(below.height) / 2).min(hidden);
    frame.render_widget(Paragraph::new(controls).scroll((rows(scrolled), 0)), below);
    let about_hand = hand.map_or(0, |hand| hand_lines(hand, theme, width).len());
    note_hits(prompt, labels, &option_rows(prompt, width, labels), scrolled, about_hand, hits, below);
}

/// Rows a prompt takes with its frame if all of it is to be seen, in a pane of so many columns.
pub(crate) fn rows_needed(
    prompt: &OpenPrompt,
    hand: Option<&HandPosition>,
    theme: &Theme,
    columns: u16,
) -> u16 {
    // The pane has a frame of one and an edge of one.
    let width = usize::from(padded(Rect::new(0, 0, columns.saturating_sub(2), 1)).width);
    let inside =
        text(prompt, theme, width).len() + 1 + controls(prompt, hand, theme, width, Labels::Whole).len();
    rows(inside + 2)
}

fn rows(count: usize) -> u16 {
    u16::try_from(count).unwrap_or(u16::MAX)
}

/// Labels are broken into lines where there is room for it, and cut where there is not.
fn labels_that_fit(
    prompt: &OpenPrompt,
    hand: Option<&HandPosition>,
    theme: &Theme,
    text_rows: usize,
    area: Rect,
) -> Labels {
    let (width, height) = (usize::from(area.width), usize::from(area.height));
    let fits = |labels, text: usize| {
        controls(prompt, hand, theme, width, labels).len().saturating_add(text) <= height
    };
    if fits(Labels::Whole, text_rows) {
        Labels::Whole
    } else if fits(Labels::OneLine, LEAST_TEXT) {
        Labels::OneLine
    } else {
        Labels::Shortest
    }
}

/// Rows of the text below which other words make room for it: one of the text, and the one that says how to read on.
const LEAST_TEXT: usize = 2;

/// What is asked, and the help to it.
fn text(prompt: &OpenPrompt, theme: &Theme, width: usize) -> Vec<Line<'static>> {
    let style =
        if matches!(prompt.prompt.kind, PromptKind::Decision { .. }) { theme.bad } else { theme.text };
    let mut text: Vec<Line> =
        question(prompt, width).into_iter().map(|line| Line::styled(line, style)).collect();
    if let Some(help) = &prompt.prompt.help {
        text.push(Line::default());
        text.extend(wrapped(&reflowed(help), width).into_iter().map(|line| Line::styled(line, theme.faint)));
    }
    text
}

/// Draws the text; where it is cut, its last row says which keys show the rest.
fn text_view(
    prompt: &OpenPrompt,
    text: Vec<Line<'static>>,
    theme: &Theme,
    hits: &Hits,
    frame: &mut Frame,
    area: Rect,
) {
    let room = usize::from(area.height);
    if text.len() <= room {
        frame.render_widget(Paragraph::new(text), area);
        return;
    }
    // With a single row there is none to spare for the mark: it is at its end.
    let [above, mark] = match room {
        0 | 1 => {
            let width = rows(columns(MORE)).min(area.width);
            [area, Rect { x: area.right() - width, width, ..area }]
        }
        _ => Layout::vertical([Constraint::Fill(1), Constraint::Length(1)]).areas(area),
    };
    let hidden = text.len() - usize::from(above.height).min(text.len());
    let scrolled = prompt.scrolled.min(hidden);
    let says = if scrolled < hidden { MORE } else { BEGINNING };
    frame.render_widget(Paragraph::new(text).scroll((rows(scrolled), 0)), above);
    frame.render_widget(Line::styled(fitted(says, usize::from(mark.width)), theme.key), mark);
    hits.note(area, Hit::Text { hidden });
}

/// What is below a text that goes on.
const MORE: &str = "\u{2026} PgDn reads on";
/// What is below the end of a text whose beginning is hidden.
const BEGINNING: &str = "PgUp goes back";

/// How labels that are longer than a line are shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Labels {
    /// Broken into lines.
    Whole,
    /// Cut.
    OneLine,
    /// Cut, and what the footer says as well left out: else nothing could be read of what is asked.
    Shortest,
}

/// Notes which rows of the controls can be clicked.
pub(crate) fn note_hits(
    prompt: &OpenPrompt,
    labels: Labels,
    options: &[usize],
    scrolled: usize,
    about_hand: usize,
    hits: &Hits,
    area: Rect,
) {
    let simulated_rows = simulated(prompt, usize::from(area.width), labels).len();
    let button = match &prompt.prompt.kind {
        PromptKind::Acknowledge { .. } => Some(simulated_rows),
        PromptKind::Choice { .. }
        | PromptKind::Decision { .. }
        | PromptKind::Number { .. }
        | PromptKind::Text { .. }
        | PromptKind::Level { .. }
        | PromptKind::Photo => None,
        PromptKind::JogTo { goals, joints, hand_over, .. } => {
            let before_the_keys = joints.len()
                + goals.len()
                + prompt.clearances.len()
                + about_hand
                + simulated_rows
                + usize::from(prompt.fired.is_some())
                + usize::from(prompt.level.is_some())
                + usize::from(prompt.ruler.is_some());
            Some(before_the_keys + 1 + usize::from(*hand_over))
        }
        PromptKind::ConfirmPose { recorded, .. } => Some(recorded.len() + 1),
    };
    // Its label may take several rows, and nothing follows it.
    let is_acknowledged = matches!(prompt.prompt.kind, PromptKind::Acknowledge { .. });
    for (index, row) in area.rows().enumerate().map(|(row, area)| (row + scrolled, area)) {
        if let Some(option) = options.get(index) {
            hits.note(row, Hit::Option(*option));
        } else if button.is_some_and(|button| index == button || (index > button && is_acknowledged)) {
            hits.note(row, Hit::Answer);
        }
    }
}

/// Of each row of the controls from the first on, which option or joint it shows.
pub(crate) fn option_rows(prompt: &OpenPrompt, width: usize, labels: Labels) -> Vec<usize> {
    let rows = |labels_shown: Vec<String>| {
        let rows_of =
            |(index, label): (usize, String)| vec![index; option_lines(&label, width, labels).len()];
        labels_shown.into_iter().enumerate().flat_map(rows_of).collect()
    };
    match &prompt.prompt.kind {
        PromptKind::Choice { options, .. } => {
            rows(options.iter().map(|option| option.label.clone()).collect())
        }
        PromptKind::Decision { options, labels, .. } => rows(decision_labels(options, labels)),
        PromptKind::JogTo { joints, .. } => (0..joints.len()).collect(),
        _ => Vec::new(),
    }
}

/// The question itself; for a step that went wrong, what went wrong.
pub(crate) fn question(prompt: &OpenPrompt, width: usize) -> Vec<String> {
    let mut lines = wrapped(&reflowed(&prompt.prompt.text), width);
    if let PromptKind::Decision { error, .. } = &prompt.prompt.kind
        && !prompt.prompt.text.contains(error)
    {
        lines.extend(wrapped(error, width));
    }
    lines
}

/// What the operator works with, below the question. `hand` is where the hand of a jogged arm is.
pub(crate) fn controls(
    prompt: &OpenPrompt,
    hand: Option<&HandPosition>,
    theme: &Theme,
    width: usize,
    shown: Labels,
) -> Vec<Line<'static>> {
    let simulated = simulated_lines(prompt, theme, width, shown);
    let mut lines = match &prompt.prompt.kind {
        PromptKind::Acknowledge { label } => [simulated, acknowledge(label, theme, width)].concat(),
        PromptKind::Choice { options, .. } => {
            let labels = options.iter().map(|option| option.label.clone());
            choices(labels, prompt.chosen, theme, width, shown)
        }
        PromptKind::Number { unit, minimum, maximum, .. } => {
            [simulated, field(prompt, unit, *minimum, *maximum, theme, width)].concat()
        }
        PromptKind::Text { longest } => {
            line_of_text(prompt, &format!("up to {longest} characters"), theme, width)
        }
        PromptKind::Level { most } => level(prompt, *most, theme, width),
        PromptKind::Photo => {
            line_of_text(prompt, "the path of the picture you took, PNG or JPEG", theme, width)
        }
        PromptKind::JogTo { goals, joints, sensor, .. } => {
            let hand = hand.map_or_else(Vec::new, |hand| hand_lines(hand, theme, width));
            jog(prompt, goals, joints, sensor.as_deref(), [hand, simulated].concat(), theme, width)
        }
        PromptKind::ConfirmPose { recorded, reported, .. } => poses(recorded, reported, theme),
        PromptKind::Decision { options, labels, .. } => {
            choices(decision_labels(options, labels).into_iter(), prompt.chosen, theme, width, shown)
        }
    };
    if let Some(reason) = &prompt.refused {
        let reason = wrapped(&format!("\u{2717} {reason}"), width);
        lines.extend(reason.into_iter().map(|line| Line::styled(line, theme.bad)));
    } else if prompt.answered {
        lines.push(Line::styled("Answer given.", theme.faint));
    }
    lines
}

fn acknowledge(label: &str, theme: &Theme, width: usize) -> Vec<Line<'static>> {
    // What is agreed to is read whole: " Enter  " and the blank behind it take nine columns.
    let lines = wrapped(label, width.saturating_sub(9)).into_iter().enumerate();
    let button = |(row, line): (usize, String)| {
        let key = if row == 0 { "Enter" } else { "" };
        Line::styled(format!(" {key:<5}  {line} "), theme.chosen)
    };
    lines.map(button).collect()
}

/// In a simulated cell, what needs nobody's hands or eyes; nothing where a person is needed. Where room is short the footer names the key alone.
fn simulated(prompt: &OpenPrompt, width: usize, shown: Labels) -> Vec<String> {
    let label = match &prompt.prompt.kind {
        _ if !prompt.prompt.simulated || shown == Labels::Shortest => return Vec::new(),
        PromptKind::JogTo { .. } => "Simulated: Enter drives it there where you do not jog it.",
        PromptKind::Number { .. } => "Simulated: read already, Enter takes it.",
        _ => "Simulated: done already, Enter goes on.",
    };
    [label, "s leaves this and all like it to the program."]
        .into_iter()
        .flat_map(|sentence| wrapped(sentence, width))
        .collect()
}

fn simulated_lines(prompt: &OpenPrompt, theme: &Theme, width: usize, shown: Labels) -> Vec<Line<'static>> {
    simulated(prompt, width, shown).into_iter().map(|line| Line::styled(line, theme.good)).collect()
}

/// Where the hand is over the target, and where it has to go.
fn hand_lines(hand: &HandPosition, theme: &Theme, width: usize) -> Vec<Line<'static>> {
    let style = if hand.is_below_the_table() { theme.bad } else { theme.text };
    let mut lines: Vec<Line<'static>> =
        wrapped(&hand.in_words(), width).into_iter().map(|line| Line::styled(line, style)).collect();
    let (advice, style) = match hand.advice() {
        Ok(advice) => (format!("\u{2713} {advice}"), theme.good),
        Err(advice) => (format!("\u{2717} {advice}"), theme.warning),
    };
    lines.extend(wrapped(&advice, width).into_iter().map(|line| Line::styled(line, style)));
    lines
}

fn button(label: &str, theme: &Theme) -> Line<'static> {
    Line::from(vec![Span::styled(format!(" Enter  {label} "), theme.chosen)])
}

/// The rows of what can be chosen, the chosen one marked.
fn choices(
    labels: impl Iterator<Item = String>,
    chosen: usize,
    theme: &Theme,
    width: usize,
    shown: Labels,
) -> Vec<Line<'static>> {
    let rows = |(index, label): (usize, String)| {
        let style = if index == chosen { theme.chosen } else { theme.text };
        let line = move |(row, line): (usize, String)| {
            let sign = if row == 0 && index == chosen { "\u{25b8} " } else { "  " };
            Line::styled(format!("{sign}{line} "), style)
        };
        option_lines(&label, width, shown).into_iter().enumerate().map(line).collect::<Vec<_>>()
    };
    labels.enumerate().flat_map(rows).collect()
}

/// The lines of one label; what follows the first is below its words, not below its key.
fn option_lines(label: &str, width: usize, shown: Labels) -> Vec<String> {
    let room = width.saturating_sub(4);
    if shown != Labels::Whole || columns(label) <= room {
        return vec![fitted(label, room)];
    }
    let (key, words) = match label.split_once("  ") {
        Some((key, words)) => (format!("{key}  "), words),
        None => (String::new(), label),
    };
    let indent = " ".repeat(columns(&key));
    let begins = |row: usize| if row == 0 { key.as_str() } else { indent.as_str() };
    let lines = wrapped(words, room.saturating_sub(columns(&key)));
    lines.into_iter().enumerate().map(|(row, line)| format!("{}{line}", begins(row))).collect()
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

fn jog(
    prompt: &OpenPrompt,
    goals: &[JogGoal],
    joints: &[NamedValue],
    sensor: Option<&str>,
    hand: Vec<Line<'static>>,
    theme: &Theme,
    width: usize,
) -> Vec<Line<'static>> {
    let mut lines: Vec<Line<'static>> = joints
        .iter()
        .enumerate()
        .map(|(index, joint)| {
            let chosen = index == prompt.chosen;
            let name = format!("{}{:<12}", if chosen { "\u{25b8} " } else { "  " }, joint.name);
            Line::from(vec![
                Span::styled(name, if chosen { theme.focus } else { theme.text }),
                Span::styled(format!("{:>9} {}", with_decimals(joint.value, 2), joint.unit), theme.heading),
            ])
        })
        .collect();
    lines.extend(goals.iter().map(|goal| goal_line(goal, joints, theme)));
    lines.extend(prompt.clearances.iter().map(|clearance| clearance_line(clearance, theme)));
    lines.extend(hand);
    lines.extend(prompt.level.map(|level| bubble_line(level, theme, width)));
    lines.extend(prompt.ruler.map(|height| ruler_line(height, theme, width)));
    lines.extend(prompt.fired.zip(sensor).map(|(on, sensor)| {
        let (sign, word) = if on { ("\u{25a0}", "ON") } else { ("\u{25a1}", "OFF") };
        Line::styled(format!("{sign} {sensor} is {word}"), if on { theme.good } else { theme.text })
    }));
    let unit = joints.get(prompt.chosen).map_or("", |joint| joint.unit.as_str());
    let size = format!("{} {unit}", prompt.step());
    let whole = jog_keys(&format!(" jog by {size}  "), " more, less  ", theme);
    lines.push(if whole.width() <= width { whole } else { jog_keys(&format!(" {size} "), " size ", theme) });
    if matches!(prompt.prompt.kind, PromptKind::JogTo { hand_over: true, .. }) {
        lines.push(Line::from(vec![
            Span::styled("h", theme.key),
            Span::styled(" hand it to its pendant, which alone stops it then", theme.text),
        ]));
    }
    lines.push(button("the arm is in position", theme));
    lines
}

/// The keys that jog, with what they do.
fn jog_keys(by: &str, size: &'static str, theme: &Theme) -> Line<'static> {
    Line::from(vec![
        Span::styled("\u{2190} \u{2192}", theme.key),
        Span::styled(by.to_owned(), theme.text),
        Span::styled("] [", theme.key),
        Span::styled(size, theme.text),
        Span::styled("\u{2191} \u{2193}", theme.key),
        Span::styled(" joint", theme.text),
    ])
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

/// Differences of no more than this are not marked, deg or mm: the digits that are shown.
const SAME: f64 = 5e-4;

/// Columns of the joints' names beside where they were and are: as many as the longest takes, and no more than leave room for the rest in a
/// terminal of 80 columns.
const LEAST_NAME: usize = 11;
const MOST_NAME: usize = 13;

/// Where each joint was recorded and is reported, with the difference where there is one.
fn poses(recorded: &[NamedValue], reported: &[NamedValue], theme: &Theme) -> Vec<Line<'static>> {
    let longest = recorded.iter().map(|joint| columns(&joint.name)).max().unwrap_or(0);
    let names = longest.clamp(LEAST_NAME, MOST_NAME);
    let head = format!("{:<names$}{:>9}{:>9}{:>11}", "joint", "recorded", "reported", "difference");
    let mut lines = vec![Line::styled(head, theme.faint)];
    lines.extend(recorded.iter().map(|joint| {
        let now = reported.iter().find(|value| value.name == joint.name).map(|value| value.value);
        let by = now.map(|now| now - joint.value).filter(|by| by.abs() > SAME || by.is_nan());
        let shown = now.map_or_else(|| "?".to_owned(), |now| with_decimals(now, 3));
        let (name, value) = (fitted(&joint.name, names), with_decimals(joint.value, 3));
        let text = format!("{name:<names$}{value:>9}{shown:>9}");
        let (style, difference) = match (now, by) {
            (Some(_), None) => (theme.text, format!("{:>11}", "same")),
            (_, by) => {
                (theme.warning, format!("{:>11}", by.map_or("?".to_owned(), |by| format!("{by:+.3}"))))
            }
        };
        Line::styled(format!("{text}{difference} {}", joint.unit), style)
    }));
    lines.push(button("the arm is there: continue", theme));
    lines
}

/// What may be decided, each behind its key. `labels` say what each does; who asks without them gets the usual words.
fn decision_labels(options: &[Decision], labels: &[String]) -> Vec<String> {
    let row = |(index, decision): (usize, &Decision)| {
        let (key, usual) = match decision {
            Decision::Retry => ("t", "Do the step again"),
            Decision::Move => ("m", "Move the arm yourself, then do the step again"),
            Decision::Back => ("b", "Go back to the step that placed the arm"),
            Decision::Skip => ("k", "Go on without it"),
            Decision::Abort => ("a", "Abort the run"),
        };
        format!("{key}  {}", labels.get(index).map_or(usual, String::as_str))
    };
    options.iter().enumerate().map(row).collect()
}
