//! What the panels show, whatever they are drawn on.

use crate::laboratory::Comparison;

/// One panel: points and the ranges they are drawn in.
#[derive(Debug, Clone, PartialEq)]
pub struct Panel {
    /// What it is against.
    pub title: String,
    /// Unit of the horizontal axis.
    pub unit: String,
    /// Horizontal range.
    pub across: (f64, f64),
    /// Vertical range, mm.
    pub up: (f64, f64),
    /// The noise of one axis, mm, where known: drawn as a band about zero.
    pub floor: Option<f64>,
    /// Horizontal value, residual in mm, whether the row was locked away.
    pub points: Vec<(f64, f64, bool)>,
}

fn range(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (low, high) = values
        .filter(|value| value.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
    if high > low { (low, high) } else { (low - 1.0, low + 1.0) }
}

/// The common vertical reach, mm: the floor's sixfold, or what nineteen in twenty residuals need, so that one outlier
/// cannot squash the rest.
fn reach(comparison: &Comparison) -> f64 {
    let mut sizes: Vec<f64> = comparison
        .series
        .iter()
        .flat_map(|series| series.points.iter().map(|(_, y, _)| y.abs()))
        .filter(|y| y.is_finite())
        .collect();
    sizes.sort_by(f64::total_cmp);
    let most = sizes.get(sizes.len() * 19 / 20).copied().unwrap_or(1.0);
    (1.5 * most).max(6.0 * comparison.floor.sigma_mm.unwrap_or(0.0)).max(1e-9)
}

/// All panels of a comparison: one a series, then what would be a bull's eye from above.
pub fn panels(comparison: &Comparison) -> Vec<Panel> {
    let reach = reach(comparison);
    let held = |row: usize| comparison.rows.get(row).is_some_and(|row| row.held_out);
    let mut all: Vec<Panel> = comparison
        .series
        .iter()
        .map(|series| Panel {
            title: series.against.clone(),
            unit: series.unit.clone(),
            across: range(series.points.iter().map(|(x, _, _)| *x)),
            up: (-reach, reach),
            floor: comparison.floor.sigma_mm,
            points: series.points.iter().map(|(x, y, row)| (*x, *y, held(*row))).collect(),
        })
        .collect();
    let above: Vec<(f64, f64, bool)> =
        comparison.rows.iter().map(|row| (row.vector_mm[0], row.vector_mm[1], row.held_out)).collect();
    if above.iter().any(|(x, y, _)| *x != 0.0 || *y != 0.0) {
        all.push(Panel {
            title: "from above: x and y of the residual".to_owned(),
            unit: "mm".to_owned(),
            across: (-reach, reach),
            up: (-reach, reach),
            floor: comparison.floor.sigma_mm,
            points: above,
        });
    }
    all
}
