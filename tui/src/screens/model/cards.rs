//! The candidates as ranked cards: the effect, where, its size, what it gains where it was not fitted, what would explain
//! it as well, why it was not named.

use plumb_calibration::measurement::ReadingUnit;
use plumb_report::percent;
use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::Style;
use ratatui::text::{Line, Span};
use ratatui::widgets::{Paragraph, Wrap};

use super::state::{Card, CardStatus, ModelState};
use crate::screens::hits::{Hit, Hits};
use crate::screens::pane::{self, columns, fitted, wrapped};
use crate::screens::theme::Theme;

/// Rows of the pane from which the chosen card shows its sketch.
const ROOM_FOR_A_SKETCH: u16 = 22;

/// Draws the cards, the chosen one in full.
pub(crate) fn view(model: &ModelState, theme: &Theme, hits: &Hits, frame: &mut Frame, area: Rect) {
    let inner = pane::open(frame, area, theme, "Which effect, how sure", true);
    let Some(summary) = &model.summary else { return };
    let width = usize::from(inner.width);
    let roomy = inner.height >= ROOM_FOR_A_SKETCH;
    let blocks: Vec<Vec<Line<'static>>> = summary
        .cards
        .iter()
        .enumerate()
        .map(|(index, card)| {
            card_lines((index, card), index == model.chosen, (roomy, summary.unit), theme, width)
        })
        .collect();
    if blocks.is_empty() {
        let text = match &model.busy {
            Some(_) => "not judged yet",
            None => "No effect of the library explains more than chance would.",
        };
        frame.render_widget(Paragraph::new(text).style(theme.faint).wrap(Wrap { trim: true }), inner);
        return;
    }
    // The first card that is drawn, so that the chosen one is whole in the pane.
    let room = usize::from(inner.height);
    let mut first = model.chosen.min(blocks.len().saturating_sub(1));
    let mut rows = blocks.get(first).map_or(0, Vec::len);
    while let Some(above) = first.checked_sub(1).and_then(|above| blocks.get(above)) {
        rows += above.len();
        if rows > room {
            break;
        }
        first -= 1;
    }
    let mut rows = inner.rows();
    for (index, block) in blocks.iter().enumerate().skip(first) {
        rows.by_ref().take(block.len()).for_each(|row| hits.note(row, Hit::Card(index)));
    }
    let lines: Vec<Line<'static>> = blocks.into_iter().skip(first).flatten().take(room).collect();
    frame.render_widget(Paragraph::new(lines), inner);
}

/// The lines of a card: two, or all there is to say of the chosen one; its sketch where the pane is `roomy`.
fn card_lines(
    (index, card): (usize, &Card),
    chosen: bool,
    (roomy, unit): (bool, ReadingUnit),
    theme: &Theme,
    width: usize,
) -> Vec<Line<'static>> {
    let (sign, word, style) = look(card.status, theme);
    let head = format!("{:>2} {sign} {}", index + 1, card.effect);
    let whole = format!("{head} {}", card.site);
    let fits = columns(&whole) <= width;
    let title = if fits { whole } else { fitted(&head, width) };
    let mut lines = vec![Line::styled(title, if chosen { theme.chosen } else { style })];
    let indented = |text: String, style: Style| {
        wrapped(&text, width.saturating_sub(5))
            .into_iter()
            .map(move |line| Line::styled(format!("     {line}"), style))
    };
    if !chosen {
        let site = if fits { "" } else { card.site.as_str() };
        let text = fitted(&format!("     {}", format!("{site} {}", card.size).trim_start()), width);
        lines.push(Line::styled(text, theme.faint));
        return lines;
    }
    if !fits {
        lines.extend(indented(format!("at {}", card.site), theme.heading));
    }
    if roomy && let Some(kind) = plumb_calibration::effect::kind(&card.effect) {
        lines.extend(kind.sketch.map(|line| Line::styled(format!("     {line}"), theme.machine)));
        lines.extend(indented(kind.sentence.to_owned(), theme.faint));
    }
    lines.extend(indented(card.size.clone(), theme.text));
    if let Some(gain) = card.gain_mm {
        lines.extend(indented(
            format!(
                "cross-validation: {:.4} {unit} {}",
                gain.abs(),
                if gain < 0.0 { "worse" } else { "better" }
            ),
            theme.text,
        ));
    }
    if let Some(probability) = card.probability {
        lines.extend(indented(format!("probability: {}", percent(probability)), theme.text));
    }
    if let Some(p) = card.holm_p {
        lines.extend(indented(format!("p {} (Holm)", chance(p)), theme.text));
    }
    if !card.ties.is_empty() {
        lines.extend(indented(format!("as well: {}", card.ties.join(", ")), theme.warning));
    }
    lines.extend(indented(verdict(card, word), style));
    lines.push(Line::from(Span::raw("")));
    lines
}

/// How the lab judges a candidate, and why.
pub(super) fn verdict(card: &Card, word: &str) -> String {
    if card.reason.is_empty() { word.to_owned() } else { format!("{word}: {}", card.reason) }
}

pub(super) fn chance(p: f64) -> String {
    if p < 1e-12 {
        "< 1e-12".to_owned()
    } else if p < 0.001 {
        format!("= {p:.0e}")
    } else {
        format!("= {p:.3}")
    }
}

pub(super) fn look(status: CardStatus, theme: &Theme) -> (&'static str, &'static str, Style) {
    match status {
        CardStatus::Named => ("\u{2713}", "named", theme.good),
        CardStatus::Tied => ("~", "tied", theme.warning),
        CardStatus::InModel => ("+", "in the model", theme.good),
        CardStatus::Rejected => ("\u{b7}", "not named", theme.text),
    }
}
