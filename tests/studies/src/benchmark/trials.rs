//! Running trials: every analyst on the same cases, on all processors.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::Instant;

use plumb_diagnosis::laboratory::LaboratoryError;
use plumb_estimation::Progress;
use plumb_simulated::physics::campaign::{Case, Hidden, Verdict};
use serde::Serialize;

use super::cells::Work;
use super::error::BenchmarkError;
use super::evidence::Evidence;
use super::{correlation, forward_bic, lab, lasso};
use plumb::commands::trial::score::{Candidate, Diagnosis, Score};
use plumb::progress::watched;

/// Who diagnoses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Analyst {
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
    /// Everyone.
    pub(super) const ALL: [Self; 4] = [Self::Lab, Self::Correlation, Self::Lasso, Self::ForwardBic];

    /// Name in the report.
    pub(super) fn name(self) -> &'static str {
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
pub(super) struct Trial {
    pub(super) seed: u64,
    pub(super) arm: String,
    pub(super) hidden: Vec<Hidden>,
    /// Whether the library has a name for what is hidden.
    pub(super) can_be_named: bool,
    pub(super) verdict: Verdict,
    pub(super) diagnosed: Vec<String>,
    pub(super) score: Score,
    /// Whether growing the model added just what is hidden; asked where several effects are.
    pub(super) grown: Option<bool>,
    pub(super) seconds: f64,
}

/// Does something with every case of a cell, on all processors; in the cases' order.
pub(super) fn over_cases<T: Send>(
    work: &Work,
    seed: u64,
    count: usize,
    each: impl Fn(&Case) -> Result<T, BenchmarkError> + Sync,
) -> Result<Vec<T>, BenchmarkError> {
    watched(|progress| over_cases_watched(work, seed, count, each, progress))
}

fn over_cases_watched<T: Send>(
    work: &Work,
    seed: u64,
    count: usize,
    each: impl Fn(&Case) -> Result<T, BenchmarkError> + Sync,
    progress: &Progress,
) -> Result<Vec<T>, BenchmarkError> {
    let (next, over) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let workers = thread::available_parallelism().map_or(1, usize::from).min(count);
    let one_worker = || -> Result<Vec<(usize, T)>, BenchmarkError> {
        let mut done = Vec::new();
        loop {
            let number = next.fetch_add(1, Ordering::Relaxed);
            if number >= count {
                return Ok(done);
            }
            if let Some(case) = work.case(seed, number) {
                done.push((number, each(&case)?));
            }
            let over = over.fetch_add(1, Ordering::Relaxed) + 1;
            // Nobody ends it but by ending the program.
            let _ = progress.report(over as f64 / count as f64, &format!("{over} of {count} trials"));
        }
    };
    let parts: Vec<Result<Vec<(usize, T)>, BenchmarkError>> = thread::scope(|scope| {
        let handles: Vec<_> = (0..workers).map(|_| scope.spawn(one_worker)).collect();
        let joined = handles.into_iter().map(thread::ScopedJoinHandle::join);
        joined.map(|part| part.unwrap_or_else(|panic| std::panic::resume_unwind(panic))).collect()
    });
    let mut all: Vec<(usize, T)> =
        parts.into_iter().collect::<Result<Vec<_>, _>>()?.into_iter().flatten().collect();
    all.sort_by_key(|(number, _)| *number);
    Ok(all.into_iter().map(|(_, done)| done).collect())
}

/// Every analyst on every trial of a cell.
pub(super) fn all_trials(
    work: &Work,
    analysts: &[Analyst],
    seed: u64,
    count: usize,
) -> Result<Vec<Vec<Trial>>, BenchmarkError> {
    let all = over_cases(work, seed, count, |case| judge(case, analysts))?;
    let mut by_analyst: Vec<Vec<Trial>> = analysts.iter().map(|_| Vec::new()).collect();
    for trials in all {
        by_analyst.iter_mut().zip(trials).for_each(|(list, trial)| list.push(trial));
    }
    Ok(by_analyst)
}

fn judge(case: &Case, analysts: &[Analyst]) -> Result<Vec<Trial>, BenchmarkError> {
    let peers = analysts.iter().any(|analyst| *analyst != Analyst::Lab);
    let evidence = if peers { Evidence::of(case)? } else { Evidence::default() };
    let truth = &case.truth;
    let judged = analysts.iter().map(|analyst| {
        let start = Instant::now();
        let refused = |source| BenchmarkError::Lab { seed: truth.seed, source: Box::new(source) };
        let diagnosis = analyst.diagnose(case, &evidence).map_err(refused)?;
        let seconds = start.elapsed().as_secs_f64();
        let grown = match analyst {
            Analyst::Lab if truth.grow => {
                Some(Score::of(&lab::grow(case).map_err(refused)?, truth).grown_exactly)
            }
            _ => None,
        };
        Ok(Trial {
            seed: truth.seed,
            arm: case.specification.arm.name.clone(),
            hidden: truth.hidden.clone(),
            can_be_named: !truth.effects.is_empty(),
            verdict: diagnosis.verdict,
            diagnosed: diagnosed(&diagnosis),
            score: Score::of(&diagnosis, truth),
            grown,
            seconds,
        })
    });
    judged.collect()
}

/// What a diagnosis says, in short.
pub(super) fn diagnosed(diagnosis: &Diagnosis) -> Vec<String> {
    let label = |one: &Candidate| format!("{}({})", one.effect, one.site);
    let diagnosed = match &diagnosis.located {
        Some(located) if diagnosis.named.is_none() => {
            vec![format!("{}: {}", located.site, located.family.join(", "))]
        }
        _ => diagnosis.named.iter().chain(&diagnosis.tied).take(3).map(label).collect(),
    };
    diagnosed.into_iter().chain(diagnosis.besides.iter().map(|one| format!("besides {one}"))).collect()
}
