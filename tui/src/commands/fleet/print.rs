//! The fleet in a terminal.

use std::error::Error;

use plumb_central::{CellState, CellValues, ControlLimits, FEWEST_VALUES, compare};
use plumb_record::today;

use super::series::SeriesPoint;
use super::words::{calibration, doing, minute, queued, summary};
use crate::print_line::print_line;

/// Standard deviations from the other machines from which on a machine counts as different; as Shewhart's limits.
pub(super) const DIFFERENT_SIGMAS: f64 = 3.0;

/// Prints all cells.
pub(super) fn cells(cells: &[CellState], json: bool) -> Result<(), Box<dyn Error>> {
    if json {
        for cell in cells {
            print_line!("{}", serde_json::to_string(cell)?)?;
        }
        return Ok(());
    }
    if cells.is_empty() {
        print_line!("no cell has shipped anything yet: `plumb ship --to ...` beside each cell does")?;
        return Ok(());
    }
    let width = cells.iter().map(|cell| cell.cell.chars().count()).max().unwrap_or(4).max(4);
    print_line!("{:width$}  {:16}  {:14}  since, UTC        what it does", "cell", "host", "state")?;
    let today = today();
    for cell in cells {
        let since = cell.ended.as_deref().unwrap_or(&cell.started);
        print_line!(
            "{:width$}  {:16}  {:14}  {}  {}{}{}",
            cell.cell,
            cell.host,
            cell.state.replace('_', " "),
            minute(since),
            doing(cell),
            queued(cell.queued),
            calibration(cell, &today)
        )?;
    }
    print_line!("\n{}", summary(cells))?;
    Ok(())
}

/// Prints values cell by cell, and the cells beside each other.
pub(super) fn series(points: &[SeriesPoint], json: bool) -> Result<(), Box<dyn Error>> {
    if json {
        for point in points {
            print_line!("{}", serde_json::to_string(point)?)?;
        }
        return Ok(());
    }
    if points.is_empty() {
        print_line!("no cell has shipped a value of it")?;
        return Ok(());
    }
    for quantity in points.chunk_by(|one, other| one.what == other.what) {
        let cells: Vec<&[SeriesPoint]> = quantity.chunk_by(|one, other| one.key() == other.key()).collect();
        for cell in &cells {
            one_series(cell)?;
        }
        if cells.len() > 1 {
            comparison(&cells)?;
        }
    }
    Ok(())
}

/// One cell's values with its control limits, the oldest first.
fn one_series(series: &[SeriesPoint]) -> Result<(), Box<dyn Error>> {
    let Some(first) = series.first() else { return Ok(()) };
    let values: Vec<f64> = series.iter().map(|point| point.value).collect();
    let limits = ControlLimits::of(&values);
    print_line!("{}, {}", first.cell, first.what)?;
    for point in series {
        let mark = if limits.is_some_and(|limits| limits.excludes(point.value)) { "  OUTSIDE" } else { "" };
        let give_or_take = point.uncertainty.map(|sigma| format!(" ± {sigma:.2e}")).unwrap_or_default();
        print_line!(
            "  {}  {}{give_or_take} {}{mark}",
            point.time.get(..19).unwrap_or(&point.time).replace('T', " "),
            number(point.value),
            point.unit
        )?;
    }
    match limits {
        Some(limits) => print_line!(
            "  control limits (mean and three sigmas of neighbours): {} to {}, centre {}\n",
            number(limits.lower),
            number(limits.upper),
            number(limits.centre)
        )?,
        None => print_line!(
            "  no control limits: they need {FEWEST_VALUES} values that differ, here are {}\n",
            values.len()
        )?,
    }
    Ok(())
}

/// The values of a quantity cell by cell, for [`compare`].
pub(super) fn cell_values(cells: &[&[SeriesPoint]]) -> Vec<CellValues> {
    let of_cell = |series: &&[SeriesPoint]| {
        let first = series.first()?;
        let values = series.iter().map(|point| (point.time.clone(), point.value)).collect();
        Some(CellValues { cell: first.cell.clone(), record: first.record.clone(), values })
    };
    cells.iter().filter_map(of_cell).collect()
}

fn comparison(cells: &[&[SeriesPoint]]) -> Result<(), Box<dyn Error>> {
    let found = compare(&cell_values(cells));
    let what = cells.first().and_then(|cell| cell.first()).map_or("", |point| &point.what);
    print_line!("{what}, cell beside cell")?;
    let width = found.iter().map(|cell| cell.cell.chars().count()).max().unwrap_or(4).max(4);
    print_line!(
        "  {:width$}  values  mean          deviation     newest        from the others, sigmas",
        "cell"
    )?;
    for cell in &found {
        let optional = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), number);
        let from_others = cell.from_others.map_or_else(|| "-".to_owned(), |sigmas| format!("{sigmas:+.1}"));
        let different = cell.from_others.is_some_and(|sigmas| sigmas.abs() > DIFFERENT_SIGMAS);
        let mark = if different { "  DIFFERENT" } else { "" };
        print_line!(
            "  {:width$}  {:6}  {:12}  {:12}  {:12}  {from_others}{mark}",
            cell.cell,
            cell.count,
            number(cell.mean),
            optional(cell.deviation),
            number(cell.last)
        )?;
    }
    print_line!()?;
    Ok(())
}

/// A number of whatever size: effects are small in their own units.
pub(super) fn number(value: f64) -> String {
    let size = value.abs();
    if size != 0.0 && !(1e-3..1e6).contains(&size) { format!("{value:.4e}") } else { format!("{value:.4}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_readable_whatever_their_size() {
        assert_eq!(number(1.7), "1.7000");
        assert_eq!(number(-7e-6), "-7.0000e-6");
        assert_eq!(number(0.0), "0.0000");
        assert_eq!(number(2.5e7), "2.5000e7");
    }
}
