//! A joint's own errors as a compensation table of LinuxCNC: the file that `COMP_FILE` names in the section of a joint, of type 0 (`COMP_FILE_TYPE = 0`).
//!
//! A line is `nominal forward reverse`: the commanded position, and where the joint really is when it arrived there moving in its positive and in its negative
//! direction. LinuxCNC adds `nominal - forward` (or `nominal - reverse`) to what it commands, in straight lines between the lines of the file, takes at most 256
//! of them, and stops reading at the first line that is none (LinuxCNC manual, "INI configuration", section JOINT; its function `usrmotLoadComp`).

use std::fmt::Write as _;

use thiserror::Error;

use crate::arm_model::{AddedEffect, MapCarrier, Model};
use crate::effect::{self, EffectNameError};
use crate::forward::rates;

/// Lines that LinuxCNC takes at most.
pub const MOST_LINES: usize = 256;

/// Effects that go by a joint's own coordinate and the side from which it arrived, and by nothing else.
const HELD: [&str; 4] = ["joint_zero", "joint_gain", "joint_harmonic", "joint_backlash"];

/// Limits as far apart, mm or rad, are none: no axis is that long.
const LONGEST: f64 = 1e5;

/// Why there is no table.
#[derive(Debug, Error)]
pub enum CompensationError {
    /// An effect that cannot be where the file has it.
    #[error(transparent)]
    Effect(#[from] EffectNameError),
    /// It is not known how far the joint goes.
    #[error("{0} has no limits: give it `limits_mm: [LEAST, GREATEST]`, between which the table is made")]
    NoLimits(String),
}

/// A joint's errors over its travel.
#[derive(Debug, Clone, PartialEq)]
pub struct Compensation {
    /// Commanded position, and position reached in the positive and in the negative direction; mm or degrees.
    pub lines: Vec<[f64; 3]>,
    /// The unit of these.
    pub unit: &'static str,
    /// What of the joint such a table cannot hold, as people write it.
    pub left_out: Vec<String>,
    /// By how much straight lines between the table's lines miss the model at most, halfway between them.
    pub between: f64,
}

/// The joint's errors at so many positions over its limits; only where it was measured, where the model holds a correction or a residual map.
///
/// # Errors
/// [`CompensationError`].
pub fn compensation(model: &Model, joint: usize, lines: usize) -> Result<Compensation, CompensationError> {
    let (low, high) = travel(model, joint)?;
    let errors = JointErrors::of(model, joint)?;
    let factor = if model.slides(joint) { 1.0 } else { 1.0_f64.to_degrees() };
    let count = lines.clamp(2, MOST_LINES);
    let at = |line: f64| low + (high - low) * line / (count - 1) as f64;
    let reached = |q: f64| [1, -1].map(|side| q + errors.at(q, side));
    let table: Vec<[f64; 3]> = (0..count)
        .map(|line| {
            let q = at(line as f64);
            let [forward, reverse] = reached(q);
            [q, forward, reverse].map(|value| value * factor)
        })
        .collect();
    let mut between = 0.0_f64;
    for (line, (one, next)) in table.iter().zip(table.iter().skip(1)).enumerate() {
        let exact = reached(at(line as f64 + 0.5));
        for (side, exact) in exact.into_iter().enumerate() {
            between = between.max((f64::midpoint(one[side + 1], next[side + 1]) - exact * factor).abs());
        }
    }
    let unit = if model.slides(joint) { "mm" } else { "deg" };
    Ok(Compensation { lines: table, unit, left_out: errors.left_out, between })
}

/// From where to where the joint goes, rad or mm.
fn travel(model: &Model, joint: usize) -> Result<(f64, f64), CompensationError> {
    let row = model.chain.joints.get(joint);
    let (mut low, mut high) = row.map_or((0.0, 0.0), |row| row.limits);
    if let Some(range) = model.measured_region.as_ref().and_then(|region| region.joints.get(joint)) {
        (low, high) = (low.max(range.low), high.min(range.high));
    }
    match high > low && high - low < LONGEST {
        true => Ok((low, high)),
        false => Err(CompensationError::NoLimits(row.map_or_else(String::new, |row| row.name.clone()))),
    }
}

/// What a model says of one joint's errors.
struct JointErrors<'m> {
    model: &'m Model,
    joint: usize,
    effects: Vec<(Box<dyn effect::Effect>, &'m [f64])>,
    left_out: Vec<String>,
}

impl<'m> JointErrors<'m> {
    fn of(model: &'m Model, joint: usize) -> Result<Self, CompensationError> {
        let mut errors = Self { model, joint, effects: Vec::new(), left_out: Vec::new() };
        let is_there = |added: &&AddedEffect| {
            added.id.joint() == Some(joint) && added.values.iter().any(|value| *value != 0.0)
        };
        for added in model.effects.iter().chain(&model.fitted).filter(is_there) {
            match HELD.contains(&added.id.name.as_str()) {
                true => errors.effects.push((effect::build(&added.id, model)?, &added.values)),
                false => errors.left_out.push(model.label(&added.id)),
            }
        }
        if model.residual_map.as_ref().is_some_and(|map| !map.waves.is_empty()) {
            errors.left_out.push("the part of the residual map that goes by the whole pose".to_owned());
        }
        Ok(errors)
    }

    /// By how much the joint is beyond what was commanded, rad or mm.
    fn at(&self, q: f64, side: i8) -> f64 {
        let joints = self.model.chain.len();
        let pose: Vec<f64> = (0..joints).map(|joint| if joint == self.joint { q } else { 0.0 }).collect();
        let sides: Vec<i8> = (0..joints).map(|joint| if joint == self.joint { side } else { 0 }).collect();
        // Rates are of the joint's row, whose sense may be the other one.
        let sign = self.model.chain.joints.get(self.joint).map_or(1.0, |row| row.sign);
        let of_effect = |(effect, values): &(Box<dyn effect::Effect>, &[f64])| -> f64 {
            let rates = rates(self.model, effect.as_ref(), &pose, &sides);
            sign * rates.iter().zip(*values).map(|(rate, value)| rate * value).sum::<f64>()
        };
        self.effects.iter().map(of_effect).sum::<f64>() + self.mapped(&pose, &sides)
    }

    /// What the residual map adds.
    fn mapped(&self, pose: &[f64], sides: &[i8]) -> f64 {
        let (Some(map), Some(region)) = (&self.model.residual_map, &self.model.measured_region) else {
            return 0.0;
        };
        let shifts = map.waves.iter().flat_map(|wave| wave.shift.iter());
        let along = map.along.iter().flat_map(|along| &along.weights);
        let weights = shifts.chain(along).chain(map.sides.iter().flat_map(|side| &side.weights));
        let columns = map.columns(region, pose, sides);
        let own =
            columns.iter().zip(weights).filter(|((carrier, _), _)| *carrier == MapCarrier::Joint(self.joint));
        own.map(|((_, value), weight)| value * weight).sum()
    }
}

/// The table as LinuxCNC reads it: nothing but its lines.
pub fn linuxcnc(table: &Compensation) -> String {
    let mut text = String::new();
    for [nominal, forward, reverse] in &table.lines {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{nominal:.6} {forward:.6} {reverse:.6}");
    }
    text
}
