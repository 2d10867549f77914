//! The error in space: where the points are, how far off each, which way; seen from above and from the side, on one scale.

use std::collections::HashSet;
use std::fmt::Write;

use super::drawing::{Links, OUTSIDE, POINT, Short, point};
use plumb_diagnosis::laboratory::{Comparison, RowResidual};

/// One view, frame included.
const SIZE: f64 = 440.0;
const MARGIN: f64 = 44.0;

/// Length of the whisker of a root mean square error, px.
const TYPICAL: f64 = 16.0;

/// The longest whisker, px: a gross error does not strike through the whole drawing.
const LONGEST: f64 = 90.0;

/// Rows that are numbered.
const NUMBERED: usize = 5;

/// Two views: the axis across, the axis up, and what they are called.
const VIEWS: [(usize, usize, &str); 2] =
    [(0, 1, "from above: x across, y up"), (0, 2, "from the side: x across, z up")];

const AXES: [&str; 3] = ["x", "y", "z"];

/// The errors of some rows (by their lines) where the points are, drawn, with points that lead where `links` says; nothing where no point in space was measured.
pub(crate) fn space(comparison: &Comparison, shown: &HashSet<u32>, links: Links) -> Option<String> {
    let rows: Vec<&RowResidual> =
        comparison.rows.iter().filter(|row| shown.contains(&row.line) && can_be_drawn(row)).collect();
    let rms = comparison.error_mm.fit.rms;
    if rows.len() < 2 || rms <= 0.0 || rows.iter().all(|row| row.vector_mm == [0.0; 3]) {
        return None;
    }
    let times = magnification(&rows, &comparison.arm_points_mm, rms);
    let mut out = String::new();
    draw(&mut out, comparison, &rows, times, links).unwrap_or_default();
    Some(out)
}

fn can_be_drawn(row: &RowResidual) -> bool {
    row.point_mm.iter().chain(&row.vector_mm).all(|value| value.is_finite())
        && row.size.is_some_and(f64::is_finite)
}

/// Least and greatest along an axis, of points and arm.
fn span(rows: &[&RowResidual], arm: &[[f64; 3]], axis: usize) -> (f64, f64) {
    let points = rows.iter().map(|row| row.point_mm[axis]).chain(arm.iter().map(|point| point[axis]));
    points.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)))
}

/// px a millimetre that let both views fit, one scale for all axes.
fn scale(rows: &[&RowResidual], arm: &[[f64; 3]]) -> f64 {
    let widths = (0..3).map(|axis| span(rows, arm, axis)).map(|(low, high)| high - low);
    (SIZE - 2.0 * MARGIN) / widths.fold(1e-6, f64::max)
}

/// How many times larger errors are drawn than distances: a round number.
fn magnification(rows: &[&RowResidual], arm: &[[f64; 3]], rms: f64) -> f64 {
    let requested = TYPICAL / (rms * scale(rows, arm));
    let power = 10_f64.powf(requested.log10().floor());
    [5.0, 2.0, 1.0].into_iter().map(|step| step * power).find(|step| *step <= requested).unwrap_or(power)
}

fn draw(
    out: &mut String,
    comparison: &Comparison,
    rows: &[&RowResidual],
    times: f64,
    links: Links,
) -> std::fmt::Result {
    let width = SIZE * VIEWS.len() as f64;
    let height = SIZE + 24.0;
    writeln!(
        out,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" height=\"{height}\" font-family=\"sans-serif\" font-size=\"11\">"
    )?;
    writeln!(out, "<rect width=\"{width}\" height=\"{height}\" fill=\"white\"/>")?;
    for (index, view) in VIEWS.iter().enumerate() {
        one_view(out, comparison, rows, (*view, SIZE * index as f64), times, links)?;
    }
    let example = comparison.error_mm.fit.rms;
    let length = example * times * scale(rows, &comparison.arm_points_mm);
    writeln!(
        out,
        "<path d=\"M14 {y:.0}h{length:.1}\" stroke=\"{POINT}\" stroke-width=\"1.4\"/><text x=\"{x:.0}\" y=\"{t:.0}\" fill=\"#444\">{example:.3} mm of error (the RMS); errors are drawn {times} times as large as distances, red where cut short; numbers are lines of the table</text>",
        y = SIZE + 8.0,
        x = 22.0 + length,
        t = SIZE + 12.0
    )?;
    writeln!(out, "</svg>")
}

fn one_view(
    out: &mut String,
    comparison: &Comparison,
    rows: &[&RowResidual],
    ((across, up, title), left): ((usize, usize, &str), f64),
    times: f64,
    links: Links,
) -> std::fmt::Result {
    let arm = &comparison.arm_points_mm;
    let px = scale(rows, arm);
    let [middle_across, middle_up] = [across, up].map(|axis| {
        let (low, high) = span(rows, arm, axis);
        0.5 * (low + high)
    });
    let (centre_x, centre_y) = (left + 0.5 * SIZE, 0.5 * SIZE);
    // Up in the picture is down in the coordinates of an SVG.
    let pixel = |point: &[f64; 3]| {
        (centre_x + px * (point[across] - middle_across), centre_y - px * (point[up] - middle_up))
    };
    writeln!(out, "<text x=\"{:.0}\" y=\"16\" font-weight=\"bold\">{title}</text>", left + 10.0)?;
    let line: Vec<String> =
        arm.iter().map(|point| format!("{:.1},{:.1}", pixel(point).0, pixel(point).1)).collect();
    writeln!(
        out,
        "<polyline points=\"{}\" fill=\"none\" stroke=\"#bbb\" stroke-width=\"5\" stroke-linejoin=\"round\"/>",
        line.join(" ")
    )?;
    for row in rows {
        let (x, y) = pixel(&row.point_mm);
        let (dx, dy) = (px * times * row.vector_mm[across], -px * times * row.vector_mm[up]);
        // An outlier's line would cross the picture; it is cut, and shown in another colour.
        let cut = (LONGEST / dx.hypot(dy).max(1e-12)).min(1.0);
        let ink = if cut < 1.0 { OUTSIDE } else { POINT };
        writeln!(
            out,
            "<path d=\"M{x:.1} {y:.1}l{:.1} {:.1}\" stroke=\"{ink}\" stroke-width=\"1\"/>",
            cut * dx,
            cut * dy
        )?;
        point(out, (x, y), 1.6, &format!("fill=\"{ink}\""), row.line, links)?;
    }
    for row in worst(rows).into_iter().take(NUMBERED) {
        let (x, y) = pixel(&row.point_mm);
        writeln!(
            out,
            "<text x=\"{:.1}\" y=\"{:.1}\" fill=\"{OUTSIDE}\" font-weight=\"bold\">{}</text>",
            x + 4.0,
            y - 4.0,
            row.line
        )?;
    }
    axis_ends(out, (span(rows, arm, across), span(rows, arm, up)), (across, up), left)
}

/// The rows by their error, the worst first.
fn worst<'r>(rows: &[&'r RowResidual]) -> Vec<&'r RowResidual> {
    let mut sorted = rows.to_vec();
    let size = |row: &RowResidual| row.size.unwrap_or(0.0);
    sorted.sort_by(|one, other| size(other).total_cmp(&size(one)));
    sorted
}

/// What the view spans.
fn axis_ends(
    out: &mut String,
    (across, up): ((f64, f64), (f64, f64)),
    (across_axis, up_axis): (usize, usize),
    left: f64,
) -> std::fmt::Result {
    let [across_name, up_name] = [across_axis, up_axis].map(|axis| AXES.get(axis).copied().unwrap_or(""));
    writeln!(
        out,
        "<text x=\"{:.0}\" y=\"{:.0}\" fill=\"#555\">{} from {:.3} to {:.3} mm, {} from {:.3} to {:.3} mm</text>",
        left + 10.0,
        SIZE - 8.0,
        across_name,
        Short(across.0),
        Short(across.1),
        up_name,
        Short(up.0),
        Short(up.1)
    )
}
