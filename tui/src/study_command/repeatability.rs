//! `plumb study repeatability`: the same procedure again and again.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use super::curves::{Curve, Figure};
use super::runs::Runs;
use super::statistics::{Summary, drift};
use super::study_file::{Common, Quantity};
use super::table::{self, QUANTITIES, Row};
use super::{Many, StudyError, figure};

/// Runs unless told otherwise.
const RUNS: u32 = 100;

/// Run a procedure many times from starts within what an operator's eye leaves, and show what it finds: spread, drift, worst.
#[derive(clap::Args)]
pub(super) struct Arguments {
    /// The cell file; its world has to be a simulated one.
    cell: PathBuf,
    /// Which of the cell's procedures; the first if left out.
    procedure: Option<String>,
    /// Set a parameter of the procedure; can be given several times.
    #[arg(long, value_name = "NAME=VALUE", value_parser = crate::run_command::parameter)]
    set: Vec<(String, f64)>,
    #[command(flatten)]
    many: Many,
}

pub(super) fn run(arguments: &Arguments, folder: Option<&Path>) -> Result<(), StudyError> {
    let count = arguments.many.runs.unwrap_or(RUNS);
    let mut runs = Runs::new(count as usize, &arguments.many.plugins)?;
    let with = Common {
        cell: Some(arguments.cell.clone()),
        procedure: arguments.procedure.clone(),
        check_pose: check_pose(),
        set: arguments.set.iter().cloned().collect(),
        ..Common::default()
    };
    let title = arguments.cell.display().to_string();
    let made = runs.make(&title, with, count, arguments.many.seed)?;
    let rows = [Row { title, runs: made }];
    let mut out = std::io::stdout();
    write!(out, "{}{}", report(&rows[0], arguments.many.seed), table::failures(&rows))?;
    writeln!(out, "{} runs, {:.1} a second", runs.made(), runs.rate())?;
    if let Some(folder) = folder {
        figure::write(folder, &drawn(&rows[0]))?;
        figure::write_file(folder, "repeatability-runs.csv", &table::csv(&rows))?;
        writeln!(out, "figure and runs written to {}", folder.display())?;
    }
    Ok(())
}

/// Over the white paper before line B, a little higher than where the sensor fires.
pub(super) fn check_pose() -> std::collections::BTreeMap<String, f64> {
    [("waist", 8.0), ("shoulder", 38.0), ("elbow", -90.0)]
        .map(|(joint, angle)| (joint.to_owned(), angle))
        .into()
}

fn report(row: &Row, seed: u64) -> String {
    let count = row.runs.len();
    let mut text = format!(
        "{}: {count} runs from starts within the operator's tolerance, seeds {seed} to {}\n\n\
         {:<14} {:>10} {:>10} {:>10}   drift in {count} runs\n",
        row.title,
        seed + count as u64 - 1,
        "error of",
        "mean",
        "spread",
        "worst"
    );
    for (quantity, name) in QUANTITIES {
        let numbered = numbered(row, quantity);
        let values: Vec<f64> = numbered.iter().map(|(_, value)| *value).collect();
        let summary = Summary::of(&values);
        let (slope, error) = drift(&numbered);
        let verdict = if slope.abs() > 3.0 * error { "drifts" } else { "none seen" };
        let _ = writeln!(
            text,
            "{:<14} {:>10.5} {:>10.5} {:>10.5}   {:+.5} +- {:.5}, {verdict}",
            name,
            summary.mean,
            summary.spread,
            summary.worst,
            slope * count as f64,
            error * count as f64
        );
    }
    text.push('\n');
    text
}

fn numbered(row: &Row, quantity: Quantity) -> Vec<(f64, f64)> {
    let of =
        |(number, run): (usize, &super::bench::Run)| Some((number as f64 + 1.0, run.missed?.of(quantity)));
    row.runs.iter().enumerate().filter_map(of).collect()
}

fn drawn(row: &Row) -> Figure {
    let curve = |quantity, name: &str| Curve { name: name.to_owned(), points: numbered(row, quantity) };
    Figure {
        file_name: "repeatability".to_owned(),
        title: format!("Hand's error after {} runs, {}", row.runs.len(), row.title),
        across: "run".to_owned(),
        up: "true place less corrected, mm".to_owned(),
        curves: vec![
            curve(Quantity::RadialMm, "radial"),
            curve(Quantity::AcrossMm, "across"),
            curve(Quantity::HeightMm, "height"),
        ],
        scattered: true,
    }
}
