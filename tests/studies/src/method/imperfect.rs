//! Studies that a file describes: a table with a line for each change of the world, and figures in which one number is varied.

use std::io::Write as _;
use std::path::{Path, PathBuf};

use super::runs::{Runs, shown};
use super::table::{self, Row};
use plumb::commands::study::study_file::{Common, Line, Quantity, Shown, Statistic, StudyFile, Sweep};
use plumb_report::figure;
use plumb_report::figure::{Curve, Figure};

use super::{Chosen, StudyError};

/// Where the studies of the TeachMover lie.
const STUDIES: &str = "workcells/teachmover/studies";

pub(crate) fn run(name: &str, chosen: &Chosen, folder: Option<&Path>) -> Result<(), StudyError> {
    let path = chosen.file.clone().unwrap_or_else(|| PathBuf::from(STUDIES).join(format!("{name}.yaml")));
    let study = StudyFile::read(&path, name)?;
    let count = chosen.many.runs.unwrap_or(study.runs);
    let mut runs = Runs::new(planned(&study, chosen), &chosen.many.plugins)?;
    let mut out = std::io::stdout();
    writeln!(out, "{}: {}\n{}", study.study, study.title, study.about)?;
    if !study.lines.is_empty() {
        let rows = rows(&study, &mut runs, count, chosen.many.seed)?;
        writeln!(out, "{count} runs a line, seeds {} on. {}", chosen.many.seed, table::LEGEND)?;
        writeln!(out, "{}{}", table::text(&rows), table::failures(&rows))?;
        if let Some(folder) = folder {
            figure::write_file(folder, &format!("{}-runs.csv", study.study), &table::csv(&rows))?;
        }
    }
    for sweep in &study.figures {
        let count = chosen.many.runs.or(sweep.runs).unwrap_or(study.runs);
        let drawn = swept(&study.common, sweep, &mut runs, count, chosen.many.seed)?;
        write!(out, "{}", describe(sweep, &drawn, count))?;
        if let Some(folder) = folder {
            figure::write(folder, &drawn)?;
        }
    }
    writeln!(out, "{} runs, {:.1} a second", runs.made(), runs.rate())?;
    if let Some(folder) = folder {
        writeln!(out, "written to {}", folder.display())?;
    }
    Ok(())
}

fn planned(study: &StudyFile, chosen: &Chosen) -> usize {
    let points = |sweep: &Sweep| {
        let count = chosen.many.runs.or(sweep.runs).unwrap_or(study.runs) as usize;
        sweep.values.len() * sweep.lines.len().max(1) * count
    };
    study.lines.len() * chosen.many.runs.unwrap_or(study.runs) as usize
        + study.figures.iter().map(points).sum::<usize>()
}

fn rows(study: &StudyFile, runs: &mut Runs, count: u32, seed: u64) -> Result<Vec<Row>, StudyError> {
    let mut rows = Vec::new();
    for line in &study.lines {
        let made = runs.make(&line.title, study.common.with(&line.with), count, seed)?;
        rows.push(Row { title: line.title.clone(), runs: made });
    }
    Ok(rows)
}

fn swept(
    common: &Common,
    sweep: &Sweep,
    runs: &mut Runs,
    count: u32,
    seed: u64,
) -> Result<Figure, StudyError> {
    let whole = [Line { title: String::new(), with: Common::default() }];
    let lines: &[Line] = if sweep.lines.is_empty() { &whole } else { &sweep.lines };
    let mut curves = Vec::new();
    for line in lines {
        let with = common.with(&line.with);
        let mut drawn: Vec<Curve> = sweep
            .show
            .iter()
            .map(|show| Curve { name: curve_name(&line.title, *show), points: Vec::new() })
            .collect();
        let mut failed = Vec::new();
        for value in &sweep.values {
            let made = runs.make(&sweep.figure, with.varied(&sweep.vary, *value), count, seed)?;
            for (curve, show) in drawn.iter_mut().zip(&sweep.show) {
                curve.points.extend(shown(&made, *show).map(|y| (*value, y)));
            }
            let lost = made.iter().filter(|run| run.missed.is_none()).count();
            failed.extend((lost > 0).then(|| format!("{lost} at {value}")));
        }
        if !failed.is_empty() {
            let title = line.title.trim_end_matches(',');
            let name = format!("{} {title}", sweep.figure);
            writeln!(
                std::io::stdout(),
                "{}: of {count} runs a point did not pass: {}",
                name.trim_end(),
                failed.join(", ")
            )?;
        }
        curves.extend(drawn);
    }
    Ok(Figure {
        file_name: sweep.figure.clone(),
        title: sweep.title.clone(),
        across: sweep.across.clone(),
        up: unit(&sweep.show).to_owned(),
        curves,
        scattered: false,
    })
}

fn curve_name(line: &str, show: Shown) -> String {
    let of = match show.of {
        Quantity::WaistDeg => "waist",
        Quantity::ShoulderDeg => "shoulder",
        Quantity::ElbowDeg => "elbow",
        Quantity::RadialMm => "radial",
        Quantity::AcrossMm => "across",
        Quantity::HeightMm => "height",
        Quantity::HandMm => "hand",
    };
    let how = match show.r#as {
        Statistic::Bias => "mean",
        Statistic::Spread => "spread",
        Statistic::Rms => "rms",
    };
    format!("{line} {of}, {how}").trim_start().to_owned()
}

fn unit(shown: &[Shown]) -> &'static str {
    let angle =
        |show: &Shown| matches!(show.of, Quantity::WaistDeg | Quantity::ShoulderDeg | Quantity::ElbowDeg);
    if shown.iter().all(angle) { "error of the zero, deg" } else { "true place less corrected, mm" }
}

/// The figure in numbers.
fn describe(sweep: &Sweep, drawn: &Figure, count: u32) -> String {
    let mut text =
        format!("{}: {}\n{}{count} runs a point\n", sweep.figure, sweep.title, with_end(&sweep.about));
    let width = drawn.curves.iter().map(|curve| curve.name.chars().count()).max().unwrap_or(0).max(12);
    text.push_str(&format!("{:<width$}", sweep.across));
    for value in &sweep.values {
        text.push_str(&format!(" {value:>8}"));
    }
    text.push('\n');
    for curve in &drawn.curves {
        text.push_str(&format!("{:<width$}", curve.name));
        for value in &sweep.values {
            let at = curve.points.iter().find(|(x, _)| x == value);
            text.push_str(&at.map_or_else(|| format!(" {:>8}", "-"), |(_, y)| format!(" {y:>8.4}")));
        }
        text.push('\n');
    }
    text.push('\n');
    text
}

fn with_end(text: &str) -> String {
    if text.is_empty() { String::new() } else { format!("{}\n", text.trim_end()) }
}
