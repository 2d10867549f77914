//! A peer in the manner of telescope pointing programs: terms added as long as the Bayesian information criterion falls.
//!
//! After the open re-make of such a program (gaker/celestial): physical terms are tried in the order of the list, each kept when it lowers the criterion by
//! six; then harmonics best first; then terms below two standard errors are dropped; readings beyond 2.5 standard deviations are masked and all of it is done
//! again, five times at most.

use plumb_simulated::physics::campaign::Verdict;
use plumb_simulated::physics::campaign::audit::Basis;

use super::evidence::{Evidence, Projected, dot};
use plumb::commands::trial::score::{Candidate, Diagnosis};

const NEEDED_REDUCTION: f64 = 6.0;
const LEAST_STANDARD_ERRORS: f64 = 2.0;
const MASK_BEYOND: f64 = 2.5;
const PASSES: usize = 5;
const GREATEST_SIZE: usize = 30;

/// Adds terms; names the strongest one kept.
pub(super) fn diagnose(evidence: &Evidence) -> Diagnosis {
    let mut keep = vec![true; evidence.rows()];
    let mut problem = evidence.projected(&keep);
    let mut terms = search(&problem);
    for _ in 1..PASSES {
        if !mask(evidence, &problem, &terms, &mut keep) {
            break;
        }
        problem = evidence.projected(&keep);
        terms = search(&problem);
    }
    let mut strengths = strengths(&problem, &terms);
    strengths.sort_by(|a, b| b.1.total_cmp(&a.1));
    let candidates: Vec<Candidate> = strengths
        .iter()
        .filter_map(|(term, _)| problem.regressors.get(*term))
        .map(|regressor| Candidate::at(regressor.effect, &regressor.site))
        .collect();
    Diagnosis {
        verdict: if candidates.is_empty() { Verdict::AtFloor } else { Verdict::Named },
        named: candidates.first().cloned(),
        tied: candidates.clone(),
        candidates,
        ..Diagnosis::empty()
    }
}

fn criterion(problem: &Projected, squares: f64, parameters: usize) -> f64 {
    let count = problem.residual.len() as f64;
    count * (squares / count).ln() + parameters as f64 * count.ln()
}

fn squares_left(problem: &Projected, terms: &[usize]) -> (f64, usize) {
    let span = span(problem, terms);
    let mut left = problem.residual.clone();
    span.remove_from(&mut left);
    (dot(&left, &left), span.rank())
}

fn span(problem: &Projected, terms: &[usize]) -> Basis {
    Basis::of(
        terms
            .iter()
            .filter_map(|term| problem.regressors.get(*term))
            .flat_map(|one| one.columns.iter().cloned()),
    )
}

fn search(problem: &Projected) -> Vec<usize> {
    let is_harmonic =
        |term: &usize| problem.regressors.get(*term).is_some_and(|one| one.effect == "joint_harmonic");
    let (harmonics, physical): (Vec<usize>, Vec<usize>) =
        (0..problem.regressors.len()).partition(is_harmonic);
    let mut terms: Vec<usize> = Vec::new();
    let value = |terms: &[usize]| {
        let (squares, parameters) = squares_left(problem, terms);
        criterion(problem, squares, parameters)
    };
    let mut best = value(&terms);
    for term in physical {
        terms.push(term);
        let tried = value(&terms);
        if tried < best - NEEDED_REDUCTION && terms.len() <= GREATEST_SIZE {
            best = tried;
        } else {
            terms.pop();
        }
    }
    let mut open = harmonics;
    while terms.len() < GREATEST_SIZE {
        let with = |term: &usize| value(&terms.iter().copied().chain([*term]).collect::<Vec<_>>());
        let Some((index, tried)) = open.iter().map(with).enumerate().min_by(|a, b| a.1.total_cmp(&b.1))
        else {
            break;
        };
        if tried >= best - NEEDED_REDUCTION {
            break;
        }
        best = tried;
        terms.push(open.swap_remove(index));
    }
    while let Some((weakest, strength)) =
        strengths(problem, &terms).into_iter().min_by(|a, b| a.1.total_cmp(&b.1))
    {
        if strength >= LEAST_STANDARD_ERRORS {
            break;
        }
        terms.retain(|term| *term != weakest);
    }
    terms
}

/// Each term with its strength in standard errors: what leaving it out would cost.
fn strengths(problem: &Projected, terms: &[usize]) -> Vec<(usize, f64)> {
    let (squares, parameters) = squares_left(problem, terms);
    let variance = squares / problem.freedom.saturating_sub(parameters).max(1) as f64;
    let strength = |term: usize| {
        let others: Vec<usize> = terms.iter().copied().filter(|other| *other != term).collect();
        ((squares_left(problem, &others).0 - squares).max(0.0) / variance).sqrt()
    };
    terms.iter().map(|term| (*term, strength(*term))).collect()
}

/// Masks rows whose readings lie beyond the limit; says whether any was masked.
fn mask(evidence: &Evidence, problem: &Projected, terms: &[usize], keep: &mut [bool]) -> bool {
    let mut left = problem.residual.clone();
    let span = span(problem, terms);
    span.remove_from(&mut left);
    let freedom = problem.freedom.saturating_sub(span.rank()).max(1);
    let limit = MASK_BEYOND * (dot(&left, &left) / freedom as f64).sqrt();
    let far: Vec<bool> = left
        .chunks(evidence.readings_a_row.max(1))
        .map(|row| row.iter().any(|value| value.abs() > limit))
        .collect();
    let mut far = far.into_iter();
    let mut masked = false;
    for kept in keep.iter_mut().filter(|kept| **kept) {
        if far.next() == Some(true) {
            *kept = false;
            masked = true;
        }
    }
    masked
}
