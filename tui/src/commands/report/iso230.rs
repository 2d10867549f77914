//! `plumb report iso230`.

use std::error::Error;

use plumb_calibration::arm_model::Model;
use plumb_calibration::table::Table;
use plumb_report::figure::{Curve, Figure, svg};
use plumb_standards::{
    AtTarget, AxisChoice, AxisRun, Budget, Iso230, OneSide, Question, Unidirectional, budget, iso_230_2,
};
use serde::Serialize;

use super::arguments::Iso230Arguments;
use super::page::Page;
use super::words::{Grid, budget_grid, budget_sentence, number, or_dash, position};

/// The report with its budget, as JSON has it.
#[derive(Serialize)]
struct WithBudget<'a> {
    #[serde(flatten)]
    report: &'a Iso230,
    #[serde(skip_serializing_if = "Option::is_none")]
    budget: Option<&'a Budget>,
}

/// Reads, computes, prints.
///
/// # Errors
/// A file that cannot be read, or a table that is no run along an axis.
pub(super) fn run(arguments: &Iso230Arguments) -> Result<String, Box<dyn Error>> {
    let (table, model) = arguments.table.open()?;
    let joint = arguments.axis.as_deref().map(|name| joint_of(name, &table, model.as_ref())).transpose()?;
    let run = AxisRun::of(&table, &AxisChoice { joint, reading: arguments.reading.clone() })?;
    let report = iso_230_2(&run);
    let rows: Vec<usize> = run.targets.iter().flat_map(|target| target.rows.clone()).collect();
    let question = Question { reading: &run.reading, unit: run.unit, rows: &rows };
    let budget = model.as_ref().map(|model| budget(model, &table, &question)).transpose()?;
    let digits = arguments.table.digits;
    let text = text(&report, budget.as_ref(), digits);
    let with_budget = WithBudget { report: &report, budget: budget.as_ref() };
    arguments.table.give(&with_budget, text, || page(&report, budget.as_ref(), &table.source, digits))
}

/// A joint by its column or its name in the model.
fn joint_of(name: &str, table: &Table, model: Option<&Model>) -> Result<usize, String> {
    let by_number = name.strip_prefix('q').and_then(|digits| digits.parse::<usize>().ok());
    let by_model = || model.and_then(|model| model.chain.position_of(name));
    let joint = by_number.and_then(|number| number.checked_sub(1)).or_else(by_model);
    joint.filter(|joint| *joint < table.joints).ok_or_else(|| {
        let names = model.into_iter().flat_map(|model| &model.chain.joints).map(|joint| joint.name.clone());
        let known: Vec<String> = (1..=table.joints).map(|number| format!("q{number}")).chain(names).collect();
        format!("{}: there is no axis `{name}`; there are {}", table.source, known.join(", "))
    })
}

/// What was measured, in a line.
fn sentence(report: &Iso230) -> String {
    let ends = report.at.first().zip(report.at.last());
    let (first, last) = ends.map_or((0.0, 0.0), |(first, last)| (first.commanded, last.commanded));
    let sides = if report.bidirectional.is_some() { "from each side" } else { "from one side" };
    format!(
        "{} of {}: {} targets from {} to {}, approached {} times {sides}; all in {}",
        report.reading,
        report.axis,
        report.targets,
        position(first),
        position(last),
        report.approaches,
        report.unit.name()
    )
}

fn text(report: &Iso230, budget: Option<&Budget>, digits: u8) -> String {
    let mut text = format!("{}\n{}\n", report.standard, sentence(report));
    text.push_str(&figures(report, digits).text());
    text.push_str(&targets(report, digits).text());
    if let Some(budget) = budget {
        text.push_str(&budget_grid(budget, digits).text());
        text.push_str(&format!("  {}\n", budget_sentence(budget, digits)));
    }
    for note in &report.notes {
        text.push_str(&format!("note: {note}\n"));
    }
    text
}

/// The figures of the axis.
fn figures(report: &Iso230, digits: u8) -> Grid {
    let mut grid = Grid::new("", &["", "", "both directions", "positive (+)", "negative (-)"]);
    let both = report.bidirectional;
    let of =
        |side: Option<Unidirectional>, figure: fn(Unidirectional) -> f64| or_dash(side.map(figure), digits);
    let mut row = |name: &str, letter: &str, figure: Option<f64>, one: Option<fn(Unidirectional) -> f64>| {
        let side = |side: Option<Unidirectional>| one.map_or_else(String::new, |one| of(side, one));
        grid.rows.push(vec![
            name.to_owned(),
            letter.to_owned(),
            or_dash(figure, digits),
            side(report.positive),
            side(report.negative),
        ]);
    };
    row("accuracy", "A", both.map(|both| both.accuracy), Some(|side| side.accuracy));
    row("systematic positioning error", "E", both.map(|both| both.systematic), Some(|side| side.systematic));
    row("mean positioning error", "M", both.map(|both| both.mean), None);
    row("repeatability", "R", both.map(|both| both.repeatability), Some(|side| side.repeatability));
    row("reversal error", "B", both.map(|both| both.reversal), None);
    row("mean reversal error", "mean B", both.map(|both| both.mean_reversal), None);
    grid
}

/// Target by target.
fn targets(report: &Iso230, digits: u8) -> Grid {
    let mut grid = Grid::new(
        "At each target",
        &["target", "mean +", "s +", "R +", "mean -", "s -", "R -", "mean", "B", "R"],
    );
    for at in &report.at {
        let of =
            |side: &Option<OneSide>, figure: fn(&OneSide) -> f64| or_dash(side.as_ref().map(figure), digits);
        let mut row = vec![position(at.commanded)];
        for side in [&at.positive, &at.negative] {
            row.extend([
                of(side, |side| side.mean),
                of(side, |side| side.s),
                of(side, |side| side.repeatability),
            ]);
        }
        row.extend([at.mean, at.reversal, at.repeatability].map(|value| or_dash(value, digits)));
        grid.rows.push(row);
    }
    grid
}

/// Every approach, as read.
fn deviations(report: &Iso230, digits: u8) -> Grid {
    let head: Vec<String> = (1..=report.approaches).map(|approach| format!("approach {approach}")).collect();
    let mut grid = Grid::new("Deviations of every approach", &["target", "direction"]);
    grid.head.extend(head);
    for at in &report.at {
        for (name, side) in [("+", &at.positive), ("-", &at.negative)] {
            let Some(side) = side else { continue };
            let mut row = vec![position(at.commanded), name.to_owned()];
            row.extend(side.deviations.iter().map(|deviation| number(*deviation, digits)));
            grid.rows.push(row);
        }
    }
    grid
}

/// Means of both directions, and the limits between which the accuracy is.
fn drawing(report: &Iso230) -> Figure {
    let curve = |name: &str, of: &dyn Fn(&AtTarget) -> Option<f64>| Curve {
        name: name.to_owned(),
        points: report.at.iter().filter_map(|at| Some((at.commanded, of(at)?))).collect(),
    };
    let limit = |at: &AtTarget, sense: f64| {
        let ends =
            [&at.positive, &at.negative].into_iter().flatten().map(|side| sense * side.mean + 2.0 * side.s);
        ends.fold(None, |most: Option<f64>, end| Some(most.map_or(end, |most| most.max(end))))
            .map(|end| sense * end)
    };
    let unit = report.unit.name();
    Figure {
        file_name: "iso-230-2".to_owned(),
        title: format!("{}: deviations of {}", report.standard, report.axis),
        across: format!("commanded position, {unit}"),
        up: format!("deviation, {unit}"),
        curves: vec![
            curve("mean, positive direction", &|at| at.positive.as_ref().map(|side| side.mean)),
            curve("mean, negative direction", &|at| at.negative.as_ref().map(|side| side.mean)),
            curve("greatest mean + 2 s", &|at| limit(at, 1.0)),
            curve("least mean - 2 s", &|at| limit(at, -1.0)),
        ],
        scattered: false,
    }
}

fn page(report: &Iso230, budget: Option<&Budget>, source: &str, digits: u8) -> Result<String, String> {
    let page = Page {
        title: format!("{}: {}", report.standard, report.axis),
        lines: vec![format!("{}. Table: {source}", sentence(report))],
        grids: vec![figures(report, digits), targets(report, digits), deviations(report, digits)],
        drawing: Some(svg(&drawing(report))?),
        budget: budget.map(|budget| (budget_grid(budget, digits), budget_sentence(budget, digits))),
        notes: report.notes.clone(),
    };
    Ok(page.html())
}
