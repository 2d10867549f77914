//! `plumb history --trend arm.waist`: what runs found for one site over time.

use std::io;
use std::process::ExitCode;

use plumb_cell::{corrected_quantity, uncertainty_digits};
use plumb_record::{Record, TrendPoint};

use super::Arguments;
use crate::failure::CommandResult;
use crate::print_line::print_line;

/// Columns of the little plot.
const WIDTH: usize = 31;

/// A site no run has found anything for.
#[derive(Debug, thiserror::Error)]
enum TrendError {
    #[error("`{0}` is no place: write the device and the joint, as in arm.waist")]
    Form(String),
    #[error("no run found anything for {site}; {there}")]
    Nothing { site: String, there: String },
}

/// Prints it.
pub(super) fn print(record: &Record, site: &str, arguments: &Arguments) -> CommandResult {
    let (device, joint) = site.split_once('.').ok_or_else(|| TrendError::Form(site.to_owned()))?;
    let mut points = record.trend(device, joint, arguments.cell.as_deref())?;
    let day = |point: &TrendPoint| point.time.get(..10).unwrap_or_default().to_owned();
    points.retain(|point| arguments.since.as_ref().is_none_or(|since| day(point) >= *since));
    points.retain(|point| arguments.until.as_ref().is_none_or(|until| day(point) <= *until));
    if points.is_empty() {
        let sites = record.corrected_sites()?;
        let there = match sites.is_empty() {
            true => "no run has found any correction yet".to_owned(),
            false => format!("there is {}", sites.join(", ")),
        };
        return Err(TrendError::Nothing { site: site.to_owned(), there }.into());
    }
    points.drain(..points.len().saturating_sub(arguments.number as usize));
    if arguments.json {
        for point in &points {
            print_line!("{}", serde_json::to_string(point)?)?;
        }
        return Ok(ExitCode::SUCCESS);
    }
    if arguments.csv {
        print_line!("run,time,cell,quantity,old,new,uncertainty,unit,revision,in_force")?;
        for point in &points {
            let TrendPoint { time, cell, quantity, old, new, unit, in_force, .. } = point;
            let uncertainty = point.uncertainty.map(|value| value.to_string()).unwrap_or_default();
            let revision = point.revision.map(|revision| revision.to_string()).unwrap_or_default();
            print_line!(
                "{},{time},{cell},{quantity},{old},{new},{uncertainty},{unit},{revision},{in_force}",
                run_number(point)
            )?;
        }
        return Ok(ExitCode::SUCCESS);
    }
    print_for_people(site, &points)?;
    Ok(ExitCode::SUCCESS)
}

/// One table; where cells share the record, one for each: what is found in one says nothing of another, whatever its devices are called.
fn print_for_people(site: &str, points: &[TrendPoint]) -> io::Result<()> {
    let mut cells: Vec<(&str, Vec<&TrendPoint>)> = Vec::new();
    for point in points {
        match cells.iter_mut().find(|(cell, _)| *cell == point.cell) {
            Some((_, found)) => found.push(point),
            None => cells.push((&point.cell, vec![point])),
        }
    }
    let several = cells.len() > 1;
    for (index, (cell, found)) in cells.iter().enumerate() {
        if index > 0 {
            print_line!()?;
        }
        let of_cell = if several { format!(" of cell {cell}") } else { String::new() };
        print_table(site, &of_cell, found)?;
    }
    Ok(())
}

fn print_table(site: &str, of_cell: &str, points: &[&TrendPoint]) -> io::Result<()> {
    let Some(newest) = points.last() else { return Ok(()) };
    let unit = &newest.unit;
    let (least, most) = range(points);
    let unit_in_words = if unit.is_empty() { String::new() } else { format!(", {unit}") };
    print_line!("{}{of_cell}{unit_in_words}; the newest last", title(&newest.quantity, site))?;
    print_line!(
        "{:>5}  {:<16}  {:>11}  {:>16}  {:>10}  {:<8}",
        "run",
        "found (UTC)",
        "value",
        "uncertainty",
        "change",
        "in force"
    )?;
    for point in points {
        let time = point.time.get(..16).unwrap_or(&point.time).replace('T', " ");
        print_line!(
            "{:>5}  {time:<16}  {:>11}  {:>16}  {:>10}  {:<8}  {}",
            run_number(point),
            decimals(point.new, ""),
            uncertainty_digits(point.uncertainty),
            decimals(point.new - point.old, "+"),
            in_force(point),
            dot(point.new, least, most)
        )?;
    }
    if points.len() > 1 {
        let (mean, spread) = statistics(points);
        print_line!(
            "{} findings: mean {mean:.4} {unit}, spread {spread:.4} {unit} (1 sigma), from {least:.4} to {most:.4}",
            points.len()
        )?;
    }
    Ok(())
}

/// What the numbers are of: `joint zero of arm.waist`, `camera aim x of stripe`.
fn title(quantity: &str, site: &str) -> String {
    match site.split_once('.') {
        Some((device, parameter)) if quantity == "sensor_parameter" => {
            corrected_quantity(quantity, device, parameter)
        }
        _ => format!("{} of {site}", quantity.replace('_', " ")),
    }
}

/// Whether a value is in force, was until a later one came, or never was.
fn in_force(point: &TrendPoint) -> &'static str {
    match (point.in_force, point.revision) {
        (true, _) => "now",
        (false, Some(_)) => "was",
        (false, None) => "never",
    }
}

/// Four decimals, and no sign before a number that rounds to nothing.
fn decimals(value: f64, plus: &str) -> String {
    let text = format!("{value:.4}");
    match text.trim_start_matches(['-', '0', '.']).is_empty() {
        true => "0.0000".to_owned(),
        false if value > 0.0 => format!("{plus}{text}"),
        false => text,
    }
}

fn run_number(point: &TrendPoint) -> String {
    point.run.map_or_else(|| "-".to_owned(), |run| run.to_string())
}

fn range(points: &[&TrendPoint]) -> (f64, f64) {
    let values = points.iter().map(|point| point.new);
    values
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), value| (least.min(value), most.max(value)))
}

/// Where a value is between the least and the most.
fn dot(value: f64, least: f64, most: f64) -> String {
    let part = if most > least { (value - least) / (most - least) } else { 0.5 };
    let column = (part * (WIDTH - 1) as f64).round() as usize;
    let mut line = "·".repeat(column.min(WIDTH - 1));
    line.push('●');
    line.push_str(&"·".repeat(WIDTH - 1 - column.min(WIDTH - 1)));
    line
}

/// Mean and standard deviation (of a sample).
fn statistics(points: &[&TrendPoint]) -> (f64, f64) {
    let count = points.len() as f64;
    let mean = points.iter().map(|point| point.new).sum::<f64>() / count;
    let squares: f64 = points.iter().map(|point| (point.new - mean).powi(2)).sum();
    (mean, (squares / (count - 1.0)).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_change_of_nothing_has_no_sign() {
        assert_eq!((decimals(-0.00001, "+"), decimals(0.0, "+")), ("0.0000".to_owned(), "0.0000".to_owned()));
        assert_eq!((decimals(-0.5, "+"), decimals(1.25, "+")), ("-0.5000".to_owned(), "+1.2500".to_owned()));
    }

    #[test]
    fn values_are_between_the_least_and_the_most() {
        assert!(dot(1.0, 1.0, 3.0).starts_with('●'));
        assert!(dot(3.0, 1.0, 3.0).ends_with('●'));
        assert_eq!(dot(2.0, 2.0, 2.0).chars().position(|c| c == '●'), Some(15));
    }
}
