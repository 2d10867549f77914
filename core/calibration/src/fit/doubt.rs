//! Fits that ran away: reported, and not taken for results.

use std::fmt;

use plumb_estimation::{NormalEquations, RankRevealingCholesky};

use super::residual_model::{Part, ResidualModel};
use super::state::{FreeParameter, State};
use crate::effect::{self, Family, LooksAt, Parameter};

/// Factor by which the robust fit may miss the rows it trusts more than plain least squares does: it should miss them less, and the descents end within a few per
/// cent of their minimum.
const WORSE: f64 = 1.05;

/// Huber weight from which a row is trusted: it lies inside the others' scatter.
const TRUSTED: f64 = 0.999;

/// Standard deviations from zero to either end of a plausible range: the usual reading of a range as two sigmas.
const RANGE_SIGMAS: f64 = 2.0;

/// A number this many times beyond its range is not shown: it means nothing but that the fit ran away.
const BEYOND_SHOWING: f64 = 10.0;

/// Share of a fit's own variance by which that differs at most with which plausible ranges were weighed in it: how wide a range is nobody knows to that, and weighing anew is a descent of its own.
const SAME_VARIANCE: f64 = 0.1;

/// Numbers that a message names at most.
const NAMED: usize = 3;

/// What went wrong in a fit, and what was done about it.
#[derive(Debug, Clone, PartialEq)]
pub enum FitDoubt {
    /// The robust fit misses the rows it trusts by more than plain least squares does: the plain fit is used.
    WorseThanPlain {
        /// Root mean square of the trusted rows' residuals in the robust fit, in declared sigmas (mm where none is declared).
        robust: f64,
        /// The same in the plain fit.
        plain: f64,
    },
    /// Numbers that the rows hardly determine: the plausible ranges were used as prior knowledge, and they stay inside.
    Bounded(Vec<String>),
    /// Numbers outside their plausible ranges whatever is known beforehand, with value and range: the rows determine them.
    Implausible(Vec<String>),
}

/// The first of some numbers, and how many more there are.
fn listed(numbers: &[String]) -> String {
    let mut shown: Vec<String> = numbers.iter().take(NAMED).cloned().collect();
    if numbers.len() > NAMED {
        shown.push(format!("{} more", numbers.len() - NAMED));
    }
    shown.join(", ")
}

impl fmt::Display for FitDoubt {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::WorseThanPlain { robust, plain } => write!(
                formatter,
                "the robust fit ran away: it misses the rows it trusts by {:.2} times as much as plain least squares does, which is used instead; look for rows that \
                 do not belong, or free fewer numbers",
                robust / plain.max(1e-300)
            ),
            Self::Bounded(numbers) => write!(
                formatter,
                "these rows hardly determine {}: left alone they run out of what a machine can have, so their plausible ranges were used as prior knowledge; measure \
                 more poses, or free fewer numbers (`--free`)",
                listed(numbers)
            ),
            Self::Implausible(numbers) => write!(
                formatter,
                "these rows ask for numbers that no machine has: {}; check the model file's rows, and the units and signs of the table's joints",
                listed(numbers)
            ),
        }
    }
}

/// The robust fit against the plain one it started from: a doubt if it misses the rows it trusts by more.
pub(super) fn worse_than_plain(
    problem: &ResidualModel<'_>,
    (robust, weights): (&State, &[f64]),
    plain: &State,
    rows: &[usize],
) -> Option<FitDoubt> {
    let mut trusted = rows.to_vec();
    // Rows that the robust fit has weighed down are those it is allowed to miss.
    trusted.retain(|row| weights.get(*row).copied().unwrap_or(1.0) >= TRUSTED);
    let equations: usize = trusted.iter().map(|row| problem.observations.range(*row).len()).sum();
    let ones = vec![1.0; problem.observations.rows()];
    let [robust, plain] = [robust, plain]
        .map(|state| (problem.squares(state, &trusted, &ones) / equations.max(1) as f64).sqrt());
    // Not a number counts as worse.
    let is_as_good = robust <= WORSE * plain;
    (!is_as_good).then_some(FitDoubt::WorseThanPlain { robust, plain })
}

/// Whether a number's range counts as prior knowledge: of the geometry, and of what gives under weight to either side, whose terms may nearly cancel each other or a wave of the joint. Alone these
/// run to bends of half a radian for the sake of what the bends do to each other.
fn is_bounded(part: &Part, parameter: &Parameter) -> bool {
    let (low, high) = parameter.range;
    effect::kind(&part.id.name).is_some_and(|kind| kind.family == Family::Geometry)
        || (part.looks_at == LooksAt::Gravity && low < 0.0 && high > 0.0)
}

/// The effect's parameter that a free one is, where its range counts.
fn ranged<'m>(
    problem: &'m ResidualModel<'_>,
    free_parameter: &FreeParameter,
) -> Option<(&'m Parameter, usize, usize)> {
    let FreeParameter::Effect(part, which) = *free_parameter else { return None };
    let known = problem.parts.get(part)?;
    let parameter = known.effect.parameters().get(which).filter(|parameter| is_bounded(known, parameter))?;
    Some((parameter, part, which))
}

fn value(state: &State, part: usize, which: usize) -> f64 {
    state.effects.get(part).and_then(|values| values.get(which)).copied().unwrap_or(0.0)
}

/// Numbers outside the range that a machine can have: free parameter and value, internal unit.
pub(super) fn out_of_range(problem: &ResidualModel<'_>, state: &State) -> Vec<(usize, f64)> {
    let values = problem.free_parameters().iter().enumerate().filter_map(|(index, free_parameter)| {
        let (parameter, part, which) = ranged(problem, free_parameter)?;
        Some((index, value(state, part, which), parameter.range))
    });
    // Written so that what is not a number is outside as well.
    let outside = values.filter(|(_, value, (low, high))| !(value >= low && value <= high));
    outside.map(|(index, value, _)| (index, value)).collect()
}

/// Numbers whose standard error is larger than their range where the rows scatter by `scale`: free parameter and zero.
pub(super) fn undetermined(
    problem: &ResidualModel<'_>,
    factor: &RankRevealingCholesky,
    scale: f64,
) -> Vec<(usize, f64)> {
    let has_range =
        problem.free_parameters().iter().any(|free_parameter| ranged(problem, free_parameter).is_some());
    if !has_range {
        return Vec::new();
    }
    let inverse = factor.inverse();
    let errors = problem.free_parameters().iter().enumerate().filter_map(|(index, free_parameter)| {
        let (parameter, ..) = ranged(problem, free_parameter)?;
        let (low, high) = parameter.range;
        // What the factor left out has no variance here: it stays where the model file has it, and cannot run away.
        let variance = inverse.get((index, index)).copied().unwrap_or(0.0);
        Some((index, scale * variance.sqrt(), low.abs().max(high.abs())))
    });
    errors.filter(|(_, error, reach)| error > reach).map(|(index, ..)| (index, 0.0)).collect()
}

/// What to say of numbers that had left their ranges, or would, now that the ranges count.
pub(super) fn range_doubts(
    problem: &ResidualModel<'_>,
    far: &[(usize, f64)],
    bounded: &State,
) -> Vec<FitDoubt> {
    let still = out_of_range(problem, bounded);
    let came_back =
        far.iter().filter(|(index, _)| still.iter().all(|(free_parameter, _)| free_parameter != index));
    let inside: Vec<String> = came_back
        .filter_map(|(index, _)| {
            problem
                .free_parameters()
                .get(*index)
                .map(|free_parameter| problem.parameter_name(*free_parameter))
        })
        .collect();
    let outside: Vec<String> =
        still.iter().filter_map(|(index, value)| shown_outside(problem, *index, *value)).collect();
    let bounded = (!inside.is_empty()).then_some(FitDoubt::Bounded(inside));
    let implausible = (!outside.is_empty()).then_some(FitDoubt::Implausible(outside));
    bounded.into_iter().chain(implausible).collect()
}

/// A number beside its range, as people read both.
fn shown_outside(problem: &ResidualModel<'_>, index: usize, value: f64) -> Option<String> {
    let free_parameter = problem.free_parameters().get(index)?;
    let (parameter, ..) = ranged(problem, free_parameter)?;
    let (low, high) = parameter.range;
    let (factor, unit) = (parameter.unit.factor, parameter.unit.name);
    let shown = match value.abs() <= BEYOND_SHOWING * low.abs().max(high.abs()) {
        true => format!("{:.3}", value * factor),
        false => "far".to_owned(),
    };
    let name = problem.parameter_name(*free_parameter);
    Some(format!("{name} ({shown} outside {:.3} to {:.3} {unit})", low * factor, high * factor))
}

/// Plausible ranges as observations of zero (Bayesian least squares: Tarantola 2005, section 3.2).
pub(super) struct Prior {
    /// Variance of one equation, in declared sigmas squared: what the ranges are weighed against.
    pub(super) variance: f64,
    /// Slots that have no part in it.
    pub(super) spared: Vec<usize>,
}

impl Prior {
    /// Whether a fit of this scatter (declared sigmas) would weigh the ranges alike.
    pub(super) fn is_weighed_as_by(&self, scale: f64) -> bool {
        let variance = scale * scale;
        (self.variance - variance).abs() <= SAME_VARIANCE * variance
    }

    /// Adds the ranges to normal equations.
    pub(super) fn add(&self, problem: &ResidualModel<'_>, state: &State, normal: &mut NormalEquations) {
        for (index, free_parameter) in problem.free_parameters().iter().enumerate() {
            let Some((parameter, part, which)) = ranged(problem, free_parameter) else { continue };
            if self.spared.contains(&index) {
                continue;
            }
            let (low, high) = parameter.range;
            let sigma = low.abs().max(high.abs()) / RANGE_SIGMAS;
            // An observation of zero with this sigma, in the metric of the rows: their sigmas are declared, and their scatter is `variance` of those.
            let weight = self.variance / (sigma * sigma);
            let value = value(state, part, which);
            normal.matrix[(index, index)] += weight;
            normal.gradient[index] -= weight * value;
            normal.squares += weight * value * value;
        }
    }
}
