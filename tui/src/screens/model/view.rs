//! Draws the Model screen: cards at the left, plots in the middle, the fall of the error at the right, one sentence below.

use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::Style;
use ratatui::text::{Line, Span};
use ratatui::widgets::Paragraph;

use super::state::ModelState;
use super::{cards, plots, waterfall};
use crate::screens::pane::{self, wrapped};
use crate::screens::run::sentence_case;
use crate::screens::state::State;
use crate::screens::theme::Theme;

/// Draws the page.
pub(crate) fn view(state: &State, frame: &mut Frame, area: Rect) {
    let Some(model) = &state.model else { return };
    let sentence = sentence(model);
    let inside = usize::from(area.width.saturating_sub(4));
    let rows = wrapped(&sentence, inside).len().clamp(1, 4);
    let foot = if area.height >= 14 { u16::try_from(rows + 2).unwrap_or(3) } else { 1 };
    let [body, foot] = Layout::vertical([Constraint::Fill(1), Constraint::Length(foot)]).areas(area);
    foot_pane(state, model, &sentence, frame, foot);
    let theme = &state.theme;
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
    plots::view(model, theme, frame, middle);
    waterfall::view(model, theme, frame, right);
}

/// What the sentence at the foot says.
fn sentence(model: &ModelState) -> String {
    if let Some(name) = &model.naming {
        return format!(
            "Add effect: {name}\u{2588}   Enter adds it, Esc closes. For example joint_zero(*), geometry(*)."
        );
    }
    if let Some(busy) = &model.busy {
        let known = model
            .standing
            .as_ref()
            .filter(|_| busy.only_judges)
            .map_or("", |standing| standing.sentence.as_str());
        let so_far = match &busy.progress {
            Some((fraction, doing)) => {
                format!(" {} {:.0} % ({doing})", pane::bar(*fraction, 12), 100.0 * fraction)
            }
            None => String::new(),
        };
        let doing = sentence_case(&busy.doing);
        return format!("{known} {doing} \u{2026}{so_far}").trim_start().to_owned();
    }
    match (&model.preview, &model.standing) {
        (Some(preview), _) => format!(
            "Preview: with {} added, {:.4} mm RMS would be left. a adds it, Space goes back.",
            preview.candidate, preview.rms_mm
        ),
        (None, Some(standing)) => format!("{} {}", standing.sentence, standing.error).trim_end().to_owned(),
        (None, None) => format!("Looking at {} \u{2026}", model.files),
    }
}

fn foot_pane(state: &State, model: &ModelState, sentence: &str, frame: &mut Frame, area: Rect) {
    let theme = &state.theme;
    let verdict = model.standing.as_ref().map_or("", |standing| standing.verdict.as_str());
    let warnings = match model.standing.as_ref().map_or(0, |standing| standing.warnings.len()) {
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
    let mut lines: Vec<Line> = wrapped(sentence, usize::from(inner.width))
        .into_iter()
        .map(|line| Line::styled(line, style))
        .collect();
    if let (Some(waited), Some(last)) = (waited, lines.last_mut()) {
        last.push_span(Span::styled(format!(" {waited} s"), theme.faint));
    }
    frame.render_widget(Paragraph::new(lines), inner);
}

fn style(model: &ModelState, theme: &Theme) -> Style {
    if model.preview.is_some() { theme.preview } else { theme.heading }
}
