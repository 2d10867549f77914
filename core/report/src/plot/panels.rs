//! What the panels show, whatever they are drawn on.

use plumb_diagnosis::laboratory::{Comparison, EffectPlot, Series};

/// A point of a panel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dot {
    /// Horizontal value.
    pub across: f64,
    /// Residual, mm or deg.
    pub up: f64,
    /// Whether the row was held out.
    pub held_out: bool,
    /// Line of the table.
    pub line: u32,
}

/// One panel: what it shows, points and the ranges they are drawn in.
#[derive(Debug, Clone, PartialEq)]
pub struct Panel {
    /// What it shows.
    pub title: String,
    /// The horizontal axis, with its unit.
    pub across_title: String,
    /// The vertical axis, with its unit.
    pub up_title: String,
    /// Horizontal range.
    pub across: (f64, f64),
    /// Vertical range, mm or deg.
    pub up: (f64, f64),
    /// Both axes have one scale: a circle is drawn as one.
    pub one_scale: bool,
    /// The noise, in the unit of `up`, where known: drawn as a band about zero. Of one reading, or of a point's error in space where that is what is shown.
    pub floor: Option<f64>,
    /// The points.
    pub points: Vec<Dot>,
    /// A fitted curve, from left to right.
    pub curve: Vec<(f64, f64)>,
}

fn range(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (low, high) = values
        .filter(|value| value.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
    if high > low {
        (low, high)
    } else if low.is_finite() {
        // A range of no width could not be drawn in.
        (low - 1.0, low + 1.0)
    } else {
        (-1.0, 1.0)
    }
}

/// What nineteen in twenty of some sizes need, and half as much again, so that one outlier cannot squash the rest.
pub fn reach_of(sizes: impl Iterator<Item = f64>, floor: Option<f64>) -> f64 {
    let mut sizes: Vec<f64> = sizes.map(f64::abs).filter(|size| size.is_finite()).collect();
    sizes.sort_by(f64::total_cmp);
    let most = sizes.get(sizes.len() * 19 / 20).copied().unwrap_or(1.0);
    (1.5 * most).max(6.0 * floor.unwrap_or(0.0)).max(1e-9)
}

/// The line of a row in the table, and whether it was held out.
fn dot(comparison: &Comparison, across: f64, up: f64, row: usize) -> Dot {
    let known = comparison.rows.get(row);
    Dot { across, up, held_out: known.is_some_and(|row| row.held_out), line: known.map_or(0, |row| row.line) }
}

fn panel_of(series: &Series, comparison: &Comparison, reach: f64) -> Panel {
    let (floor, up) = match series.of_size {
        // Orientations have a scale of their own; the noise is known of the other readings.
        _ if series.in_deg => (None, (0.0, reach_of(series.points.iter().map(|(_, y, _)| y), None))),
        true => (comparison.floor_of_a_point_mm, (0.0, reach)),
        false => (comparison.floor.sigma_mm, (-reach, reach)),
    };
    let unit = if series.unit.is_empty() { String::new() } else { format!(", {}", series.unit) };
    Panel {
        title: series.against.clone(),
        across_title: format!("{}{unit}", series.against),
        up_title: series.shows.clone(),
        across: range(series.points.iter().map(|(x, _, _)| x)),
        up,
        one_scale: false,
        floor,
        points: series.points.iter().map(|(x, y, row)| dot(comparison, x, y, row)).collect(),
        curve: Vec::new(),
    }
}

/// All panels of a comparison: one a series, then what would be a bull's eye from above.
pub fn panels(comparison: &Comparison) -> Vec<Panel> {
    let of_readings = comparison.series.iter().filter(|series| !series.in_deg);
    let sizes = of_readings.flat_map(|series| series.points.iter().map(|(_, y, _)| y));
    let reach = reach_of(sizes, comparison.floor.sigma_mm);
    let mut all: Vec<Panel> =
        comparison.series.iter().map(|series| panel_of(series, comparison, reach)).collect();
    let rows = comparison.rows.iter();
    let above: Vec<Dot> =
        rows.map(|row| dot(comparison, row.vector_mm[0], row.vector_mm[1], row.row)).collect();
    if above.iter().any(|dot| dot.across != 0.0 || dot.up != 0.0) {
        all.push(Panel {
            title: "the error from above".to_owned(),
            across_title: "residual along x, mm".to_owned(),
            up_title: "residual along y, mm".to_owned(),
            across: (-reach, reach),
            up: (-reach, reach),
            one_scale: true,
            floor: comparison.floor.sigma_mm,
            points: above,
            curve: Vec::new(),
        });
    }
    all
}

/// An effect's own plot as a panel.
pub fn effect_panel(plot: &EffectPlot, comparison: &Comparison) -> Panel {
    let heights = plot.points.iter().map(|point| point.1).chain(plot.curve.iter().map(|point| point.1));
    let reach = reach_of(heights, comparison.floor.sigma_mm);
    let across = plot.points.iter().map(|point| point.0).chain(plot.curve.iter().map(|point| point.0));
    Panel {
        title: plot.effect.clone(),
        across_title: plot.across.title(),
        up_title: plot.up.title(),
        across: range(across),
        up: (-reach, reach),
        one_scale: false,
        floor: comparison.floor.sigma_mm,
        points: plot.points.iter().map(|(x, y, row)| dot(comparison, *x, *y, *row)).collect(),
        curve: plot.curve.clone(),
    }
}
