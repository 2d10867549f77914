//! `plumb trial benchmark`: hide something, diagnose, compare; many times, with every analyst on the same cases.

mod cells;
mod correlation;
mod evidence;
mod forward_bic;
mod interval;
mod lab;
mod lasso;

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::Instant;

use plumb_model::laboratory::LaboratoryError;
use plumb_simulated::physics::campaign::{Case, Hidden, Verdict};
use serde::Serialize;

use super::score::{Candidate, Diagnosis, Score};
use super::{Outcome, TrialError, write};
use cells::{CELLS, Cell, Hides};
use evidence::Evidence;
use interval::Share;

/// Options of `plumb trial benchmark`.
#[derive(Debug, clap::Args)]
pub(crate) struct BenchmarkArguments {
    /// Seed of the first trial of every cell.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Share of the full number of trials.
    #[arg(long, default_value_t = 1.0)]
    scale: f64,
    /// Only these cells; all when not given.
    #[arg(long = "cell", value_name = "NAME")]
    cells: Vec<String>,
    /// Only these analysts; all when not given.
    #[arg(long = "analyst", value_enum)]
    analysts: Vec<Analyst>,
    /// Write every figure and the seeds of the trials that went wrong as JSON.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// Who diagnoses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
enum Analyst {
    /// This program's lab.
    Lab,
    /// Plain correlation of residuals with signatures.
    Correlation,
    /// The lasso, cross-validated.
    Lasso,
    /// Forward selection by the Bayesian information criterion, as in telescope pointing.
    ForwardBic,
}

impl Analyst {
    const ALL: [Self; 4] = [Self::Lab, Self::Correlation, Self::Lasso, Self::ForwardBic];

    fn name(self) -> &'static str {
        match self {
            Self::Lab => "lab",
            Self::Correlation => "correlation",
            Self::Lasso => "lasso",
            Self::ForwardBic => "forward BIC",
        }
    }

    fn diagnose(self, case: &Case, evidence: &Evidence) -> Result<Diagnosis, LaboratoryError> {
        Ok(match self {
            Self::Lab => lab::diagnose(case)?,
            Self::Correlation => correlation::diagnose(evidence),
            Self::Lasso => lasso::diagnose(evidence),
            Self::ForwardBic => forward_bic::diagnose(evidence),
        })
    }
}

/// One analyst on one trial.
#[derive(Debug, Clone)]
struct Trial {
    seed: u64,
    arm: String,
    hidden: Vec<Hidden>,
    verdict: Verdict,
    said: Vec<String>,
    score: Score,
    seconds: f64,
}

/// One analyst on one cell.
#[derive(Debug, Serialize)]
struct Row {
    cell: &'static str,
    analyst: Analyst,
    trials: usize,
    shares: BTreeMap<&'static str, Share>,
    /// Share of right diagnoses by what was hidden.
    right_by_effect: BTreeMap<String, Share>,
    seconds_a_trial: f64,
    wrong: Vec<Wrong>,
}

/// A trial that went wrong, to be looked at.
#[derive(Debug, Serialize)]
struct Wrong {
    seed: u64,
    arm: String,
    hidden: Vec<String>,
    verdict: Verdict,
    said: Vec<String>,
}

/// Runs the benchmark.
pub(super) fn run(arguments: &BenchmarkArguments) -> Result<Outcome, TrialError> {
    let cells = chosen(&arguments.cells)?;
    let analysts =
        if arguments.analysts.is_empty() { Analyst::ALL.to_vec() } else { arguments.analysts.clone() };
    let mut rows = Vec::new();
    let mut said = String::new();
    for cell in cells {
        let count = ((cell.trials as f64 * arguments.scale).round() as usize).max(1);
        let trials = all_trials(&cell, &analysts, arguments.seed, count)?;
        said.push_str(&format!("{} ({count} trials)\n", cell.title));
        for (analyst, trials) in analysts.iter().zip(trials) {
            let row = summary(&cell, *analyst, trials);
            said.push_str(&line(&row));
            rows.push(row);
        }
    }
    if let Some(path) = &arguments.json {
        let text = serde_json::json!({"seed": arguments.seed, "scale": arguments.scale, "rows": rows});
        write(path, &format!("{text:#}\n"))?;
    }
    Ok(Outcome::done(said))
}

fn chosen(names: &[String]) -> Result<Vec<Cell>, TrialError> {
    if names.is_empty() {
        return Ok(CELLS.to_vec());
    }
    let find = |name: &String| {
        CELLS.iter().find(|cell| cell.name == name).copied().ok_or_else(|| TrialError::UnknownCell {
            name: name.clone(),
            known: CELLS.map(|cell| cell.name).join(", "),
        })
    };
    names.iter().map(find).collect()
}

/// Trials by their number in the cell, one for each analyst.
type Numbered = Vec<(usize, Vec<Trial>)>;

/// Every analyst on every trial of a cell, on all processors.
fn all_trials(
    cell: &Cell,
    analysts: &[Analyst],
    seed: u64,
    count: usize,
) -> Result<Vec<Vec<Trial>>, TrialError> {
    let next = AtomicUsize::new(0);
    let workers = thread::available_parallelism().map_or(1, usize::from).min(count);
    let work = || -> Result<Numbered, TrialError> {
        let mut done = Vec::new();
        loop {
            let number = next.fetch_add(1, Ordering::Relaxed);
            if number >= count {
                return Ok(done);
            }
            if let Some(case) = cell.case(seed, number) {
                done.push((number, judge(&case, analysts)?));
            }
        }
    };
    let parts: Vec<Result<Numbered, TrialError>> = thread::scope(|scope| {
        let handles: Vec<_> = (0..workers).map(|_| scope.spawn(work)).collect();
        handles.into_iter().filter_map(|handle| handle.join().ok()).collect()
    });
    let mut all: Numbered = parts.into_iter().collect::<Result<Vec<_>, _>>()?.concat();
    all.sort_by_key(|(number, _)| *number);
    let mut by_analyst: Vec<Vec<Trial>> = analysts.iter().map(|_| Vec::new()).collect();
    for (_, trials) in all {
        by_analyst.iter_mut().zip(trials).for_each(|(list, trial)| list.push(trial));
    }
    Ok(by_analyst)
}

fn judge(case: &Case, analysts: &[Analyst]) -> Result<Vec<Trial>, TrialError> {
    let peers = analysts.iter().any(|analyst| *analyst != Analyst::Lab);
    let evidence = if peers { Evidence::of(case)? } else { Evidence::default() };
    let truth = &case.truth;
    let label = |one: &Candidate| format!("{}({})", one.effect, one.place);
    let judged = analysts.iter().map(|analyst| {
        let start = Instant::now();
        let diagnosis = analyst
            .diagnose(case, &evidence)
            .map_err(|source| TrialError::Lab { seed: truth.seed, source: Box::new(source) })?;
        let seconds = start.elapsed().as_secs_f64();
        let said = match &diagnosis.located {
            Some(located) if diagnosis.named.is_none() => {
                vec![format!("{}: {}", located.place, located.family.join(", "))]
            }
            _ => diagnosis.named.iter().chain(&diagnosis.tied).take(3).map(label).collect(),
        };
        Ok(Trial {
            seed: truth.seed,
            arm: case.specification.arm.name.clone(),
            hidden: truth.hidden.clone(),
            verdict: diagnosis.verdict,
            said: said
                .into_iter()
                .chain(diagnosis.besides.iter().map(|one| format!("besides {one}")))
                .collect(),
            score: Score::of(&diagnosis, truth),
            seconds,
        })
    });
    judged.collect()
}

fn summary(cell: &Cell, analyst: Analyst, trials: Vec<Trial>) -> Row {
    let mut shares = BTreeMap::new();
    let mut tell = |name: &'static str, holds: &dyn Fn(&Trial) -> bool| {
        shares.insert(name, Share::of(trials.iter().map(holds)));
    };
    tell("right", &|trial| trial.score.right);
    tell("named", &|trial| trial.verdict == Verdict::Named);
    tell("falsely_named", &|trial| trial.score.false_name);
    if matches!(cell.hides(), Hides::One | Hides::Two) {
        tell("truth_first", &|trial| trial.score.truth_first);
        tell("truth_in_set", &|trial| trial.score.truth_in_set);
    }
    if cell.hides() != Hides::Nothing {
        tell("place_right", &|trial| trial.score.place_right);
    }
    let sized: Vec<f64> = trials.iter().filter_map(|trial| trial.score.size_error_over_se).collect();
    if !sized.is_empty() {
        shares.insert("size_within_3_errors", Share::of(sized.iter().map(|error| error.abs() <= 3.0)));
    }
    let mut right_by_effect: BTreeMap<String, Vec<bool>> = BTreeMap::new();
    for trial in &trials {
        for hidden in &trial.hidden {
            right_by_effect.entry(hidden.effect.clone()).or_default().push(trial.score.right);
        }
    }
    let seconds = trials.iter().map(|trial| trial.seconds).sum::<f64>() / trials.len().max(1) as f64;
    let count = trials.len();
    let wrong = trials.into_iter().filter(|trial| !trial.score.right).map(|trial| Wrong {
        seed: trial.seed,
        arm: trial.arm,
        hidden: trial.hidden.iter().map(told).collect(),
        verdict: trial.verdict,
        said: trial.said,
    });
    Row {
        cell: cell.name,
        analyst,
        trials: count,
        shares,
        wrong: wrong.collect(),
        right_by_effect: right_by_effect
            .into_iter()
            .map(|(effect, right)| (effect, Share::of(right)))
            .collect(),
        seconds_a_trial: seconds,
    }
}

fn told(hidden: &Hidden) -> String {
    let details: String = hidden.details.iter().map(|(key, value)| format!(", {key} {value}")).collect();
    format!(
        "{}({}{details}) {:.2e} {}, {:.1}x noise, {:.1} standard errors",
        hidden.effect, hidden.place, hidden.size, hidden.unit, hidden.over_noise, hidden.standard_errors
    )
}

fn line(row: &Row) -> String {
    let share = |(name, share): (&&str, &Share)| {
        format!(
            "{} {:.1} % [{:.1}, {:.1}]",
            name.replace('_', " "),
            100.0 * share.value(),
            100.0 * share.low,
            100.0 * share.high
        )
    };
    let shares: Vec<String> = row.shares.iter().map(share).collect();
    format!("  {:<12} {}; {:.3} s each\n", row.analyst.name(), shares.join(", "), row.seconds_a_trial)
}
