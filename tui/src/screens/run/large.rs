//! The prompt in letters four rows high, to be read from where the arm is.

use font8x8::{BASIC_FONTS, LATIN_FONTS, UnicodeFonts as _};
use plumb_cell::prompt::PromptKind;
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::text::Line;
use ratatui::widgets::Paragraph;

use super::prompt::OpenPrompt;
use super::prompt_view::{Labels, controls, note_hits, option_rows, question};
use crate::screens::hits::Hits;
use crate::screens::pane;
use crate::screens::theme::Theme;

/// Columns and rows of one letter: eight by eight pixels, four to a character cell.
const LETTER: (usize, usize) = (4, 4);

/// The sixteen ways to fill the quarters of a cell; bit 0 upper left, 1 upper right, 2 lower left, 3 lower right.
const QUARTERS: [char; 16] = [
    ' ', '\u{2598}', '\u{259d}', '\u{2580}', '\u{2596}', '\u{258c}', '\u{259e}', '\u{259b}', '\u{2597}',
    '\u{259a}', '\u{2590}', '\u{259c}', '\u{2584}', '\u{2599}', '\u{259f}', '\u{2588}',
];

/// Draws the prompt over the whole page: the question in large letters, what the operator works with below it.
pub(crate) fn view(prompt: &OpenPrompt, theme: &Theme, hits: &Hits, frame: &mut Frame, area: Rect) {
    let inner = pane::open(frame, area, theme, &prompt.prompt.title, true);
    let width = usize::from(inner.width);
    let controls = controls(prompt, None, theme, width, Labels::OneLine);
    let rows = u16::try_from(controls.len()).unwrap_or(u16::MAX).min(inner.height);
    let [above, below] = Layout::vertical([Constraint::Fill(1), Constraint::Length(rows)]).areas(inner);
    let letters = usize::from(above.width) / LETTER.0;
    let question = question(prompt, usize::MAX).join(" ");
    let text: Vec<String> = position_text(prompt).into_iter().chain([question]).collect();
    let lines: Vec<Line> =
        cut(pane::wrapped(&text.join("\n"), letters), usize::from(above.height) / LETTER.1, letters)
            .iter()
            .flat_map(|line| enlarged(line))
            .map(|row| Line::styled(row, theme.heading))
            .collect();
    frame.render_widget(Paragraph::new(lines), above);
    frame.render_widget(Paragraph::new(controls), below);
    note_hits(prompt, Labels::OneLine, &option_rows(prompt, width, Labels::OneLine), 0, 0, hits, below);
}

/// As many lines as there is room for; the last says by dots that there is more.
fn cut(mut lines: Vec<String>, room: usize, letters: usize) -> Vec<String> {
    const MORE: &str = "...";
    if lines.len() <= room {
        return lines;
    }
    lines.truncate(room);
    if let Some(last) = lines.last_mut() {
        let kept: String = last.chars().take(letters.saturating_sub(MORE.len())).collect();
        *last = format!("{}{MORE}", kept.trim_end());
    }
    lines
}

/// For a jog, the joint and where it is, which is what one wants to read at the arm.
fn position_text(prompt: &OpenPrompt) -> Option<String> {
    let PromptKind::JogTo { joints, .. } = &prompt.prompt.kind else { return None };
    joints.get(prompt.chosen).map(|joint| format!("{} {:.1} {}", joint.name, joint.value, joint.unit))
}

/// One line of text as rows of block characters.
fn enlarged(text: &str) -> Vec<String> {
    let glyphs: Vec<[u8; 8]> = text.chars().map(glyph).collect();
    (0..LETTER.1)
        .map(|row| {
            glyphs
                .iter()
                .flat_map(|glyph| cells(glyph.get(2 * row..2 * row + 2).unwrap_or(&[0, 0])))
                .collect()
        })
        .collect()
}

/// The four cells of two rows of pixels of a letter.
fn cells(pixels: &[u8]) -> impl Iterator<Item = char> {
    let (upper, lower) = (pixels.first().copied().unwrap_or(0), pixels.get(1).copied().unwrap_or(0));
    (0..LETTER.0).map(move |column| {
        let quarter = |row: u8| usize::from(row >> (2 * column) & 0b11);
        QUARTERS.get(quarter(upper) | quarter(lower) << 2).copied().unwrap_or(' ')
    })
}

/// The pixels of a letter, a byte a row, the lowest bit at the left; a question mark where the font has none.
fn glyph(letter: char) -> [u8; 8] {
    let plain = match letter {
        '\u{2018}' | '\u{2019}' => '\'',
        '\u{201c}' | '\u{201d}' => '"',
        '\u{2013}' | '\u{2014}' | '\u{2212}' => '-',
        other => other,
    };
    BASIC_FONTS
        .get(plain)
        .or_else(|| LATIN_FONTS.get(plain))
        .or_else(|| BASIC_FONTS.get('?'))
        .unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sentence_that_is_cut_says_so() {
        let lines = || ["Move the hand", "nearer, or", "abort."].map(str::to_owned).to_vec();
        assert_eq!(cut(lines(), 3, 13), lines());
        assert_eq!(cut(lines(), 2, 13), ["Move the hand", "nearer, or..."]);
        assert_eq!(cut(lines(), 1, 13), ["Move the h..."]);
    }

    #[test]
    fn letters_are_four_rows_high_and_four_columns_wide() {
        let rows = enlarged("9.5");
        assert_eq!(rows.len(), 4);
        assert!(rows.iter().all(|row| row.chars().count() == 12), "{rows:?}");
        assert_eq!(
            enlarged("I").concat(),
            "\u{259d}\u{2588}\u{2598}  \u{2588}   \u{2588}  \u{259d}\u{2580}\u{2598} "
        );
    }
}
