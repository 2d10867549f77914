//! Draws the Model screen in the order of the questions: over the page how large the error is, how much of it could be explained and where it is; then from
//! left to right which effect and how sure, the plots, what adding effects did; one sentence below.

use plumb_cell::sentence_case;
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::Style;
use ratatui::text::{Line, Span};
use ratatui::widgets::Paragraph;

use super::names;
use super::state::{ModelState, ModelSummary};
use super::{cards, plots, strip, waterfall};
use crate::screens::pane::{self, wrapped};
use crate::screens::state::State;
use crate::screens::theme::Theme;

/// Rows of the page from which the strip is shown.
const ROOM_FOR_A_STRIP: u16 = 16;

/// Rows that the sentence at the foot may take; what is still left then is cut, and marked.
const MOST_ROWS_OF_SENTENCE: usize = 4;

/// Draws the page.
pub(crate) fn view(state: &State, frame: &mut Frame, area: Rect) {
    let Some(model) = &state.model else { return };
    let sentence = sentence(model);
    let inside = usize::from(area.width.saturating_sub(4));
    let rows = wrapped(&sentence, inside).len().clamp(1, MOST_ROWS_OF_SENTENCE);
    let foot = if area.height >= 14 { u16::try_from(rows + 2).unwrap_or(3) } else { 1 };
    let theme = &state.theme;
    let lines = if area.height >= ROOM_FOR_A_STRIP {
        strip::lines(model, (area.width, area.height), theme)
    } else {
        Vec::new()
    };
    let strip = Constraint::Length(u16::try_from(lines.len()).unwrap_or(0));
    let [above, body, foot] =
        Layout::vertical([strip, Constraint::Fill(1), Constraint::Length(foot)]).areas(area);
    strip::view(lines, frame, above);
    foot_pane(state, model, &sentence, frame, foot);
    if body.width < 60 {
        cards::view(model, theme, &state.hits, frame, body);
        return;
    }
    let sides = [Constraint::Max(34), Constraint::Min(30), Constraint::Max(30)];
    let [left, middle, right] = if body.width >= 100 {
        Layout::horizontal(sides).areas(body)
    } else {
        Layout::horizontal([Constraint::Length(25), Constraint::Fill(1), Constraint::Length(24)]).areas(body)
    };
    cards::view(model, theme, &state.hits, frame, left);
    plots::view(model, theme, &state.hits, frame, middle);
    waterfall::view(model, theme, frame, right);
}

/// What the sentence at the foot says.
fn sentence(model: &ModelState) -> String {
    if let Some(name) = &model.naming {
        return naming(model.summary.as_ref(), name);
    }
    if let Some(busy) = &model.busy {
        let known = model
            .summary
            .as_ref()
            .filter(|_| busy.only_judges)
            .map_or("", |summary| summary.sentence.as_str());
        let so_far = match &busy.progress {
            Some((fraction, doing)) => {
                format!(" {} {:.0} % ({doing})", pane::bar(*fraction, 12), 100.0 * fraction)
            }
            None => String::new(),
        };
        let doing = sentence_case(&busy.doing);
        return format!("{known} {doing} \u{2026}{so_far}").trim_start().to_owned();
    }
    if let Some(text) = model.pointed.and_then(|row| pointed(model.summary.as_ref()?, row)) {
        return text;
    }
    match (&model.preview, &model.summary) {
        (Some(preview), _) => format!(
            "Preview: with {} added, {:.4} {} RMS would be left. a adds it, Space goes back.",
            preview.candidate,
            preview.rms_mm,
            model.reading_unit()
        ),
        (None, Some(summary)) => summary.sentence.clone(),
        (None, None) => format!("Nothing is fitted to {}; j starts over.", model.files),
    }
}

/// Names shown at most while one is being written.
const NAMES_SHOWN: usize = 4;

/// The name that is being written, and what it could become.
fn naming(summary: Option<&ModelSummary>, name: &str) -> String {
    let found = names::matching(summary, name);
    let shown: Vec<&str> = found.iter().take(NAMES_SHOWN).map(String::as_str).collect();
    let known = match (shown.is_empty(), found.len() > NAMES_SHOWN) {
        (true, _) => "no effect of the library is called so (`plumb model effects` lists them).".to_owned(),
        (false, true) => {
            format!("Tab completes: {} and {} more.", shown.join(", "), found.len() - NAMES_SHOWN)
        }
        (false, false) => format!("Tab completes: {}.", shown.join(", ")),
    };
    format!("Add effect: {name}\u{2588}   Enter adds it, Esc closes; {known}")
}

/// The row that is pointed out: its line, how far off it is, its pose.
fn pointed(summary: &ModelSummary, row: usize) -> Option<String> {
    let worst = summary.residuals.worst();
    let known = summary.residuals.rows.iter().find(|known| known.row == row)?;
    let rank = worst.iter().position(|other| *other == row)?;
    let rank_in_words = match rank {
        0 => "the worst".to_owned(),
        _ => format!("number {} from the worst", rank + 1),
    };
    let joints = summary.joints.iter().zip(&known.joints);
    let pose: Vec<String> =
        joints.map(|(joint, value)| format!("{} {value:.1} {}", joint.name, joint.unit)).collect();
    let held_out = if known.held_out { " Held out." } else { "" };
    let weight = match known.weight < 0.995 {
        true => format!(" Weight in the fit {:.2}.", known.weight),
        false => String::new(),
    };
    let turned = known.size_deg.map_or_else(String::new, |size| format!(", turned by {size:.4} deg"));
    let along = match known.vector_mm {
        // An angle or a distance has no direction in space.
        [0.0, 0.0, 0.0] => String::new(),
        [x, y, z] => format!(" (x {x:.3}, y {y:.3}, z {z:.3})"),
    };
    Some(format!(
        "{} {} ({rank_in_words} of {}): off by {:.3} {}{along}{turned} at {}.{held_out}{weight}",
        summary.row_name,
        known.line,
        worst.len(),
        known.size?,
        summary.unit,
        pose.join(", ")
    ))
}

fn foot_pane(state: &State, model: &ModelState, sentence: &str, frame: &mut Frame, area: Rect) {
    let theme = &state.theme;
    let verdict = model.summary.as_ref().map_or("", |summary| summary.verdict.as_str());
    let warnings = match model.summary.as_ref().map_or(0, |summary| summary.warnings.len()) {
        0 => String::new(),
        1 => " \u{b7} 1 warning: see Log".to_owned(),
        count => format!(" \u{b7} {count} warnings: see Log"),
    };
    let verdict = if verdict.is_empty() { String::new() } else { format!("{verdict} \u{b7} ") };
    let title = format!("{verdict}{}{warnings}", model.files);
    let inner = pane::open(frame, area, theme, &title, false);
    let style = style(model, theme);
    let waited = model
        .busy
        .as_ref()
        .map(|busy| state.now.saturating_sub(busy.since).as_secs())
        .filter(|waited| *waited > 0);
    let mut rows = wrapped(sentence, usize::from(inner.width));
    if rows.len() > usize::from(inner.height) {
        rows.truncate(usize::from(inner.height));
        if let Some(last) = rows.last_mut() {
            *last = pane::fitted(&format!("{last}\u{2026}"), usize::from(inner.width));
        }
    }
    let mut lines: Vec<Line> = rows.into_iter().map(|line| Line::styled(line, style)).collect();
    if let (Some(waited), Some(last)) = (waited, lines.last_mut()) {
        last.push_span(Span::styled(format!(" {waited} s"), theme.faint));
    }
    frame.render_widget(Paragraph::new(lines), inner);
}

fn style(model: &ModelState, theme: &Theme) -> Style {
    if model.preview.is_some() { theme.preview } else { theme.heading }
}
