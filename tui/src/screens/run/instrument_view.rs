//! Draws what an operator reads beside a simulated arm while it is jogged: the bubble of a spirit level, a ruler on the table.

use ratatui::text::Line;

use crate::screens::theme::Theme;

/// What a tilt puts the bubble at the end of its tube, deg.
const END_OF_THE_TUBE_DEG: f64 = 2.0;
/// Characters from the middle of the tube to its end: the most that fits is drawn.
const HALF_TUBES: [i32; 3] = [10, 6, 3];

/// The bubble of the simulated spirit level: to the right where the end its arrow points to is the higher one.
pub(super) fn bubble_line(level: Option<f64>, theme: &Theme, width: usize) -> Line<'static> {
    longest_that_fits(HALF_TUBES.map(|half| bubble_in_tube(level, half, theme)), width)
}

/// The first of lines that get shorter which is no longer than this; where none is, the last.
fn longest_that_fits<const N: usize>(lines: [Line<'static>; N], width: usize) -> Line<'static> {
    let shortest = lines.last().cloned().unwrap_or_default();
    lines.into_iter().find(|line| line.width() <= width).unwrap_or(shortest)
}

fn bubble_in_tube(level: Option<f64>, half: i32, theme: &Theme) -> Line<'static> {
    let Some(tilt) = level else {
        return Line::styled("level: the bubble is at an end", theme.warning);
    };
    let fraction = (tilt / END_OF_THE_TUBE_DEG).clamp(-1.0, 1.0);
    let bubble = (fraction * f64::from(half)).round() as i32;
    let sign = |column: i32| match column {
        column if column == bubble => '\u{25cf}',
        0 => '|',
        _ => '\u{2500}',
    };
    let tube: String = (-half..=half).map(sign).collect();
    let style = if bubble == 0 { theme.good } else { theme.text };
    Line::styled(format!("level [{tube}] {tilt:+.2} deg"), style)
}

/// Characters of a ruler between its ends, a multiple of four: the most that fits is drawn.
const RULERS: [u32; 4] = [20, 16, 12, 8];
/// Ends of rulers, mm.
const ENDS_MM: [f64; 6] = [50.0, 100.0, 200.0, 500.0, 1000.0, 2000.0];

/// A ruler that is on the table beside the arm, laid on its side: 0 at the left, a stroke every quarter, and how high the arm is.
pub(super) fn ruler_line(height_mm: f64, theme: &Theme, width: usize) -> Line<'static> {
    longest_that_fits(RULERS.map(|long| ruler_of(height_mm, long, theme)), width)
}

fn ruler_of(height_mm: f64, long: u32, theme: &Theme) -> Line<'static> {
    let longest = ENDS_MM.last().copied().unwrap_or_default();
    let end = ENDS_MM.iter().copied().find(|end| height_mm <= *end).unwrap_or(longest);
    let mark = (height_mm / end * f64::from(long)).round().clamp(0.0, f64::from(long)) as u32;
    let sign = |index: u32| match index {
        index if index == mark => '\u{25bc}',
        index if index.is_multiple_of(long / 4) => '|',
        _ => '\u{2500}',
    };
    let strip: String = (0..=long).map(sign).collect();
    if height_mm < 0.0 {
        return Line::styled(format!("ruler 0{strip}{end:.0}: BELOW the table"), theme.bad);
    }
    Line::styled(format!("ruler 0{strip}{end:.0}: {height_mm:.1} mm high"), theme.text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mark_is_where_the_arm_is_on_the_shortest_ruler_that_reaches_it() {
        let shown = |height: f64| ruler_line(height, &Theme::plain(), 60).to_string();
        assert_eq!(
            shown(25.0),
            "ruler 0|\u{2500}\u{2500}\u{2500}\u{2500}|\u{2500}\u{2500}\u{2500}\u{2500}\u{25bc}\u{2500}\u{2500}\u{2500}\u{2500}|\u{2500}\u{2500}\u{2500}\u{2500}|50: 25.0 mm high"
        );
        assert!(shown(50.1).contains("|100: 50.1 mm high"), "{}", shown(50.1));
        assert!(shown(-0.2).starts_with("ruler 0\u{25bc}") && shown(-0.2).ends_with("BELOW the table"));
        assert!(shown(2500.0).contains("\u{25bc}2000: 2500.0 mm high"), "{}", shown(2500.0));
    }

    #[test]
    fn instruments_are_drawn_smaller_where_there_is_no_room_and_their_numbers_stay() {
        let theme = Theme::plain();
        for width in [34, 40, 60] {
            let (ruler, bubble) = (ruler_line(28.7, &theme, width), bubble_line(Some(0.25), &theme, width));
            assert!(ruler.width() <= width && ruler.to_string().ends_with("50: 28.7 mm high"), "{ruler}");
            assert!(bubble.width() <= width && bubble.to_string().ends_with("+0.25 deg"), "{bubble}");
        }
    }
}
