//! `plumb fleet`: many cells on one page, from the central database.

use std::process::ExitCode;

use plumb_central::{CellState, Central, ControlLimits, CorrectionPoint, EffectPoint, FEWEST_VALUES};
use serde::Serialize;

use crate::failure::CommandResult;
use crate::say::say;

/// Many cells at a glance, from the central database that `plumb ship` fills: what each does, which one waits for an answer and for how long, and how a
/// correction or an effect went over months and machines.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// The database: postgres://USER@HOST/DATABASE.
    #[arg(long, value_name = "ADDRESS")]
    from: String,
    /// One correction over time, over all cells: DEVICE.JOINT, as in `arm.waist`.
    #[arg(long, value_name = "DEVICE.JOINT", conflicts_with = "effect")]
    trend: Option<String>,
    /// One effect of the arms' models over time, over all cells: `joint_compliance(shoulder)`.
    #[arg(long, value_name = "EFFECT")]
    effect: Option<String>,
    /// A line of JSON for each cell or value.
    #[arg(long)]
    json: bool,
}

/// A cell that was not heard of for so long is told as silent, s: three times what a shipper lets pass.
const SILENT_AFTER_S: f64 = 15.0;

/// What cannot be asked.
#[derive(Debug, thiserror::Error)]
enum FleetError {
    #[error("`{0}` is no correction: write DEVICE.JOINT, as in arm.waist")]
    NoCorrection(String),
    #[error("`{0}` is no effect: write KIND(PLACE), as in joint_compliance(shoulder)")]
    NoEffect(String),
}

/// Prints the page.
pub(crate) fn run(arguments: &Arguments) -> CommandResult {
    // What cannot be asked is told before anything is connected.
    let asked = Asked::of(arguments)?;
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    runtime.block_on(async {
        let mut central = Central::connect(&arguments.from).await?;
        match asked {
            Asked::Cells => print_cells(arguments, &central.cells().await?),
            Asked::Correction { device, place } => {
                let points = central.corrections(device, place).await?;
                print_series(arguments, &points.iter().map(SeriesPoint::of_correction).collect::<Vec<_>>())
            }
            Asked::Effect { effect, place } => {
                let points = central.effects(effect, place).await?;
                print_series(arguments, &points.iter().map(SeriesPoint::of_effect).collect::<Vec<_>>())
            }
        }
    })?;
    Ok(ExitCode::SUCCESS)
}

/// What the page is to show.
enum Asked<'a> {
    Cells,
    Correction { device: &'a str, place: &'a str },
    Effect { effect: &'a str, place: &'a str },
}

impl<'a> Asked<'a> {
    fn of(arguments: &'a Arguments) -> Result<Self, FleetError> {
        if let Some(what) = &arguments.trend {
            let parts = what.split_once('.').ok_or_else(|| FleetError::NoCorrection(what.clone()))?;
            return Ok(Self::Correction { device: parts.0, place: parts.1 });
        }
        let Some(what) = &arguments.effect else { return Ok(Self::Cells) };
        let parts = effect_and_place(what).ok_or_else(|| FleetError::NoEffect(what.clone()))?;
        Ok(Self::Effect { effect: parts.0, place: parts.1 })
    }
}

/// `kind(place)` taken apart; a kind without a place has an empty one.
fn effect_and_place(text: &str) -> Option<(&str, &str)> {
    let Some((kind, rest)) = text.split_once('(') else {
        return (!text.is_empty() && !text.contains(')')).then_some((text, ""));
    };
    rest.strip_suffix(')').map(|place| (kind, place))
}

fn print_cells(arguments: &Arguments, cells: &[CellState]) -> Result<(), Box<dyn std::error::Error>> {
    if arguments.json {
        for cell in cells {
            say!("{}", serde_json::to_string(cell)?)?;
        }
        return Ok(());
    }
    if cells.is_empty() {
        say!("no cell has shipped anything yet: `plumb ship --to ...` beside each cell does")?;
        return Ok(());
    }
    let width = cells.iter().map(|cell| cell.cell.chars().count()).max().unwrap_or(4).max(4);
    say!("{:width$}  {:16}  {:14}  since, UTC            what it does", "cell", "host", "state")?;
    for cell in cells {
        let since = cell.ended.as_deref().unwrap_or(&cell.started);
        say!(
            "{:width$}  {:16}  {:14}  {}  {}",
            cell.cell,
            cell.host,
            cell.state.replace('_', " "),
            since.get(..19).unwrap_or(since).replace('T', " "),
            doing(cell)
        )?;
    }
    let waiting = cells.iter().filter(|cell| cell.waits_for.is_some()).count();
    let silent = cells.iter().filter(|cell| cell.silent_s > SILENT_AFTER_S).count();
    say!("\n{} cells; {waiting} wait for an answer, {silent} are silent", cells.len())?;
    Ok(())
}

/// What a cell does, in words.
fn doing(cell: &CellState) -> String {
    let mut words = match (&cell.waits_for, cell.waits_s, &cell.step) {
        (Some(title), Some(waits_s), _) => format!("WAITS for {}: {title}", duration(waits_s)),
        (_, _, Some(step)) if cell.state == "running" => format!("{}, at {step}", cell.procedure),
        _ => cell.message.clone().unwrap_or_else(|| cell.procedure.clone()),
    };
    if cell.silent_s > SILENT_AFTER_S {
        words.push_str(&format!(" (nothing heard for {})", duration(cell.silent_s)));
    }
    words
}

/// A duration in the largest unit that says it in whole numbers.
fn duration(seconds: f64) -> String {
    match seconds.max(0.0) {
        seconds if seconds < 120.0 => format!("{seconds:.0} s"),
        seconds if seconds < 7_200.0 => format!("{:.0} min", seconds / 60.0),
        seconds if seconds < 172_800.0 => format!("{:.0} h", seconds / 3_600.0),
        seconds => format!("{:.0} days", seconds / 86_400.0),
    }
}

/// One value of a series over cells.
#[derive(Debug, Clone, PartialEq, Serialize)]
struct SeriesPoint {
    cell: String,
    record: String,
    time: String,
    what: String,
    value: f64,
    uncertainty: Option<f64>,
    unit: String,
}

impl SeriesPoint {
    fn of_correction(point: &CorrectionPoint) -> Self {
        Self {
            cell: point.cell.clone(),
            record: point.record.clone(),
            time: point.proposed.clone(),
            what: point.quantity.clone(),
            value: point.value,
            uncertainty: point.uncertainty,
            unit: point.unit.clone(),
        }
    }

    fn of_effect(point: &EffectPoint) -> Self {
        Self {
            cell: point.cell.clone(),
            record: point.record.clone(),
            time: point.made.clone(),
            what: point.parameter.clone(),
            value: point.value,
            uncertainty: None,
            unit: String::new(),
        }
    }

    /// Values with the same key make one series: one cell, one quantity.
    fn key(&self) -> (&str, &str, &str) {
        (&self.cell, &self.record, &self.what)
    }
}

fn print_series(arguments: &Arguments, points: &[SeriesPoint]) -> Result<(), Box<dyn std::error::Error>> {
    if arguments.json {
        for point in points {
            say!("{}", serde_json::to_string(point)?)?;
        }
        return Ok(());
    }
    if points.is_empty() {
        say!("no cell has shipped a value of it")?;
        return Ok(());
    }
    let mut sorted = points.to_vec();
    sorted.sort_by(|one, other| one.key().cmp(&other.key()));
    for series in sorted.chunk_by(|one, other| one.key() == other.key()) {
        print_one_series(series)?;
    }
    Ok(())
}

/// One cell's values with its control limits, the oldest first.
fn print_one_series(series: &[SeriesPoint]) -> Result<(), Box<dyn std::error::Error>> {
    let Some(first) = series.first() else { return Ok(()) };
    let values: Vec<f64> = series.iter().map(|point| point.value).collect();
    let limits = ControlLimits::of(&values);
    say!("{}, {}", first.cell, first.what)?;
    for point in series {
        let mark = if limits.is_some_and(|limits| limits.excludes(point.value)) { "  OUTSIDE" } else { "" };
        let give_or_take = point.uncertainty.map(|sigma| format!(" ± {sigma:.2e}")).unwrap_or_default();
        say!(
            "  {}  {:.6}{give_or_take} {}{mark}",
            point.time.get(..19).unwrap_or(&point.time).replace('T', " "),
            point.value,
            point.unit
        )?;
    }
    match limits {
        Some(limits) => say!(
            "  control limits (mean and three sigmas of neighbours): {:.6} to {:.6}, centre {:.6}\n",
            limits.lower,
            limits.upper,
            limits.centre
        )?,
        None => say!(
            "  no control limits: they need {FEWEST_VALUES} values that differ, here are {}\n",
            values.len()
        )?,
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_effect_is_taken_apart_at_its_brackets() {
        assert_eq!(effect_and_place("joint_compliance(shoulder)"), Some(("joint_compliance", "shoulder")));
        assert_eq!(effect_and_place("joint_harmonic(pan, 12)"), Some(("joint_harmonic", "pan, 12")));
        assert_eq!(effect_and_place("drift"), Some(("drift", "")));
        assert_eq!(effect_and_place("joint_gain(elbow"), None);
        assert_eq!(effect_and_place("elbow)"), None);
    }

    #[test]
    fn durations_read_as_people_say_them() {
        assert_eq!(duration(3.2), "3 s");
        assert_eq!(duration(600.0), "10 min");
        assert_eq!(duration(5.0 * 3_600.0), "5 h");
        assert_eq!(duration(3.0 * 86_400.0), "3 days");
        assert_eq!(duration(-1.0), "0 s", "two clocks need not agree");
    }
}
