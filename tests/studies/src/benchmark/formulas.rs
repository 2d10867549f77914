//! Where the library has no name for what is hidden: whether a formula is offered, and whether it is one for what is hidden.

use plumb_diagnosis::Hypothesis;
use serde::Serialize;

use super::cells::Work;
use super::error::BenchmarkError;
use super::lab;
use super::report::describe;
use super::trials::over_cases;
use crate::interval::Proportion;

/// A formula has the right form if it acts where the hidden effect does, and takes away this share of the squares beyond the noise.
const RIGHT_SHARE: f64 = 0.8;

/// What became of a cell's trials.
#[derive(Debug, Serialize)]
pub(super) struct Row {
    cell: &'static str,
    #[serde(skip)]
    title: &'static str,
    offered: Proportion,
    /// The right site and `RIGHT_SHARE` of the squares.
    right: Proportion,
    /// The right site, whatever it takes away.
    #[serde(rename = "place")]
    site: Proportion,
    /// Another site, or nothing was hidden.
    wrong: Proportion,
    trials: Vec<Trial>,
}

/// One trial.
#[derive(Debug, Serialize)]
struct Trial {
    seed: u64,
    arm: String,
    hidden: Vec<String>,
    formula: Option<Hypothesis>,
    #[serde(rename = "right_place")]
    right_site: bool,
}

/// Asks for a formula in every trial of a cell.
pub(super) fn offered(work: &Work, seed: u64, count: usize) -> Result<Row, BenchmarkError> {
    let trials = over_cases(work, seed, count, |case| {
        let refused = |source| BenchmarkError::Lab { seed: case.truth.seed, source: Box::new(source) };
        let formula = lab::formula(case).map_err(refused)?;
        let site = formula.as_ref().map(|formula| formula.site.clone());
        Ok(Trial {
            seed: case.truth.seed,
            arm: case.specification.arm.name.clone(),
            hidden: case.truth.hidden.iter().map(describe).collect(),
            right_site: case.truth.hidden.iter().any(|hidden| Some(&hidden.site) == site.as_ref()),
            formula,
        })
    })?;
    let fraction = |holds: &dyn Fn(&Trial, &Hypothesis) -> bool| {
        Proportion::of(
            trials.iter().map(|one| one.formula.as_ref().is_some_and(|formula| holds(one, formula))),
        )
    };
    Ok(Row {
        cell: work.name(),
        title: work.title(),
        offered: fraction(&|_, _| true),
        right: fraction(&|one, formula| one.right_site && formula.explains >= RIGHT_SHARE),
        site: fraction(&|one, _| one.right_site),
        wrong: fraction(&|one, _| !one.right_site),
        trials,
    })
}

/// The head of the table.
pub(super) fn heading() -> String {
    format!(
        "{:<52} {:>20} {:>20} {:>20} {:>20}\n",
        "percent", "formula offered", "right form", "right place", "wrong place"
    )
}

/// A cell's line.
pub(super) fn line(row: &Row) -> String {
    let percent = Proportion::percent;
    format!(
        "{:<52} {:>20} {:>20} {:>20} {:>20}\n",
        format!("{} ({})", row.title, row.offered.trials),
        percent(&row.offered),
        percent(&row.right),
        percent(&row.site),
        percent(&row.wrong)
    )
}
