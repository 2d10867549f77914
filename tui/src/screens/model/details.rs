//! The chosen candidate in full: its sketch, what it is, its size, how sure it is, how to see it, and its own plot.

use plumb_report::percent;
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::Style;
use ratatui::text::Line;
use ratatui::widgets::{Clear, Paragraph};

use super::cards::{chance, look, verdict};
use super::plots;
use super::state::{Card, ModelState};
use crate::screens::pane::{self, wrapped};
use crate::screens::state::State;
use crate::screens::theme::Theme;

/// Columns from which text and plot are side by side.
const SIDE_BY_SIDE: u16 = 72;

/// Draws the details over the page.
pub(crate) fn view(state: &State, frame: &mut Frame, area: Rect) {
    let Some(model) = &state.model else { return };
    let Some(card) = model.card() else { return };
    frame.render_widget(Clear, area);
    let title = format!("{} of {} \u{b7} {} \u{b7} Enter closes", model.chosen + 1, count(model), card.key);
    let inner = pane::open(frame, area, &state.theme, &title, true);
    let [text, plot] = match inner.width >= SIDE_BY_SIDE {
        true => Layout::horizontal([Constraint::Percentage(42), Constraint::Fill(1)]).spacing(1).areas(inner),
        false => Layout::vertical([Constraint::Percentage(55), Constraint::Fill(1)]).areas(inner),
    };
    let lines = lines(model, card, &state.theme, usize::from(text.width));
    frame.render_widget(Paragraph::new(lines), text);
    if model.own_plot().is_some() {
        plots::own(model, &state.theme, &state.hits, frame, plot);
    } else {
        let none = Line::styled("There is no plot of its own for it.", state.theme.faint);
        frame.render_widget(none, plot);
    }
}

fn count(model: &ModelState) -> usize {
    model.summary.as_ref().map_or(0, |summary| summary.cards.len())
}

fn lines(model: &ModelState, card: &Card, theme: &Theme, width: usize) -> Vec<Line<'static>> {
    let mut lines = Vec::new();
    let mut say = |text: &str, style: Style| {
        lines.extend(wrapped(text, width).into_iter().map(|line| Line::styled(line, style)));
    };
    let unit = model.reading_unit();
    let (_, word, style) = look(card.status, theme);
    say(&verdict(card, word), style);
    if let Some(probability) = card.probability {
        say(&format!("Probability {}.", percent(probability)), theme.text);
    }
    if let Some(p) = card.holm_p {
        say(&format!("p {} (Holm): the chance that noise alone looks like this.", chance(p)), theme.text);
    }
    if !card.ties.is_empty() {
        say(&format!("As well: {}.", card.ties.join(", ")), theme.warning);
    }
    if !card.size.is_empty() {
        say(&format!("Size {}.", card.size), theme.text);
    }
    if let Some(gain) = card.gain_mm {
        let word = if gain < 0.0 { "worse" } else { "better" };
        say(&format!("Rows left out: {:.4} {unit} {word}.", gain.abs()), theme.text);
    }
    if let Some(leaves) = card.leaves_mm {
        say(&format!("Adding it leaves {leaves:.4} {unit} there."), theme.text);
    }
    if let Some(plot) = model.own_plot() {
        let [before, after] = plot.rms_mm;
        say(
            &format!("In its own plot: {before:.4} {unit} RMS about zero, {after:.4} about the curve."),
            theme.text,
        );
    }
    if let Some(kind) = plumb_calibration::effect::kind(&card.effect) {
        say(" ", theme.text);
        say(kind.sentence, theme.text);
        say(&format!("To see it: {}", kind.how_to_see), theme.faint);
        lines.push(Line::default());
        lines.extend(kind.sketch.map(|line| Line::styled(format!("  {line}"), theme.machine)));
    }
    lines
}
