//! `plumb-studies repeatability`: the same procedure again and again.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use plumb_cell::NOT_DETERMINED;

use super::runs::Runs;
use super::statistics::{Summary, drift};
use super::table::{self, QUANTITIES, Row};
use super::truth::Missed;
use plumb::commands::study::study_file::{Common, Quantity};
use plumb_report::figure;
use plumb_report::figure::{Curve, Figure};

use super::{Many, StudyError};

/// Runs unless specified otherwise.
const RUNS: u32 = 100;

/// Run a procedure many times from starts within what an operator's eye leaves, and show what it finds: spread, drift, worst.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// The cell file; its world has to be a simulated one.
    cell: PathBuf,
    /// Which of the cell's procedures; the first if left out.
    procedure: Option<String>,
    /// Set a parameter of the procedure; can be given several times.
    #[arg(long, value_name = "NAME=VALUE", value_parser = plumb::commands::run::parameter)]
    set: Vec<(String, f64)>,
    #[command(flatten)]
    many: Many,
}

pub(crate) fn run(arguments: &Arguments, folder: Option<&Path>) -> Result<(), StudyError> {
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
    text.push_str(&coverage(row));
    text
}

/// How many standard uncertainties the true error may be off: 95 % of a normal distribution lie within them.
const COVERAGE_FACTOR: f64 = 2.0;

/// How often the true error lay within what the runs stated of it.
fn coverage(row: &Row) -> String {
    let passed: Vec<&Missed> = row.runs.iter().filter_map(|run| run.missed.as_ref()).collect();
    let mut text = format!(
        "{:<14} {:>12} {:>22} {:>16}\n",
        "true error of", "stated, 1 u", "within 2 stated u", "worst, in u"
    );
    for (index, name) in ["waist_deg", "shoulder_deg", "elbow_deg"].into_iter().enumerate() {
        let pairs: Vec<(f64, f64)> = passed
            .iter()
            .filter_map(|missed| Some((*missed.zeros_deg.get(index)?, (*missed.stated_deg.get(index)?)?)))
            .collect();
        if pairs.is_empty() {
            let _ = writeln!(text, "{name:<14} {NOT_DETERMINED:>14}");
            continue;
        }
        let within = pairs.iter().filter(|(error, stated)| error.abs() <= COVERAGE_FACTOR * stated).count();
        let worst = pairs.iter().map(|(error, stated)| error.abs() / stated).fold(0.0, f64::max);
        let mean = pairs.iter().map(|(_, stated)| stated).sum::<f64>() / pairs.len() as f64;
        let fraction =
            format!("{within} of {} = {:.1} %", pairs.len(), 100.0 * within as f64 / pairs.len() as f64);
        let _ = writeln!(text, "{name:<14} {mean:>12.4} {fraction:>22} {worst:>16.2}");
    }
    let silent = passed.iter().filter(|missed| missed.stated_deg.iter().any(Option::is_none)).count();
    if silent > 0 {
        let _ = writeln!(text, "{silent} of {} runs stated no uncertainty of one zero or more", passed.len());
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

#[cfg(test)]
mod tests {
    use plumb_cell::event::RunOutcome;

    use super::*;
    use crate::method::bench::Run;

    fn run(error: f64, stated: Option<f64>) -> Run {
        let missed =
            Missed { zeros_deg: [error, 0.0, 0.0], stated_deg: [stated, Some(1.0), None], hand_mm: [0.0; 3] };
        Run {
            seed: 1,
            outcome: RunOutcome::Passed,
            message: String::new(),
            missed: Some(missed),
            seconds: 1.0,
            steps: 1,
        }
    }

    #[test]
    fn errors_are_held_against_what_each_run_stated() {
        let runs = vec![run(0.1, Some(0.1)), run(0.3, Some(0.1)), run(-0.2, Some(0.1)), run(0.0, None)];
        let text = coverage(&Row { title: String::new(), runs });
        let line = |name: &str| text.lines().find(|line| line.starts_with(name)).expect("a line").to_owned();
        assert!(
            line("waist_deg").contains("2 of 3 = 66.7 %") && line("waist_deg").ends_with("3.00"),
            "{text}"
        );
        assert!(line("shoulder_deg").contains("4 of 4 = 100.0 %"), "{text}");
        assert!(
            line("elbow_deg").contains("not determined") && text.contains("4 of 4 runs stated no"),
            "{text}"
        );
    }
}
