//! Fits that ran away: told, and not taken for results.

use std::fmt;

use plumb_estimation::{NormalEquations, RankRevealingCholesky};

use super::residual_model::ResidualModel;
use super::state::{Slot, State};
use crate::effect::{self, Family, Parameter};

/// Factor by which the robust fit may miss the rows it trusts more than plain least squares does: it should miss them less, and the descents end within a few per
/// cent of their minimum.
const WORSE: f64 = 1.05;

/// Huber weight from which a row is trusted: it lies inside the others' scatter.
const TRUSTED: f64 = 0.999;

/// Standard deviations from zero to either end of a plausible range: the usual reading of a range as two sigmas.
const RANGE_SIGMAS: f64 = 2.0;

/// A number this many times beyond its range is not shown: it means nothing but that the fit ran away.
const BEYOND_SHOWING: f64 = 10.0;

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
    machine: &ResidualModel<'_>,
    (robust, weights): (&State, &[f64]),
    plain: &State,
    rows: &[usize],
) -> Option<FitDoubt> {
    let is_trusted = |row: &usize| weights.get(*row).copied().unwrap_or(1.0) >= TRUSTED;
    let trusted: Vec<usize> = rows.iter().copied().filter(is_trusted).collect();
    let equations: usize = trusted.iter().map(|row| machine.observations.range(*row).len()).sum();
    let ones = vec![1.0; machine.observations.rows()];
    let miss = |state: &State| (machine.squares(state, &trusted, &ones) / equations.max(1) as f64).sqrt();
    let (robust, plain) = (miss(robust), miss(plain));
    // Not a number counts as worse.
    let is_as_good = robust <= WORSE * plain;
    (!is_as_good).then_some(FitDoubt::WorseThanPlain { robust, plain })
}

/// The parameter of a slot of the geometry that has a range.
fn ranged<'m>(machine: &'m ResidualModel<'_>, slot: &Slot) -> Option<(&'m Parameter, usize, usize)> {
    let Slot::Effect(part, which) = *slot else { return None };
    let known = machine.parts.get(part)?;
    let is_geometry = effect::kind(&known.id.name).is_some_and(|kind| kind.family == Family::Geometry);
    let parameter = known.effect.parameters().get(which).filter(|_| is_geometry)?;
    Some((parameter, part, which))
}

fn value(state: &State, part: usize, which: usize) -> f64 {
    state.effects.get(part).and_then(|values| values.get(which)).copied().unwrap_or(0.0)
}

/// Numbers of the geometry outside the range that a machine can have: slot and value, internal unit.
pub(super) fn out_of_range(machine: &ResidualModel<'_>, state: &State) -> Vec<(usize, f64)> {
    let outside = |(index, slot): (usize, &Slot)| {
        let (parameter, part, which) = ranged(machine, slot)?;
        let value = value(state, part, which);
        let (low, high) = parameter.range;
        let inside = value >= low && value <= high;
        (!inside).then_some((index, value))
    };
    machine.slots().iter().enumerate().filter_map(outside).collect()
}

/// Numbers of the geometry whose standard error is larger than their range where the rows scatter by `scale`: slot and zero.
pub(super) fn undetermined(
    machine: &ResidualModel<'_>,
    factor: &RankRevealingCholesky,
    scale: f64,
) -> Vec<(usize, f64)> {
    let has_range = machine.slots().iter().any(|slot| ranged(machine, slot).is_some());
    if !has_range {
        return Vec::new();
    }
    let inverse = factor.inverse();
    let wide = |(index, slot): (usize, &Slot)| {
        let (parameter, ..) = ranged(machine, slot)?;
        let (low, high) = parameter.range;
        let variance = inverse.get((index, index)).copied().unwrap_or(0.0);
        (scale * variance.sqrt() > low.abs().max(high.abs())).then_some((index, 0.0))
    };
    machine.slots().iter().enumerate().filter_map(wide).collect()
}

/// What to say of numbers that had left their ranges, or would, now that the ranges count.
pub(super) fn range_doubts(
    machine: &ResidualModel<'_>,
    far: &[(usize, f64)],
    bounded: &State,
) -> Vec<FitDoubt> {
    let name = |index: &usize| machine.slots().get(*index).map(|slot| machine.slot_name(*slot));
    let still = out_of_range(machine, bounded);
    let is_still = |index: &usize| still.iter().any(|(slot, _)| slot == index);
    let inside: Vec<String> =
        far.iter().map(|(index, _)| index).filter(|index| !is_still(index)).filter_map(name).collect();
    let told = |(index, value): &(usize, f64)| {
        let (parameter, ..) = ranged(machine, machine.slots().get(*index)?)?;
        let (low, high) = parameter.range;
        let (factor, unit) = (parameter.unit.factor, parameter.unit.name);
        let shown = match value.abs() <= BEYOND_SHOWING * low.abs().max(high.abs()) {
            true => format!("{:.3}", value * factor),
            false => "far".to_owned(),
        };
        Some(format!("{} ({shown} outside {:.3} to {:.3} {unit})", name(index)?, low * factor, high * factor))
    };
    let outside: Vec<String> = still.iter().filter_map(told).collect();
    let bounded = (!inside.is_empty()).then_some(FitDoubt::Bounded(inside));
    let implausible = (!outside.is_empty()).then_some(FitDoubt::Implausible(outside));
    bounded.into_iter().chain(implausible).collect()
}

/// Plausible ranges of the geometry as observations of zero (Bayesian least squares: Tarantola 2005, section 3.2).
pub(super) struct Prior {
    /// Variance of one equation, in declared sigmas squared: what the ranges are weighed against.
    pub(super) variance: f64,
    /// Slots that have no part in it.
    pub(super) spared: Vec<usize>,
}

impl Prior {
    /// Adds the ranges to normal equations.
    pub(super) fn add(&self, machine: &ResidualModel<'_>, state: &State, normal: &mut NormalEquations) {
        for (index, slot) in machine.slots().iter().enumerate() {
            let Some((parameter, part, which)) = ranged(machine, slot) else { continue };
            if self.spared.contains(&index) {
                continue;
            }
            let (low, high) = parameter.range;
            let sigma = low.abs().max(high.abs()) / RANGE_SIGMAS;
            let weight = self.variance / (sigma * sigma);
            let value = value(state, part, which);
            normal.matrix[(index, index)] += weight;
            normal.gradient[index] -= weight * value;
            normal.squares += weight * value * value;
        }
    }
}
