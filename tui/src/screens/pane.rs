//! The frame around a part of a page.

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::text::{Line, Span};
use ratatui::widgets::{Block, BorderType};

use super::theme::Theme;

/// Draws the frame of a pane with its title and gives the room inside. A pane too small for a frame has none; `focus`
/// marks the pane that waits for the operator.
pub(crate) fn open(frame: &mut Frame, area: Rect, theme: &Theme, title: &str, focus: bool) -> Rect {
    if area.height < 3 || area.width < 6 {
        return area;
    }
    // Between the corners, with a blank before it, and one behind it where there is room.
    let room = usize::from(area.width).saturating_sub(3);
    let title =
        if columns(title) < room { format!(" {title} ") } else { format!(" {}", fitted(title, room)) };
    let (border, heading) = if focus { (theme.focus, theme.focus) } else { (theme.faint, theme.heading) };
    let block = Block::bordered()
        .border_type(if focus { BorderType::Thick } else { BorderType::Rounded })
        .border_style(border)
        .title(Line::from(Span::styled(title, heading)));
    let inner = block.inner(area);
    frame.render_widget(block, area);
    inner
}

/// `text` cut to `width` columns, with an ellipsis where something was cut away.
pub(crate) fn fitted(text: &str, width: usize) -> String {
    if Span::raw(text).width() <= width {
        return text.to_owned();
    }
    let mut fitted = String::new();
    for character in text.chars() {
        fitted.push(character);
        if Span::raw(fitted.as_str()).width() >= width {
            fitted.pop();
            break;
        }
    }
    if width > 0 {
        fitted.push('\u{2026}');
    }
    fitted
}

/// The lines of a table or a drawing in a room of `width` columns: one that is longer ends in an ellipsis.
pub(crate) fn marked(lines: Vec<Line<'static>>, width: usize) -> Vec<Line<'static>> {
    lines.into_iter().map(|line| if line.width() <= width { line } else { cut(&line, width) }).collect()
}

/// A line that is longer than `width` columns, cut.
fn cut(line: &Line<'static>, width: usize) -> Line<'static> {
    let mut room = width;
    let mut spans = Vec::new();
    for span in &line.spans {
        let shown = span.width();
        // What ends just at the edge gives its last column to the mark: more follows.
        if shown < room {
            room -= shown;
            spans.push(span.clone());
        } else {
            let text = fitted(&format!("{}\u{2026}", span.content), room);
            spans.push(Span::styled(text, span.style));
            break;
        }
    }
    Line { spans, ..line.clone() }
}

/// `text` with its lines as written, but long ones that break off within a sentence joined with the next: texts in files
/// are broken for the file's width, not for the screen's. The lines of a drawing stay as they are.
pub(crate) fn reflowed(text: &str) -> String {
    let mut flowed = String::new();
    let mut before = "";
    for line in text.lines().map(|line| if is_drawn(line) { line.trim_end() } else { line.trim() }) {
        if !flowed.is_empty() {
            let sentences = !is_drawn(before) && !is_drawn(line);
            let long = if begins_with_a_number(line) { LONG_BEFORE_A_NUMBER } else { LONG };
            let breaks_off =
                sentences && columns(before) >= long && !before.ends_with(['.', ':', ';', '!', '?']);
            flowed.push(if breaks_off && !line.is_empty() { ' ' } else { '\n' });
        }
        flowed.push_str(line);
        before = line;
    }
    flowed
}

/// Whether a line's spaces are part of a drawing or a table: no sentence has two in a row.
fn is_drawn(line: &str) -> bool {
    line.trim_end().contains("  ")
}

/// A line of a file from here on was broken for its length.
const LONG: usize = 60;
/// The same where a number is at the beginning of the next: values in place of long names have made it shorter.
const LONG_BEFORE_A_NUMBER: usize = 40;

fn begins_with_a_number(line: &str) -> bool {
    line.trim_start_matches(['-', '+', '\u{2212}']).starts_with(|first: char| first.is_ascii_digit())
}

/// `text` broken into lines of at most `width` columns, between words where that can be; its own line breaks stay, and so do the spaces of a drawing that
/// fits.
pub(crate) fn wrapped(text: &str, width: usize) -> Vec<String> {
    let width = width.max(1);
    let mut lines = Vec::new();
    for paragraph in text.lines() {
        let drawn = paragraph.trim_end();
        if is_drawn(drawn) && columns(drawn) <= width {
            lines.push(drawn.to_owned());
            continue;
        }
        let mut line = String::new();
        for word in paragraph.split_whitespace() {
            if !line.is_empty() && columns(&line) + 1 + columns(word) > width {
                lines.push(std::mem::take(&mut line));
            }
            if !line.is_empty() {
                line.push(' ');
            }
            line.push_str(word);
            while columns(&line) > width {
                let rest: String = line.chars().skip(width).collect();
                lines.push(line.chars().take(width).collect());
                line = rest;
            }
        }
        lines.push(line);
    }
    lines
}

/// `text` cut into lines of at most `width` columns with its spaces kept, as tables need it; what did not fit follows
/// indented.
pub(crate) fn folded(text: &str, width: usize) -> Vec<String> {
    const INDENT: &str = "      ";
    let mut lines = vec![String::new()];
    for character in text.chars() {
        let full = lines
            .last()
            .is_some_and(|line| columns(line) + columns(character.encode_utf8(&mut [0; 4])) > width);
        if full && width > INDENT.len() {
            let rest = lines.last_mut().map_or_else(String::new, |line| cut_at_blank(line, width));
            lines.push(format!("{INDENT}{rest}"));
        } else if full {
            break;
        }
        if let Some(line) = lines.last_mut() {
            line.push(character);
        }
    }
    lines
}

/// Takes what is behind the last blank off a line, so that no word or number is broken; nothing where the blank is too far to the left.
fn cut_at_blank(line: &mut String, width: usize) -> String {
    let indented = line.len() - line.trim_start().len();
    match line.rfind(' ') {
        Some(blank) if blank > indented && columns(line.get(..blank).unwrap_or_default()) > width / 2 => {
            let rest = line.split_off(blank);
            rest.trim_start().to_owned()
        }
        _ => String::new(),
    }
}

/// A bar `width` columns long, filled up to `fraction` (0 to 1).
pub(crate) fn bar(fraction: f64, width: usize) -> String {
    // Between 0 and the width.
    let filled = (fraction.clamp(0.0, 1.0) * width as f64).round() as usize;
    format!("{}{}", "\u{2588}".repeat(filled), "\u{2591}".repeat(width.saturating_sub(filled)))
}

/// Columns a text takes on the screen.
pub(crate) fn columns(text: &str) -> usize {
    Span::raw(text).width()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_break_between_words_and_long_words_break_inside() {
        assert_eq!(wrapped("hold the level", 8), ["hold the", "level"]);
        assert_eq!(wrapped("abcdefghij", 4), ["abcd", "efgh", "ij"]);
        assert_eq!(wrapped("one\n\ntwo", 10), ["one", "", "two"]);
        assert_eq!(wrapped("anything", 0).len(), 8);
    }

    #[test]
    fn lines_that_break_off_within_a_sentence_are_joined() {
        let long = "Bring the hand over the white paper beside the T, one to five centimetres";
        assert_eq!(reflowed(&format!("{long}\nup.\nFix it.")), format!("{long} up.\nFix it."));
        assert_eq!(
            reflowed("zero of waist: 1 deg\nzero of elbow: 2 deg"),
            "zero of waist: 1 deg\nzero of elbow: 2 deg"
        );
        assert_eq!(reflowed(&format!("{long}\n\nup")), format!("{long}\n\nup"));
        let values = "Shown: waist 8.0, shoulder 41.0, elbow -78.0, wrist pitch";
        assert_eq!(reflowed(&format!("{values}\n-90.0 degrees.")), format!("{values} -90.0 degrees."));
    }

    #[test]
    fn the_lines_of_a_drawing_keep_their_spaces() {
        let drawing = "Stand the ruler upright.\n\nfrom the side   from above\n    @....o         o@\n         #         #\no joint";
        assert_eq!(reflowed(drawing), drawing);
        assert_eq!(wrapped(drawing, 40).join("\n"), drawing);
        assert!(wrapped(drawing, 12).iter().all(|line| columns(line) <= 12), "what does not fit is broken");
    }

    #[test]
    fn a_folded_line_keeps_its_spaces_and_goes_on_indented() {
        assert_eq!(folded("  waist     1.7 deg", 40), ["  waist     1.7 deg"]);
        assert_eq!(folded("a  bcdefghijkl", 9), ["a  bcdefg", "      hij", "      kl"]);
        assert_eq!(folded("abcdef", 3), ["abc"]);
        let line = "zero of waist 1.7000 deg (less than 0.0001 deg)";
        assert_eq!(folded(line, 39), ["zero of waist 1.7000 deg (less than", "      0.0001 deg)"]);
    }

    #[test]
    fn what_does_not_fit_ends_in_an_ellipsis() {
        assert_eq!(fitted("shoulder", 8), "shoulder");
        assert_eq!(fitted("shoulder", 5), "shou\u{2026}");
        assert_eq!(fitted("shoulder", 1), "\u{2026}");
        assert_eq!(fitted("shoulder", 0), "");
    }

    #[test]
    fn a_line_of_several_parts_that_does_not_fit_ends_in_an_ellipsis() {
        let line = || Line::from(vec![Span::raw("jog "), Span::raw("by 1"), Span::raw(" deg")]);
        let shown = |width: usize| marked(vec![line()], width)[0].to_string();
        assert_eq!(shown(12), "jog by 1 deg");
        assert_eq!(shown(11), "jog by 1 d\u{2026}");
        assert_eq!(shown(8), "jog by \u{2026}");
        assert_eq!(shown(4), "jog\u{2026}");
        assert_eq!(shown(0), "");
    }
}
