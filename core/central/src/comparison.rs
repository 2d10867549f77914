//! One quantity, machine beside machine.

use serde::Serialize;

use crate::ControlLimits;

/// Fewest values from which a cell's own spread is taken.
const FEWEST_FOR_SPREAD: usize = 2;

/// Values of one cell, the oldest first.
#[derive(Debug, Clone, PartialEq)]
pub struct CellValues {
    /// The cell.
    pub cell: String,
    /// Identity of its record.
    pub record: String,
    /// When, UTC, and what.
    pub values: Vec<(String, f64)>,
}

/// One cell among others that have the same quantity.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CellSummary {
    /// The cell.
    pub cell: String,
    /// Identity of its record.
    pub record: String,
    /// How many values.
    pub count: usize,
    /// Their mean.
    pub mean: f64,
    /// Standard deviation within the cell; none with one value.
    pub deviation: Option<f64>,
    /// The newest value.
    pub last: f64,
    /// The cell's own control limits.
    pub limits: Option<ControlLimits>,
    /// How many values are outside them.
    pub outside: usize,
    /// Its mean less the median of all cells' means, in standard deviations within cells; none where that is not known.
    pub from_others: Option<f64>,
}

/// Each cell beside the others.
pub fn compare(cells: &[CellValues]) -> Vec<CellSummary> {
    let of = |cell: &CellValues| cell.values.iter().map(|(_, value)| *value).collect::<Vec<f64>>();
    let all: Vec<(&CellValues, Vec<f64>)> =
        cells.iter().filter(|cell| !cell.values.is_empty()).map(|cell| (cell, of(cell))).collect();
    let mut means: Vec<f64> = all.iter().map(|(_, values)| mean(values)).collect();
    means.sort_by(f64::total_cmp);
    let middle = median(&means);
    let within = pooled_deviation(&all);
    let summaries = all.iter().map(|(cell, values)| {
        let limits = ControlLimits::of(values);
        let own_mean = mean(values);
        CellSummary {
            cell: cell.cell.clone(),
            record: cell.record.clone(),
            count: values.len(),
            mean: own_mean,
            deviation: deviation(values),
            last: values.last().copied().unwrap_or(own_mean),
            limits,
            outside: values
                .iter()
                .filter(|value| limits.is_some_and(|limits| limits.excludes(**value)))
                .count(),
            from_others: within.filter(|_| all.len() > 1).map(|within| (own_mean - middle) / within),
        }
    });
    summaries.collect()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Of sorted values; a median, so that one machine that is off does not move what it is compared with.
fn median(sorted: &[f64]) -> f64 {
    let half = sorted.len() / 2;
    match sorted.len() {
        0 => f64::NAN,
        even if even.is_multiple_of(2) => (sorted[half - 1] + sorted[half]) / 2.0,
        _ => sorted[half],
    }
}

fn squares(values: &[f64]) -> f64 {
    let middle = mean(values);
    values.iter().map(|value| (value - middle).powi(2)).sum()
}

fn deviation(values: &[f64]) -> Option<f64> {
    (values.len() >= FEWEST_FOR_SPREAD).then(|| (squares(values) / (values.len() - 1) as f64).sqrt())
}

/// Spread within cells, all cells together (Montgomery, Design and Analysis of Experiments, section 3.3: the mean square within treatments).
fn pooled_deviation(all: &[(&CellValues, Vec<f64>)]) -> Option<f64> {
    let freedom: usize = all.iter().map(|(_, values)| values.len() - 1).sum();
    let squares: f64 = all.iter().map(|(_, values)| squares(values)).sum();
    let pooled = (squares / freedom as f64).sqrt();
    (freedom > 0 && pooled > 0.0 && pooled.is_finite()).then_some(pooled)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cell(name: &str, values: &[f64]) -> CellValues {
        let values = values.iter().map(|value| (String::new(), *value)).collect();
        CellValues { cell: name.to_owned(), record: String::new(), values }
    }

    #[test]
    fn a_machine_that_is_off_is_reported_in_spreads_within_machines() {
        let cells = [cell("a", &[1.0, 1.2, 0.8]), cell("b", &[1.1, 0.9, 1.0]), cell("c", &[3.0, 3.2, 2.8])];
        let found = compare(&cells);
        // By hand: squares 0.08, 0.02, 0.08 over six degrees of freedom.
        let within = (0.18_f64 / 6.0).sqrt();
        let off: Vec<f64> = found.iter().map(|one| one.from_others.expect("known")).collect();
        assert!(off[0].abs() < 1e-9 && off[1].abs() < 1e-9, "{off:?}");
        assert!((off[2] - 2.0 / within).abs() < 1e-9, "{off:?}");
        assert!((found[0].deviation.expect("three values") - 0.2).abs() < 1e-12);
    }

    #[test]
    fn what_is_not_known_is_none() {
        assert_eq!(compare(&[]), Vec::new());
        let alone = compare(&[cell("a", &[1.0, 2.0]), cell("empty", &[])]);
        assert_eq!((alone.len(), alone[0].from_others), (1, None));
        let single = compare(&[cell("a", &[1.0]), cell("b", &[2.0])]);
        assert!(single.iter().all(|one| one.from_others.is_none() && one.deviation.is_none()));
    }
}
