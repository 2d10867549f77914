//! Accuracy and repeatability of positioning of a numerically controlled axis: ISO 230-2:2014, clause 3.
//!
//! With deviations `x_ij` of approach `j` (of `n`) at target `i` (of `m`), for each direction:
//! mean `x_i = 1/n sum x_ij`, spread `s_i` with `n - 1` degrees of freedom, repeatability at the target `R_i = 4 s_i`.

use serde::Serialize;

use crate::axis_run::{AxisRun, Target, Unit};

/// What one direction says at one target.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OneSide {
    /// Deviations `x_ij`, in the order of the approaches.
    pub deviations: Vec<f64>,
    /// Their mean: the mean unidirectional positioning deviation.
    pub mean: f64,
    /// Their standard deviation `s_i`, with `n - 1` degrees of freedom.
    pub s: f64,
    /// `R_i = 4 s_i`.
    #[serde(rename = "R")]
    pub repeatability: f64,
}

/// One target.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AtTarget {
    /// Where the axis was sent.
    pub commanded: f64,
    /// Approached in the positive direction.
    pub positive: Option<OneSide>,
    /// Approached in the negative direction.
    pub negative: Option<OneSide>,
    /// Mean of the two means; nothing where only one direction was driven.
    pub mean: Option<f64>,
    /// Reversal error `B_i`: mean in the positive direction less mean in the negative.
    #[serde(rename = "B")]
    pub reversal: Option<f64>,
    /// Bidirectional repeatability `R_i = max(2 s+ + 2 s- + |B_i|, R_i+, R_i-)`.
    #[serde(rename = "R")]
    pub repeatability: Option<f64>,
}

/// The figures of one direction.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Unidirectional {
    /// Accuracy: `max(x_i + 2 s_i) - min(x_i - 2 s_i)`.
    #[serde(rename = "A")]
    pub accuracy: f64,
    /// Systematic positioning error: `max(x_i) - min(x_i)`.
    #[serde(rename = "E")]
    pub systematic: f64,
    /// Repeatability: `max(R_i)`.
    #[serde(rename = "R")]
    pub repeatability: f64,
}

/// The figures of both directions together.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Bidirectional {
    /// Accuracy: `max(x_i + 2 s_i) - min(x_i - 2 s_i)` over both directions.
    #[serde(rename = "A")]
    pub accuracy: f64,
    /// Systematic positioning error: `max(x_i) - min(x_i)` over both directions.
    #[serde(rename = "E")]
    pub systematic: f64,
    /// Mean positioning error: the same of the means of both directions.
    #[serde(rename = "M")]
    pub mean: f64,
    /// Repeatability: the greatest of the targets' bidirectional repeatabilities.
    #[serde(rename = "R")]
    pub repeatability: f64,
    /// Reversal error: the greatest `|B_i|`.
    #[serde(rename = "B")]
    pub reversal: f64,
    /// Mean reversal error: the mean of `B_i`, with its sign.
    #[serde(rename = "B_mean")]
    pub mean_reversal: f64,
}

/// A report after ISO 230-2.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Iso230 {
    /// Which standard.
    pub standard: &'static str,
    /// The axis: its column.
    pub axis: String,
    /// What was read.
    pub reading: String,
    /// Unit of everything.
    pub unit: Unit,
    /// Number of targets, `m`.
    pub targets: usize,
    /// Approaches of each from each side, `n`.
    pub approaches: usize,
    /// Both directions; nothing where only one was driven.
    pub bidirectional: Option<Bidirectional>,
    /// The positive direction.
    pub positive: Option<Unidirectional>,
    /// The negative direction.
    pub negative: Option<Unidirectional>,
    /// Target by target.
    pub at: Vec<AtTarget>,
    /// Where the run is not what the standard asks for, and what else to know.
    pub notes: Vec<String>,
}

/// Approaches from each side that the standard asks for (clause 5.3.2).
const APPROACHES: usize = 5;

/// Least number of targets on an axis of up to 2 m, and least number a metre (clause 5.3.2).
const TARGETS: usize = 5;

/// Longest travel, mm, that is measured in this way (clause 5.3.2); longer axes are approached once at more targets.
const LONGEST: f64 = 2000.0;

/// How alike the steps between targets must be to be called regular, as a share of the mean step. The standard shifts each target by a random fraction of a
/// period, so that errors of that period are seen.
const REGULAR: f64 = 1e-3;

/// The figures of a run.
pub fn iso_230_2(run: &AxisRun) -> Iso230 {
    let at: Vec<AtTarget> = run.targets.iter().map(at_target).collect();
    let side =
        |of: fn(&AtTarget) -> Option<&OneSide>| -> Option<Vec<&OneSide>> { at.iter().map(of).collect() };
    let positive = side(|target| target.positive.as_ref());
    let negative = side(|target| target.negative.as_ref());
    let bidirectional = match (&positive, &negative) {
        (Some(positive), Some(negative)) => Some(bidirectional(&at, positive, negative)),
        _ => None,
    };
    Iso230 {
        standard: "ISO 230-2:2014",
        axis: run.axis.clone(),
        reading: run.reading.clone(),
        unit: run.unit,
        targets: run.targets.len(),
        approaches: run.approaches(),
        bidirectional,
        positive: positive.as_deref().map(unidirectional),
        negative: negative.as_deref().map(unidirectional),
        notes: notes(run, bidirectional.is_some()),
        at,
    }
}

fn one_side(deviations: &[f64]) -> Option<OneSide> {
    if deviations.len() < 2 {
        return None;
    }
    let count = deviations.len() as f64;
    let mean = deviations.iter().sum::<f64>() / count;
    let squares: f64 = deviations.iter().map(|deviation| (deviation - mean).powi(2)).sum();
    let s = (squares / (count - 1.0)).sqrt();
    Some(OneSide { deviations: deviations.to_vec(), mean, s, repeatability: 4.0 * s })
}

fn at_target(target: &Target) -> AtTarget {
    let (positive, negative) = (one_side(&target.positive), one_side(&target.negative));
    let both = positive.as_ref().zip(negative.as_ref());
    let reversal = both.map(|(positive, negative)| positive.mean - negative.mean);
    let repeatability = both.map(|(positive, negative)| {
        let spread = 2.0 * positive.s + 2.0 * negative.s + (positive.mean - negative.mean).abs();
        spread.max(positive.repeatability).max(negative.repeatability)
    });
    let mean = both.map(|(positive, negative)| (positive.mean + negative.mean) / 2.0);
    AtTarget { commanded: target.commanded, mean, reversal, repeatability, positive, negative }
}

/// Greatest less least.
fn span(values: impl Iterator<Item = f64> + Clone) -> f64 {
    greatest(values.clone()) - values.fold(f64::INFINITY, f64::min)
}

fn greatest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(f64::NEG_INFINITY, f64::max)
}

/// Means with two standard deviations to either side: from the least to the greatest of all.
fn accuracy<'a>(sides: impl Iterator<Item = &'a &'a OneSide> + Clone) -> f64 {
    let ends = |sense: f64| sides.clone().map(move |side| side.mean + 2.0 * sense * side.s);
    greatest(ends(1.0)) - ends(-1.0).fold(f64::INFINITY, f64::min)
}

fn unidirectional(sides: &[&OneSide]) -> Unidirectional {
    Unidirectional {
        accuracy: accuracy(sides.iter()),
        systematic: span(sides.iter().map(|side| side.mean)),
        repeatability: greatest(sides.iter().map(|side| side.repeatability)),
    }
}

fn bidirectional(at: &[AtTarget], positive: &[&OneSide], negative: &[&OneSide]) -> Bidirectional {
    let sides = || positive.iter().chain(negative);
    let reversals = || at.iter().filter_map(|target| target.reversal);
    Bidirectional {
        accuracy: accuracy(sides()),
        systematic: span(sides().map(|side| side.mean)),
        mean: span(at.iter().filter_map(|target| target.mean)),
        repeatability: greatest(at.iter().filter_map(|target| target.repeatability)),
        reversal: greatest(reversals().map(f64::abs)),
        mean_reversal: reversals().sum::<f64>() / at.len().max(1) as f64,
    }
}

/// Where the run is not what the standard asks for.
fn notes(run: &AxisRun, both: bool) -> Vec<String> {
    let mut notes = Vec::new();
    let (approaches, targets) = (run.approaches(), run.targets.len());
    if approaches < APPROACHES {
        notes.push(format!("{approaches} approaches from each side; the standard asks for {APPROACHES}"));
    }
    if !both {
        notes.push(
            "approached in one direction only: no reversal error and no bidirectional figures".to_owned(),
        );
    }
    let ends = run.targets.first().zip(run.targets.last());
    let travel = ends.map_or(0.0, |(first, last)| last.commanded - first.commanded);
    let needed = match run.unit {
        Unit::Mm => TARGETS.max((travel / 1000.0 * TARGETS as f64).ceil() as usize),
        Unit::Deg => TARGETS,
    };
    if targets < needed {
        notes.push(format!(
            "{targets} targets over {travel} {}; the standard asks for at least {needed}",
            run.unit.name()
        ));
    }
    if run.unit == Unit::Mm && travel > LONGEST {
        notes
            .push(format!("the travel is longer than {LONGEST} mm, for which the standard has another test"));
    }
    let step = travel / (targets.max(2) - 1) as f64;
    let steps = run.targets.iter().zip(run.targets.iter().skip(1));
    let is_regular =
        |(one, next): (&Target, &Target)| (next.commanded - one.commanded - step).abs() <= REGULAR * step;
    if targets > 2 && steps.clone().all(is_regular) {
        notes.push(format!(
            "the targets lie {step} {} apart throughout: an error of that period, or of a period that goes into it, is not seen; the standard shifts each target at random",
            run.unit.name()
        ));
    }
    if run.reversed {
        notes.push(format!(
            "{} falls where {} rises; deviations are in the sense of the axis",
            run.reading, run.axis
        ));
    }
    notes
}
