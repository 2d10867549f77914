//! What came out of a cell, in figures and as a table.

use std::collections::BTreeMap;

use plumb_simulated::physics::campaign::{Hidden, Verdict};
use serde::Serialize;

use super::trials::{Analyst, Trial};
use crate::interval::Proportion;

/// One analyst on one cell.
#[derive(Debug, Serialize)]
pub(super) struct Row {
    cell: &'static str,
    analyst: Analyst,
    trials: usize,
    #[serde(rename = "shares")]
    fractions: BTreeMap<&'static str, Proportion>,
    /// Share of right diagnoses by what was hidden.
    right_by_effect: BTreeMap<String, Proportion>,
    seconds_a_trial: f64,
    wrong: Vec<Wrong>,
}

/// A trial that went wrong, or whose size is off, to be looked at.
#[derive(Debug, Serialize)]
struct Wrong {
    seed: u64,
    arm: String,
    hidden: Vec<String>,
    verdict: Verdict,
    diagnosed: Vec<String>,
    size_error_over_se: Option<f64>,
}

/// Sums an analyst's trials up.
pub(super) fn summary(cell: &'static str, analyst: Analyst, trials: Vec<Trial>) -> Row {
    let mut fractions = BTreeMap::new();
    let mut add_fraction = |name: &'static str, holds: &dyn Fn(&Trial) -> bool| {
        fractions.insert(name, Proportion::of(trials.iter().map(holds)));
    };
    add_fraction("right", &|trial| trial.score.right);
    add_fraction("named", &|trial| trial.verdict == Verdict::Named);
    add_fraction("falsely_named", &|trial| trial.score.false_name);
    if trials.iter().any(|trial| trial.can_be_named) {
        add_fraction("truth_first", &|trial| trial.score.truth_first);
        add_fraction("truth_in_set", &|trial| trial.score.truth_in_set);
    }
    if trials.iter().any(|trial| !trial.hidden.is_empty()) {
        add_fraction("place_right", &|trial| trial.score.site_right);
    }
    if trials.iter().any(|trial| trial.grown.is_some()) {
        fractions.insert("grown_exactly", Proportion::of(trials.iter().filter_map(|trial| trial.grown)));
    }
    let sized: Vec<f64> = trials.iter().filter_map(|trial| trial.score.size_error_over_se).collect();
    if !sized.is_empty() {
        fractions
            .insert("size_within_3_errors", Proportion::of(sized.iter().map(|error| error.abs() <= 3.0)));
    }
    let mut right_by_effect: BTreeMap<String, Vec<bool>> = BTreeMap::new();
    for trial in &trials {
        for hidden in &trial.hidden {
            right_by_effect.entry(hidden.effect.clone()).or_default().push(trial.score.right);
        }
    }
    let seconds = trials.iter().map(|trial| trial.seconds).sum::<f64>() / trials.len().max(1) as f64;
    let count = trials.len();
    let wrong = trials
        .into_iter()
        .filter(|trial| {
            !trial.score.right || trial.score.size_error_over_se.is_some_and(|error| error.abs() > 3.0)
        })
        .map(|trial| Wrong {
            seed: trial.seed,
            arm: trial.arm,
            hidden: trial.hidden.iter().map(describe).collect(),
            verdict: trial.verdict,
            diagnosed: trial.diagnosed,
            size_error_over_se: trial.score.size_error_over_se,
        });
    Row {
        cell,
        analyst,
        trials: count,
        fractions,
        wrong: wrong.collect(),
        right_by_effect: right_by_effect
            .into_iter()
            .map(|(effect, right)| (effect, Proportion::of(right)))
            .collect(),
        seconds_a_trial: seconds,
    }
}

/// Something hidden, in words.
pub(super) fn describe(hidden: &Hidden) -> String {
    let details: String = hidden.details.iter().map(|(key, value)| format!(", {key} {value}")).collect();
    format!(
        "{}({}{details}) {:.2e} {}, {:.1}x noise, {:.1} standard errors",
        hidden.effect, hidden.site, hidden.size, hidden.unit, hidden.over_noise, hidden.standard_errors
    )
}

/// The table's columns: title, and the fraction it shows.
const COLUMNS: [(&str, &str); 8] = [
    ("right", "right"),
    ("named", "named"),
    ("false name", "falsely_named"),
    ("truth first", "truth_first"),
    ("truth in set", "truth_in_set"),
    ("place", "place_right"),
    ("size in 3 se", "size_within_3_errors"),
    ("grown exactly", "grown_exactly"),
];

/// The table's heading.
pub(super) fn heading() -> String {
    let columns: String = COLUMNS.iter().map(|(title, _)| format!("{title:>20}")).collect();
    format!("{:<14}{columns}{:>10}\n", "percent", "s each")
}

/// An analyst's line of the table: percent, and the 95 % interval.
pub(super) fn line(row: &Row) -> String {
    let cell = |name: &str| row.fractions.get(name).map_or_else(|| "-".to_owned(), Proportion::percent);
    let columns: String = COLUMNS.iter().map(|(_, name)| format!("{:>20}", cell(name))).collect();
    format!("  {:<12}{columns}{:>10.3}\n", row.analyst.name(), row.seconds_a_trial)
}
