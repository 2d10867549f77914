//! Panels as one self-contained SVG picture.

use std::fmt::Write;

use super::drawing::{CURVE, Links, NOISE, OUTSIDE, POINT, Short, escaped, point};
use super::panels::{Dot, Panel, panels};
use crate::words::comparison_sentence;
use plumb_diagnosis::laboratory::Comparison;

const WIDTH: f64 = 320.0;
const HEIGHT: f64 = 214.0;
const ACROSS: usize = 3;

/// Room of a panel beside its frame: left for the numbers and the title of the vertical axis, above for the title, below for the horizontal axis.
const LEFT: f64 = 56.0;
const ABOVE: f64 = 20.0;
const BELOW: f64 = 38.0;

/// Longest title that fits over a panel, or beside it, in characters of the picture's size.
const LONGEST: usize = 48;
const LONGEST_BESIDE: usize = 30;

/// The residuals of a comparison, drawn.
pub fn svg(comparison: &Comparison) -> String {
    let heading = format!("{} against {}: residuals, {}", comparison.arm, comparison.data, comparison.unit);
    grid(&panels(comparison), &[heading, comparison_sentence(comparison)], Links::Nowhere)
}

/// Panels side by side, with lines of text above.
pub(crate) fn grid(panels: &[Panel], heading: &[String], links: Links) -> String {
    let rows = panels.len().div_ceil(ACROSS);
    let top = 12.0 + 18.0 * heading.len() as f64;
    let across = panels.len().clamp(1, ACROSS) as f64;
    // A heading needs room beside few panels too.
    let width = (WIDTH * if heading.is_empty() { across } else { ACROSS as f64 }) + 10.0;
    let height = HEIGHT * rows as f64 + top + 4.0;
    let mut out = String::new();
    draw(&mut out, panels, heading, (width, height, top), links).unwrap_or_default();
    out
}

fn draw(
    out: &mut String,
    panels: &[Panel],
    heading: &[String],
    (width, height, top): (f64, f64, f64),
    links: Links,
) -> std::fmt::Result {
    writeln!(
        out,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" height=\"{height}\" \
         font-family=\"sans-serif\" font-size=\"11\">"
    )?;
    writeln!(out, "<rect width=\"{width}\" height=\"{height}\" fill=\"white\"/>")?;
    for (index, line) in heading.iter().enumerate() {
        let style = if index == 0 { "font-size=\"15\"" } else { "fill=\"#444\"" };
        writeln!(
            out,
            "<text x=\"14\" y=\"{:.0}\" {style}>{}</text>",
            22.0 + 18.0 * index as f64,
            escaped(line)
        )?;
    }
    for (index, panel) in panels.iter().enumerate() {
        let (column, row) = (index % ACROSS, index / ACROSS);
        panel_at(out, panel, (6.0 + WIDTH * column as f64, top + HEIGHT * row as f64), links)?;
    }
    writeln!(out, "</svg>")
}

/// The frame of a panel: where it is and what its edges mean.
struct Frame {
    left: f64,
    top: f64,
    width: f64,
    height: f64,
    across: (f64, f64),
    up: (f64, f64),
}

impl Frame {
    fn of(panel: &Panel, (left, top): (f64, f64)) -> Self {
        let (width, height) = (WIDTH - LEFT - 10.0, HEIGHT - ABOVE - BELOW);
        let across = match panel.one_scale {
            // As wide as the frame is against its height.
            true => {
                let half = 0.5 * (panel.up.1 - panel.up.0) * width / height;
                (-half, half)
            }
            false => panel.across,
        };
        Self { left: left + LEFT, top: top + ABOVE, width, height, across, up: panel.up }
    }

    fn x(&self, value: f64) -> f64 {
        self.left + (value - self.across.0) / (self.across.1 - self.across.0) * self.width
    }

    fn y(&self, value: f64) -> f64 {
        self.top + (self.up.1 - value) / (self.up.1 - self.up.0) * self.height
    }

    /// Where a point is drawn, and whether it lies outside and is drawn on the rim.
    fn position(&self, dot: &Dot) -> ((f64, f64), bool) {
        let (across, up) =
            (dot.across.clamp(self.across.0, self.across.1), dot.up.clamp(self.up.0, self.up.1));
        ((self.x(across), self.y(up)), across != dot.across || up != dot.up)
    }
}

fn panel_at(out: &mut String, panel: &Panel, corner: (f64, f64), links: Links) -> std::fmt::Result {
    let frame = Frame::of(panel, corner);
    let Frame { left, top, width, height, .. } = frame;
    writeln!(
        out,
        "<text x=\"{left:.1}\" y=\"{:.1}\" font-weight=\"bold\">{}</text>",
        top - 6.0,
        escaped(&cut(&panel.title, LONGEST))
    )?;
    writeln!(
        out,
        "<rect x=\"{left:.1}\" y=\"{top:.1}\" width=\"{width:.1}\" height=\"{height:.1}\" fill=\"#fafafa\" stroke=\"#bbb\"/>"
    )?;
    noise(out, panel, &frame)?;
    writeln!(
        out,
        "<path d=\"M{left:.1} {:.1}h{width:.1}\" stroke=\"#888\" stroke-width=\"0.6\"/>",
        frame.y(0.0)
    )?;
    for dot in panel.points.iter().filter(|dot| dot.across.is_finite() && dot.up.is_finite()) {
        let (position, outside) = frame.position(dot);
        let style = match (outside, dot.held_out) {
            (true, _) => format!("fill=\"none\" stroke=\"{OUTSIDE}\""),
            (_, true) => format!("fill=\"white\" stroke=\"{POINT}\""),
            (_, false) => format!("fill=\"{POINT}\""),
        };
        point(out, position, 1.8, &style, dot.line, links)?;
    }
    curve(out, panel, &frame)?;
    axes(out, panel, &frame)
}

/// The noise: a band about zero, or a ring where both axes are errors.
fn noise(out: &mut String, panel: &Panel, frame: &Frame) -> std::fmt::Result {
    let Some(floor) = panel.floor else { return Ok(()) };
    if panel.one_scale {
        return writeln!(
            out,
            "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"{:.1}\" fill=\"{NOISE}\"/>",
            frame.x(0.0),
            frame.y(0.0),
            (frame.y(0.0) - frame.y(floor)).min(0.5 * frame.height)
        );
    }
    let (high, low) =
        (frame.y(floor).max(frame.top), frame.y(-floor.min(-frame.up.0)).min(frame.top + frame.height));
    writeln!(
        out,
        "<rect x=\"{:.1}\" y=\"{high:.1}\" width=\"{:.1}\" height=\"{:.1}\" fill=\"{NOISE}\"/>",
        frame.left,
        frame.width,
        (low - high).max(0.0)
    )
}

/// The fitted curve over the points.
fn curve(out: &mut String, panel: &Panel, frame: &Frame) -> std::fmt::Result {
    let points: Vec<String> = panel
        .curve
        .iter()
        .filter(|point| point.0.is_finite() && point.1.is_finite())
        .map(|point| format!("{:.1},{:.1}", frame.x(point.0), frame.y(point.1.clamp(frame.up.0, frame.up.1))))
        .collect();
    if points.len() < 2 {
        return Ok(());
    }
    writeln!(
        out,
        "<polyline class=\"curve\" points=\"{}\" fill=\"none\" stroke=\"{CURVE}\" stroke-width=\"2\"/>",
        points.join(" ")
    )
}

/// A text beside an axis, `anchor`ed at a place, px.
fn text(x: f64, y: f64, anchor: &str, text: &str) -> String {
    format!("<text x=\"{x:.1}\" y=\"{y:.1}\" fill=\"#555\" text-anchor=\"{anchor}\">{}</text>", escaped(text))
}

/// The ends of both axes and what they show.
fn axes(out: &mut String, panel: &Panel, frame: &Frame) -> std::fmt::Result {
    let (right, bottom) = (frame.left + frame.width, frame.top + frame.height);
    let low = format!("{:.3}", Short(frame.across.0));
    writeln!(out, "{}", text(frame.left, bottom + 13.0, "start", &low))?;
    let high = format!("{:.3}", Short(frame.across.1));
    writeln!(out, "{}", text(right, bottom + 13.0, "end", &high))?;
    let middle = 0.5 * (frame.left + right);
    writeln!(out, "{}", text(middle, bottom + 26.0, "middle", &cut(&panel.across_title, LONGEST)))?;
    let edge = frame.left - 4.0;
    writeln!(out, "{}", text(edge, frame.top + 9.0, "end", &format!("{:.2}", Short(frame.up.1))))?;
    writeln!(out, "{}", text(edge, bottom, "end", &format!("{:.2}", Short(frame.up.0))))?;
    if frame.up.0 < 0.0 {
        writeln!(out, "{}", text(edge, frame.y(0.0) + 4.0, "end", "0"))?;
    }
    let (x, y) = (frame.left - LEFT + 11.0, frame.top + 0.5 * frame.height);
    writeln!(
        out,
        "<text x=\"{x:.1}\" y=\"{y:.1}\" fill=\"#555\" text-anchor=\"middle\" font-size=\"9.5\" transform=\"rotate(-90 {x:.1} {y:.1})\">{}</text>",
        lines_beside(&panel.up_title, x)
    )
}

/// A title beside a panel, in two lines where it is long.
fn lines_beside(title: &str, x: f64) -> String {
    if title.chars().count() <= LONGEST_BESIDE {
        return escaped(title);
    }
    let middle = title.len() / 2;
    // At the word nearest the middle, so that both lines are about as long.
    let split = title.match_indices(' ').map(|(at, _)| at).min_by_key(|at| at.abs_diff(middle));
    match split {
        Some(at) => format!(
            "<tspan x=\"{x:.1}\">{}</tspan><tspan x=\"{x:.1}\" dy=\"10\">{}</tspan>",
            escaped(title.get(..at).unwrap_or(title)),
            escaped(title.get(at + 1..).unwrap_or(""))
        ),
        None => escaped(title),
    }
}

/// A title cut to a length, with an ellipsis where something was cut away.
fn cut(title: &str, most: usize) -> String {
    if title.chars().count() <= most {
        return title.to_owned();
    }
    let kept: String = title.chars().take(most - 1).collect();
    format!("{kept}\u{2026}")
}
