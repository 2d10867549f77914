//! What the run has found: trigger poses and how they settle from turn to turn, and the corrections.

use plumb_cell::event::StepPath;
use plumb_cell::{NOT_DETERMINED, uncertainty_digits};
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::text::{Line, Span};
use ratatui::widgets::Paragraph;

use super::convergence;
use super::state::{CorrectionRow, Fate, RunState, Trigger};
use crate::screens::pane::{self, fitted};
use crate::screens::theme::Theme;

/// Turns shown at most; the newest stay.
const SHOWN_TURNS: usize = 7;

/// The successive poses of one search and joint.
struct Series<'a> {
    /// The search's path in the plan, whatever the turn.
    path: String,
    joint: &'a str,
    triggers: Vec<&'a Trigger>,
}

/// The least rows of the pane of trigger poses that show anything: frame, heads, one turn.
const LEAST: u16 = 5;

/// Rows the panes take of those there are.
pub(crate) fn rows(run: &RunState, room: u16) -> u16 {
    let turns = series(run).iter().map(|series| series.triggers.len()).max().unwrap_or(0).min(SHOWN_TURNS);
    let triggers = if turns == 0 { 0 } else { u16::try_from(turns + 4).unwrap_or(u16::MAX) };
    let corrections = correction_rows(run).min(room);
    let left = (room - corrections).min(triggers);
    if left < LEAST { corrections } else { corrections + left }
}

fn correction_rows(run: &RunState) -> u16 {
    if run.corrections.is_empty() { 0 } else { u16::try_from(run.corrections.len() + 3).unwrap_or(u16::MAX) }
}

/// Draws both panes into the room there is; corrections come first where it is short.
pub(crate) fn view(run: &RunState, theme: &Theme, frame: &mut Frame, area: Rect) {
    if area.is_empty() {
        return;
    }
    let corrections = correction_rows(run).min(area.height);
    let [above, below] = Layout::vertical([Constraint::Fill(1), Constraint::Length(corrections)]).areas(area);
    if above.height >= LEAST {
        settling(run, theme, frame, above);
    }
    if below.height >= 3 {
        corrected(run, theme, frame, below);
    }
}

/// Groups the trigger poses by search and joint, in the order in which they were first found.
fn series(run: &RunState) -> Vec<Series<'_>> {
    let mut all: Vec<Series<'_>> = Vec::new();
    for trigger in &run.triggers {
        let path = without_turns(&trigger.step);
        let joint = trigger.joint.name.as_str();
        match all.iter_mut().find(|series| series.path == path && series.joint == joint) {
            Some(series) => series.triggers.push(trigger),
            None => all.push(Series { path, joint, triggers: vec![trigger] }),
        }
    }
    all
}

/// The path of a step without the turns of its repetitions: `cycle.lower` for `cycle[2].lower`.
fn without_turns(step: &StepPath) -> String {
    let segments = step.0.split('.').map(|segment| segment.split('[').next().unwrap_or(segment));
    segments.collect::<Vec<_>>().join(".")
}

/// The searches that were done more often than once, else the newest ones; at most two side by side.
fn settling(run: &RunState, theme: &Theme, frame: &mut Frame, area: Rect) {
    let inner = pane::open(frame, area, theme, "Trigger poses, and how they settle", false);
    let mut all = series(run);
    all.sort_by_key(|series| std::cmp::Reverse(series.triggers.len()));
    all.truncate(if inner.width >= 44 { 2 } else { 1 });
    let turns = all.iter().map(|series| series.triggers.len()).max().unwrap_or(0);
    let table = u16::try_from(5 + 22 * all.len()).unwrap_or(u16::MAX);
    let [inner, plot] = if turns > 2 && inner.width >= table + convergence::LEAST {
        Layout::horizontal([Constraint::Length(table), Constraint::Fill(1)]).areas(inner)
    } else {
        [inner, Rect::ZERO]
    };
    let shown = turns.min(usize::from(inner.height.saturating_sub(2)));
    let mut names = vec![Span::raw("    ")];
    let mut heads = vec![Span::styled("  # ", theme.faint)];
    for series in &all {
        let search = series.path.rsplit('.').next().unwrap_or(&series.path);
        let name =
            if search == series.joint { search.to_owned() } else { format!("{search}: {}", series.joint) };
        names.push(Span::styled(format!("{:>22}", fitted(&name, 21)), theme.heading));
        let unit = series.triggers.first().map_or("", |trigger| trigger.joint.unit.as_str());
        heads.push(Span::styled(format!("{:>11}{:>11}", unit, "change"), theme.faint));
    }
    let mut lines = vec![Line::from(names), Line::from(heads)];
    for turn in turns.saturating_sub(shown)..turns {
        let mut spans = vec![Span::styled(format!("{:>3} ", turn + 1), theme.faint)];
        for series in &all {
            spans.extend(turn_cells(series, turn, theme));
        }
        lines.push(Line::from(spans));
    }
    frame.render_widget(Paragraph::new(lines), inner);
    let changes: Vec<(String, Vec<f64>)> =
        all.iter().map(|series| (series.joint.to_owned(), changes(series))).collect();
    let unit = all.first().and_then(|series| series.triggers.first()).map_or("", |first| &first.joint.unit);
    convergence::view(&changes, unit, theme, frame, plot);
}

/// How far each turn's pose lies from the one before.
fn changes(series: &Series<'_>) -> Vec<f64> {
    let pairs = series.triggers.iter().zip(series.triggers.iter().skip(1));
    pairs.map(|(before, after)| after.joint.value - before.joint.value).collect()
}

fn turn_cells(series: &Series<'_>, turn: usize, theme: &Theme) -> [Span<'static>; 2] {
    let Some(trigger) = series.triggers.get(turn) else { return [Span::raw(" ".repeat(22)), Span::raw("")] };
    let before = turn.checked_sub(1).and_then(|before| series.triggers.get(before));
    let change = before.map_or_else(String::new, |before| signed(trigger.joint.value - before.joint.value));
    let settled =
        before.is_some_and(|before| (trigger.joint.value - before.joint.value).abs() <= trigger.half_width);
    [
        Span::styled(format!("{:>11.4}", trigger.joint.value), theme.text),
        Span::styled(format!("{change:>11}"), if settled { theme.good } else { theme.measured }),
    ]
}

/// A change with its sign in four decimals, or that it is less than they show.
fn signed(change: f64) -> String {
    if change.abs() >= 5e-5 { format!("{change:+.4}") } else { "<0.0001".to_owned() }
}

fn corrected(run: &RunState, theme: &Theme, frame: &mut Frame, area: Rect) {
    let inner = pane::open(frame, area, theme, "Corrections", false);
    // Where it is narrow, what was in force before is in the prompt alone.
    let wide = inner.width >= 56;
    let old = if wide { format!("{:>9}", "old") } else { String::new() };
    let head = format!("  {:<14}{old}{:>10}{:>9}", "", "new", "\u{b1} 1\u{3c3}");
    let mut lines = vec![Line::styled(head, theme.faint)];
    // Where there is no room for all, the newest: they are what is asked about.
    let hidden = run.corrections.len().saturating_sub(usize::from(inner.height).saturating_sub(1));
    lines.extend(run.corrections.iter().skip(hidden).map(|row| correction_line(row, wide, theme)));
    frame.render_widget(Paragraph::new(lines), inner);
}

fn correction_line(row: &CorrectionRow, wide: bool, theme: &Theme) -> Line<'static> {
    let correction = &row.correction;
    let (sign, word, style) = match row.fate {
        Fate::Applied => ("\u{2713}", " in force", theme.good),
        Fate::Proposed => ("\u{b7}", " proposed", theme.warning),
        Fate::Discarded => ("\u{2717}", " discarded", theme.faint),
        Fate::Undone => ("\u{21b6}", " undone", theme.warning),
    };
    let label = in_short(&correction.quantity, &correction.site);
    Line::from(vec![
        Span::styled(format!("{sign} "), style),
        Span::styled(format!("{:<14}", fitted(&label, 14)), theme.text),
        Span::styled(if wide { format!("{:>9.3}", correction.old) } else { String::new() }, theme.faint),
        Span::styled(format!("{:>10.3}", correction.new), theme.heading),
        Span::styled(format!("{:>9}", narrow(correction.uncertainty)), theme.text),
        Span::styled(
            if correction.unit.is_empty() { String::new() } else { format!(" {}", correction.unit) },
            theme.faint,
        ),
        Span::styled(word, style),
    ])
}

/// An uncertainty as everywhere else, in as few letters as the table has room for.
fn narrow(uncertainty: Option<f64>) -> String {
    match uncertainty_digits(uncertainty) {
        words if words == NOT_DETERMINED => "not det.".to_owned(),
        words => words.replace("less than ", "<"),
    }
}

/// What is corrected, in as few words as the table has room for.
fn in_short(quantity: &str, site: &str) -> String {
    if quantity == "sensor_parameter" {
        return site.replace('_', " ");
    }
    format!("{site} {}", quantity.strip_prefix("joint_").unwrap_or(quantity).replace('_', " "))
}
