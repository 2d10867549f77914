//! Pictures of series, drawn here as SVG: a browser needs nothing from elsewhere to show them. Colours come from the page's style sheet.

use std::fmt::Write as _;

use plumb_central::{CellValues, ControlLimits};
use plumb_document::counted;

use super::print::number;
use super::words::day_number;
use crate::web::escaped;

/// Width of a picture in its own units; the page scales it.
const WIDTH: f64 = 640.0;

/// Height of one cell's trend.
const HEIGHT: f64 = 150.0;

/// Room for numbers at the left, and for days below.
const LEFT: f64 = 96.0;
const BELOW: f64 = 22.0;
const MARGIN: f64 = 10.0;

/// Height of a cell's row where cells are beside each other.
const ROW: f64 = 26.0;

/// The least and the largest of some values, with a margin; something to draw on where all are alike.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Range {
    least: f64,
    most: f64,
}

impl Range {
    pub(super) fn of(values: impl Iterator<Item = f64>) -> Self {
        let ends = values
            .filter(|value| value.is_finite())
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), value| {
                (least.min(value), most.max(value))
            });
        match ends {
            (least, most) if least > most => Self { least: -1.0, most: 1.0 },
            (least, most) => {
                // A margin of a twelfth; one of the size of the value where all are alike.
                let wide = most - least;
                let margin = if wide > 1e-9 * least.abs().max(most.abs()) {
                    wide / 12.0
                } else {
                    least.abs().max(1.0) / 10.0
                };
                Self { least: least - margin, most: most + margin }
            }
        }
    }

    /// Where a value lies, 0 to 1.
    fn part(&self, value: f64) -> f64 {
        (value - self.least) / (self.most - self.least)
    }
}

/// One cell over time with its control limits. All cells of a page share `over` and `times`, so that they can be compared by eye.
pub(super) fn trend(
    cell: &CellValues,
    limits: Option<ControlLimits>,
    over: Range,
    times: Range,
    unit: &str,
) -> String {
    let y = |value: f64| HEIGHT - BELOW - over.part(value) * (HEIGHT - BELOW - MARGIN);
    let x = |time: f64| LEFT + times.part(time) * (WIDTH - LEFT - MARGIN);
    let title = format!("{} values of {}", cell.values.len(), cell.cell);
    let mut svg = begin(HEIGHT, &title);
    if let Some(limits) = limits {
        let (top, bottom) = (y(limits.upper).max(0.0), y(limits.lower).min(HEIGHT - BELOW));
        let _ = write!(
            svg,
            r#"<rect class="limits" x="{LEFT}" y="{top:.1}" width="{:.1}" height="{:.1}"/>"#,
            WIDTH - LEFT - MARGIN,
            (bottom - top).max(0.0)
        );
        line(&mut svg, "centre", (LEFT, y(limits.centre)), (WIDTH - MARGIN, y(limits.centre)));
    }
    for value in [over.least, (over.least + over.most) / 2.0, over.most] {
        text(&mut svg, "end", LEFT - 6.0, y(value).clamp(12.0, HEIGHT - BELOW), &number(value));
    }
    line(&mut svg, "axis", (LEFT, HEIGHT - BELOW), (WIDTH - MARGIN, HEIGHT - BELOW));
    let placed: Vec<(f64, &str, f64)> = cell
        .values
        .iter()
        .filter_map(|(time, value)| Some((x(moment(time)?), time.as_str(), *value)))
        .collect();
    let way: Vec<String> = placed.iter().map(|(x, _, value)| format!("{x:.1},{:.1}", y(*value))).collect();
    let _ = write!(svg, r#"<polyline class="way" points="{}"/>"#, way.join(" "));
    for (x, time, value) in placed {
        let outside = limits.is_some_and(|limits| limits.excludes(value));
        dot(
            &mut svg,
            x,
            y(value),
            outside,
            &format!("{} {}: {} {unit}", cell.cell, day(time), number(value)),
        );
    }
    if let (Some((first, _)), Some((last, _))) = (cell.values.first(), cell.values.last()) {
        for (time, anchor) in [(first, "start"), (last, "end")] {
            if let Some(moment) = moment(time) {
                text(&mut svg, anchor, x(moment), HEIGHT - 5.0, day(time));
            }
        }
    }
    svg.push_str("</svg>");
    svg
}

/// All cells beside each other: a row a cell, a dot a value, a bar at its mean.
pub(super) fn beside(cells: &[CellValues], over: Range, unit: &str) -> String {
    let height = ROW * cells.len() as f64 + BELOW;
    let left = LEFT + 40.0;
    let x = |value: f64| left + over.part(value) * (WIDTH - left - MARGIN);
    let mut svg = begin(height, &format!("{} beside each other", counted(cells.len(), "cell", "cells")));
    for (row, cell) in cells.iter().enumerate() {
        let y = ROW * (row as f64 + 0.5);
        let short: String = cell.cell.chars().take(18).collect();
        text(&mut svg, "end", left - 8.0, y + 4.0, &short);
        line(&mut svg, "axis", (left, y), (WIDTH - MARGIN, y));
        for (time, value) in &cell.values {
            dot(
                &mut svg,
                x(*value),
                y,
                false,
                &format!("{} {}: {} {unit}", cell.cell, day(time), number(*value)),
            );
        }
        let mean = cell.values.iter().map(|(_, value)| value).sum::<f64>() / cell.values.len().max(1) as f64;
        line(&mut svg, "mean", (x(mean), y - ROW / 2.5), (x(mean), y + ROW / 2.5));
    }
    for (value, anchor) in
        [(over.least, "start"), ((over.least + over.most) / 2.0, "middle"), (over.most, "end")]
    {
        text(&mut svg, anchor, x(value), height - 5.0, &format!("{} {unit}", number(value)));
    }
    svg.push_str("</svg>");
    svg
}

/// A time in days, for an axis.
pub(super) fn moment(time: &str) -> Option<f64> {
    let part = |from: usize| time.get(from..from + 2)?.parse::<f64>().ok();
    let seconds = part(11)? * 3_600.0 + part(14)? * 60.0 + part(17)?;
    Some(day_number(time)? as f64 + seconds / 86_400.0)
}

fn day(time: &str) -> &str {
    time.get(..10).unwrap_or(time)
}

fn begin(height: f64, title: &str) -> String {
    format!(
        r#"<svg viewBox="0 0 {WIDTH} {height}" role="img" aria-label="{0}"><title>{0}</title>"#,
        escaped(title)
    )
}

fn line(svg: &mut String, class: &str, from: (f64, f64), to: (f64, f64)) {
    let ((x1, y1), (x2, y2)) = (from, to);
    // Writing to a string cannot fail.
    let _ = write!(svg, r#"<line class="{class}" x1="{x1:.1}" y1="{y1:.1}" x2="{x2:.1}" y2="{y2:.1}"/>"#);
}

fn text(svg: &mut String, anchor: &str, x: f64, y: f64, text: &str) {
    let _ = write!(svg, r#"<text text-anchor="{anchor}" x="{x:.1}" y="{y:.1}">{}</text>"#, escaped(text));
}

fn dot(svg: &mut String, x: f64, y: f64, outside: bool, title: &str) {
    let class = if outside { "dot outside" } else { "dot" };
    let radius = if outside { 4.5 } else { 3.0 };
    let _ = write!(
        svg,
        r#"<circle class="{class}" cx="{x:.1}" cy="{y:.1}" r="{radius}"><title>{}</title></circle>"#,
        escaped(title)
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cell(name: &str, values: &[f64]) -> CellValues {
        let dated = values
            .iter()
            .enumerate()
            .map(|(at, value)| (format!("2026-01-{:02}T12:00:00.000Z", at + 1), *value));
        CellValues { cell: name.to_owned(), record: String::new(), values: dated.collect() }
    }

    #[test]
    fn there_is_something_to_draw_on_whatever_the_values() {
        for values in [&[][..], &[5.0, 5.0], &[0.0], &[f64::NAN], &[1.0, 2.0]] {
            let range = Range::of(values.iter().copied());
            assert!(
                range.least < range.most && range.least.is_finite() && range.most.is_finite(),
                "{values:?}"
            );
        }
    }

    #[test]
    fn a_value_outside_its_limits_is_marked_and_a_name_stays_text() {
        let cell = cell("<b>", &[1.0, 1.1, 0.9, 1.0, 1.1, 0.9, 1.0, 1.1, 9.0]);
        let values: Vec<f64> = cell.values.iter().map(|(_, value)| *value).collect();
        let limits = ControlLimits { centre: 1.0, lower: 0.5, upper: 1.5 };
        let times = Range::of(cell.values.iter().filter_map(|(time, _)| moment(time)));
        let svg = trend(&cell, Some(limits), Range::of(values.into_iter()), times, "deg");
        assert_eq!((svg.matches("<circle").count(), svg.matches("dot outside").count()), (9, 1));
        assert!(!svg.contains("<b>") && svg.contains("&lt;b&gt;") && !svg.contains("NaN"), "{svg}");
        assert!(is_closed(&svg), "{svg}");
    }

    /// Every element that is opened is closed.
    fn is_closed(svg: &str) -> bool {
        ["svg", "circle", "title", "text"].iter().all(|name| {
            svg.matches(&format!("<{name}")).count() == svg.matches(&format!("</{name}>")).count()
        })
    }
}
