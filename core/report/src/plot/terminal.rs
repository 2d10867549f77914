//! Panels in a terminal, drawn with Braille dots.

use super::panels::{Panel, panels};
use plumb_diagnosis::laboratory::Comparison;

const LINES: usize = 8;

/// A grid of Braille cells, two dots wide and four high each.
struct Dots {
    width: usize,
    cells: Vec<u8>,
}

impl Dots {
    fn new(width: usize, lines: usize) -> Self {
        Self { width, cells: vec![0; width * lines] }
    }

    fn set(&mut self, x: usize, y: usize) {
        const BITS: [[u8; 2]; 4] = [[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]];
        let bit = BITS[y % 4][x % 2];
        if x / 2 < self.width
            && let Some(cell) = self.cells.get_mut(y / 4 * self.width + x / 2)
        {
            *cell |= bit;
        }
    }

    fn line(&self, line: usize) -> String {
        let cells = self.cells.get(line * self.width..(line + 1) * self.width).unwrap_or(&[]);
        cells.iter().map(|cell| char::from_u32(0x2800 + u32::from(*cell)).unwrap_or(' ')).collect()
    }
}

/// The residuals of a comparison as text `width` columns wide, two panels side by side where there is room.
pub fn terminal(comparison: &Comparison, width: usize) -> String {
    let side_by_side = if width >= 60 { 2 } else { 1 };
    let each = (width / side_by_side).saturating_sub(2).max(12);
    let mut out = String::new();
    for pair in panels(comparison).chunks(side_by_side) {
        let drawn: Vec<Vec<String>> = pair.iter().map(|panel| lines(panel, each)).collect();
        for line in 0..LINES + 2 {
            let parts: Vec<&str> =
                drawn.iter().filter_map(|lines| lines.get(line).map(String::as_str)).collect();
            out.push_str(parts.join("  ").trim_end());
            out.push('\n');
        }
    }
    out
}

fn fitted(text: &str, width: usize) -> String {
    let short: String = text.chars().take(width).collect();
    format!("{short:width$}")
}

fn lines(panel: &Panel, width: usize) -> Vec<String> {
    let inner = width.saturating_sub(8);
    let mut dots = Dots::new(inner, LINES);
    let (columns, rows) = ((2 * inner) as f64, (4 * LINES) as f64);
    for (across, up) in panel.points.iter().map(|dot| (dot.across, dot.up)) {
        if across.is_finite() && up.is_finite() {
            let x = (across - panel.across.0) / (panel.across.1 - panel.across.0) * (columns - 1.0);
            let y =
                (panel.up.1 - up.clamp(panel.up.0, panel.up.1)) / (panel.up.1 - panel.up.0) * (rows - 1.0);
            dots.set(x.round().max(0.0) as usize, y.round().max(0.0) as usize);
        }
    }
    let mut all = vec![fitted(&panel.up_title, width)];
    // The row of dots in which no error lies.
    let zero = if panel.up.0 < 0.0 { LINES / 2 } else { LINES - 1 };
    for line in 0..LINES {
        let label = match line {
            0 => format!("{:7.3}", panel.up.1),
            _ if line == zero => format!("{:>7}", "0"),
            _ if line == LINES - 1 => format!("{:7.3}", panel.up.0),
            _ => " ".repeat(7),
        };
        let middle = if line == zero { '\u{253c}' } else { '\u{2502}' };
        all.push(fitted(&format!("{label}{middle}{}", dots.line(line)), width));
    }
    let (low, high) = (format!("{:.1}", panel.across.0), format!("{:.1}", panel.across.1));
    let room = inner.saturating_sub(low.chars().count() + high.chars().count() + 2);
    let title: String = panel.across_title.chars().take(room).collect();
    all.push(fitted(&format!("        {low} {title:^room$} {high}"), width));
    all
}
