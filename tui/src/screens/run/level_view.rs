//! Draws a spirit level that is being read along two axes: where its bubble would be for what is typed.

use plumb_cell::answers::level_readings;
use ratatui::text::{Line, Span};

use super::prompt::OpenPrompt;
use crate::screens::pane::wrapped;
use crate::screens::theme::Theme;

/// Rows and columns from the middle of the level to its rim.
const ROWS: i32 = 2;
const COLUMNS: i32 = 6;

/// The level, the field, and what would be right.
pub(super) fn level(prompt: &OpenPrompt, most: f64, theme: &Theme, width: usize) -> Vec<Line<'static>> {
    let read = level_readings(&prompt.field).ok();
    let bubble = read.map(|(x, y)| (cells_from_middle(x, most, COLUMNS), cells_from_middle(y, most, ROWS)));
    let mut lines: Vec<Line<'static>> =
        (-ROWS - 1..=ROWS + 1).map(|row| Line::styled(drawn(-row, bubble), theme.text)).collect();
    let frame = |sign: &'static str| Span::styled(sign, theme.focus);
    lines.push(Line::from(vec![
        frame("\u{2590} "),
        Span::styled(prompt.field.clone(), theme.heading),
        Span::styled("\u{2588}", theme.focus),
        Span::styled("  deg: x, a blank, y", theme.heading),
    ]));
    if prompt.refused.is_none() {
        let hint = format!(
            "how much higher the end is that the axis points to, -{most} to {most}; the bubble goes to the higher end \u{b7} Enter answers"
        );
        lines.extend(wrapped(&hint, width).into_iter().map(|line| Line::styled(line, theme.faint)));
    }
    lines
}

/// Where a reading puts the bubble, in cells from the middle: at the rim for the most the level shows.
fn cells_from_middle(reading: f64, most: f64, rim: i32) -> i32 {
    ((reading / most).clamp(-1.0, 1.0) * f64::from(rim)).round() as i32
}

/// One row of the level, counted upwards from its middle.
fn drawn(row: i32, bubble: Option<(i32, i32)>) -> String {
    let mut text = String::from("  ");
    for column in -COLUMNS - 1..=COLUMNS + 1 {
        let rim = column.abs() > COLUMNS || row.abs() > ROWS;
        text.push(match bubble {
            Some((x, y)) if (x, y) == (column, row) => '\u{25cf}',
            _ if rim && row.abs() > ROWS && column.abs() > COLUMNS => '\u{b7}',
            _ if row.abs() > ROWS => '\u{2500}',
            _ if rim => '\u{2502}',
            _ if (column, row) == (0, 0) => '+',
            _ => ' ',
        });
    }
    match row {
        0 => text.push_str(" x"),
        _ if row > ROWS => text.push_str(" y up"),
        _ => {}
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bubble_goes_to_the_higher_end_and_not_beyond_the_rim() {
        assert_eq!(
            (cells_from_middle(10.0, 10.0, COLUMNS), cells_from_middle(-20.0, 10.0, ROWS)),
            (COLUMNS, -ROWS)
        );
        let found = |x: f64, y: f64| {
            let bubble = Some((cells_from_middle(x, 10.0, COLUMNS), cells_from_middle(y, 10.0, ROWS)));
            (-ROWS..=ROWS).find_map(|row| {
                let column = drawn(row, bubble).chars().position(|sign| sign == '\u{25cf}')?;
                Some((row, column))
            })
        };
        let (Some((row, column)), Some((up, right))) = (found(0.0, 0.0), found(5.0, 10.0)) else {
            panic!("the bubble is drawn");
        };
        assert!(up > row && right > column, "{up} {right}");
    }
}
