//! Panels as one self-contained SVG picture.

use std::fmt::Write;

use super::panels::{Panel, panels};
use crate::laboratory::Comparison;

const WIDTH: f64 = 300.0;
const HEIGHT: f64 = 170.0;
const ACROSS: usize = 3;

/// Text that cannot break the document.
pub(crate) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// The residuals of a comparison, drawn.
pub fn svg(comparison: &Comparison) -> String {
    let panels = panels(comparison);
    let rows = panels.len().div_ceil(ACROSS);
    let (width, height) = (WIDTH * ACROSS as f64 + 20.0, HEIGHT * rows as f64 + 70.0);
    let mut out = String::new();
    draw(&mut out, comparison, &panels, width, height).unwrap_or_default();
    out
}

fn draw(
    out: &mut String,
    comparison: &Comparison,
    panels: &[Panel],
    width: f64,
    height: f64,
) -> std::fmt::Result {
    writeln!(
        out,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" height=\"{height}\" \
         font-family=\"sans-serif\" font-size=\"11\">"
    )?;
    writeln!(out, "<rect width=\"{width}\" height=\"{height}\" fill=\"white\"/>")?;
    let heading = format!("{} against {}: residuals, mm", comparison.arm, comparison.data);
    writeln!(out, "<text x=\"14\" y=\"22\" font-size=\"15\">{}</text>", escaped(&heading))?;
    writeln!(out, "<text x=\"14\" y=\"40\" fill=\"#444\">{}</text>", escaped(&comparison.sentence))?;
    for (index, panel) in panels.iter().enumerate() {
        let (column, row) = (index % ACROSS, index / ACROSS);
        panel_at(out, panel, 14.0 + WIDTH * column as f64, 52.0 + HEIGHT * row as f64)?;
    }
    writeln!(out, "</svg>")
}

fn panel_at(out: &mut String, panel: &Panel, left: f64, top: f64) -> std::fmt::Result {
    let (width, height) = (WIDTH - 52.0, HEIGHT - 50.0);
    let (x0, y0) = (left + 38.0, top + 18.0);
    let x = |value: f64| x0 + (value - panel.across.0) / (panel.across.1 - panel.across.0) * width;
    let y = |value: f64| y0 + (panel.up.1 - value) / (panel.up.1 - panel.up.0) * height;
    writeln!(out, "<text x=\"{x0:.1}\" y=\"{:.1}\">{}</text>", top + 12.0, escaped(&panel.title))?;
    writeln!(
        out,
        "<rect x=\"{x0:.1}\" y=\"{y0:.1}\" width=\"{width:.1}\" height=\"{height:.1}\" fill=\"#fafafa\" stroke=\"#bbb\"/>"
    )?;
    if let Some(floor) = panel.floor {
        let (high, low) = (y(floor).max(y0), y(-floor).min(y0 + height));
        writeln!(
            out,
            "<rect x=\"{x0:.1}\" y=\"{high:.1}\" width=\"{width:.1}\" height=\"{:.1}\" fill=\"#cfe8cf\"/>",
            low - high
        )?;
    }
    writeln!(out, "<path d=\"M{x0:.1} {:.1}h{width:.1}\" stroke=\"#888\" stroke-width=\"0.6\"/>", y(0.0))?;
    for (across, up, held) in &panel.points {
        if !(across.is_finite() && up.is_finite()) {
            continue;
        }
        let (px, py) = (x(*across), y(up.clamp(panel.up.0, panel.up.1)));
        let outside = *up < panel.up.0 || *up > panel.up.1;
        let style = match (outside, held) {
            (true, _) => "fill=\"none\" stroke=\"#c03030\"",
            (_, true) => "fill=\"white\" stroke=\"#1f5fa0\"",
            (_, false) => "fill=\"#1f5fa0\"",
        };
        writeln!(out, "<circle cx=\"{px:.1}\" cy=\"{py:.1}\" r=\"1.8\" stroke-width=\"0.8\" {style}/>")?;
    }
    let bottom = y0 + height + 13.0;
    writeln!(out, "<text x=\"{x0:.1}\" y=\"{bottom:.1}\" fill=\"#555\">{:.4}</text>", Short(panel.across.0))?;
    let end = format!("{:.4} {}", Short(panel.across.1), panel.unit);
    writeln!(
        out,
        "<text x=\"{:.1}\" y=\"{bottom:.1}\" fill=\"#555\" text-anchor=\"end\">{}</text>",
        x0 + width,
        escaped(&end)
    )?;
    let edge = x0 - 4.0;
    writeln!(
        out,
        "<text x=\"{edge:.1}\" y=\"{:.1}\" fill=\"#555\" text-anchor=\"end\">{:.2}</text>",
        y0 + 9.0,
        Short(panel.up.1)
    )?;
    writeln!(
        out,
        "<text x=\"{edge:.1}\" y=\"{:.1}\" fill=\"#555\" text-anchor=\"end\">{:.2}</text>",
        y0 + height,
        Short(panel.up.0)
    )
}

/// A number with few figures: the precision asked for counts figures, not decimals.
struct Short(f64);

impl std::fmt::Display for Short {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let figures = formatter.precision().unwrap_or(3) as f64;
        let size = self.0.abs().max(1e-12).log10().floor();
        let decimals = (figures - 1.0 - size).clamp(0.0, 9.0) as usize;
        write!(formatter, "{:.*}", decimals, self.0)
    }
}
