//! A joint's own errors as a compensation table of LinuxCNC: the file that `COMP_FILE` names in the section of a joint, of type 0 (`COMP_FILE_TYPE = 0`).
//!
//! A line is `nominal forward reverse`: the commanded position, and where the joint really is when it arrived there moving in its positive and in its negative
//! direction. LinuxCNC adds `nominal - forward` (or `nominal - reverse`) to what it commands, in straight lines between the lines of the file, takes at most 256
//! of them, and stops reading at the first line that is none (LinuxCNC manual, "INI configuration", section JOINT; its function `usrmotLoadComp`).

use std::fmt::Write as _;

use nalgebra::Vector3;
use plumb_kinematics::LinkFrames;
use thiserror::Error;

use crate::arm_model::{MapCarrier, Model};
use crate::effect::{self, EffectId, EffectNameError};
use crate::forward::rates;
use crate::prediction::is_event;

/// Lines that LinuxCNC takes at most.
pub const MOST_LINES: usize = 256;

/// Effects that go by a joint's own coordinate and the side from which it arrived, and by nothing else.
const HELD: [&str; 6] =
    ["joint_zero", "joint_gain", "joint_harmonic", "joint_backlash", "screw_wave", "positioning_error"];

/// Lines that a wave needs in its period at least: straight lines between eight miss it by less than a twelfth of its amplitude.
const LINES_A_WAVE: f64 = 8.0;

/// Places between two lines at which the model is held against the straight line.
const LOOKED_BETWEEN: u32 = 7;

/// What a map does across the axis is left out of a table without a word below this, mm: a tenth of the finest resolution that reading heads have.
const NO_STRAIGHTNESS: f64 = 1e-5;

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
    /// By how much straight lines between the table's lines miss the model at most.
    pub between: f64,
}

/// The joint's errors at so many positions over its limits; only where it was measured, where the model holds a correction or a residual map.
///
/// # Errors
/// [`CompensationError`].
pub fn compensation(model: &Model, joint: usize, lines: usize) -> Result<Compensation, CompensationError> {
    let (low, high) = travel(model, joint)?;
    // A table needs both ends of the travel.
    let count = lines.clamp(2, MOST_LINES);
    let errors = JointErrors::of(model, joint, ((low, high), count))?;
    let factor = if model.slides(joint) { 1.0 } else { 1.0_f64.to_degrees() };
    let apart = (high - low) / (count - 1) as f64;
    let table: Vec<[f64; 3]> = (0..count)
        .map(|line| {
            let q = low + apart * line as f64;
            let [forward, reverse] = errors.reached(q);
            [q, forward, reverse].map(|value| value * factor)
        })
        .collect();
    // LinuxCNC goes straight from line to line: what is curved between them stays an error of the machine.
    let mut between = 0.0_f64;
    for (line, (one, next)) in table.iter().zip(table.iter().skip(1)).enumerate() {
        for part in 1..=LOOKED_BETWEEN {
            let part = f64::from(part) / f64::from(LOOKED_BETWEEN + 1);
            for (side, exact) in errors.reached(low + apart * (line as f64 + part)).into_iter().enumerate() {
                let straight = one[side + 1] + part * (next[side + 1] - one[side + 1]);
                between = between.max((straight - exact * factor).abs());
            }
        }
    }
    let unit = if model.slides(joint) { "mm" } else { "deg" };
    Ok(Compensation { lines: table, unit, left_out: errors.left_out, between })
}

/// From where to where the joint goes, rad or mm.
fn travel(model: &Model, joint: usize) -> Result<(f64, f64), CompensationError> {
    let row = model.chain.joints.get(joint);
    let (mut low, mut high) = row.map_or((0.0, 0.0), |row| row.limits);
    // A correction holds nowhere else.
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
    /// The direction in which the joint's coordinate grows, base frame, where it is the only one and slides: shifts along it are errors of its position.
    alone: Option<Vector3<f64>>,
    left_out: Vec<String>,
}

/// Which way the only slide of a machine goes, base frame; nothing where there are more joints, or where it turns.
fn only_slide(model: &Model) -> Option<Vector3<f64>> {
    let [row] = model.chain.joints.as_slice() else { return None };
    let link_frames = LinkFrames::of(&model.chain, &[0.0], &[]);
    let axis = link_frames.joints.first()?.axis;
    model.slides(0).then(|| axis * row.sign)
}

impl<'m> JointErrors<'m> {
    /// Those that so many lines over a travel hold.
    fn of(
        model: &'m Model,
        joint: usize,
        ((low, high), lines): ((f64, f64), usize),
    ) -> Result<Self, CompensationError> {
        // Of a lone slide a shift of everything along it is an error of its position.
        let alone = only_slide(model);
        let mut errors = Self { model, joint, effects: Vec::new(), alone, left_out: Vec::new() };
        let apart = (high - low) / (lines.max(2) - 1) as f64;
        for added in model.effects.iter().chain(&model.fitted) {
            let zero = added.values.iter().all(|value| *value == 0.0);
            // What happened once is put right by finding the zeros anew: nothing to command by.
            if added.id.joint() != Some(joint) || zero || is_event(added) {
                continue;
            }
            if let Some(needed) = lines_for(model, &added.id, apart) {
                errors.left_out.push(format!("{} ({needed})", model.label(&added.id)));
                continue;
            }
            match HELD.contains(&added.id.name.as_str()) {
                true => errors.effects.push((effect::build(&added.id, model)?, &added.values)),
                false => errors.left_out.push(model.label(&added.id)),
            }
        }
        errors.left_out.extend(errors.not_of_the_joint());
        Ok(errors)
    }

    /// What of the residual map is no error of the joint's own position.
    fn not_of_the_joint(&self) -> Option<String> {
        let waves =
            self.model.residual_map.as_ref().map(|map| &map.waves).filter(|waves| !waves.is_empty())?;
        let Some(along) = self.alone else {
            return Some("the part of the residual map that goes by the whole pose".to_owned());
        };
        let across = waves.iter().map(|wave| (wave.shift - along * wave.shift.dot(&along)).norm());
        let most: f64 = across.sum();
        (most > NO_STRAIGHTNESS).then(|| {
            format!("the part of the residual map across the axis, its straightness (up to {most:.4} mm)")
        })
    }

    /// Where the joint is when it arrived at a commanded coordinate moving up, and moving down, rad or mm.
    fn reached(&self, q: f64) -> [f64; 2] {
        [1, -1].map(|side| q + self.at(q, side))
    }

    /// By how much the joint is beyond what was commanded, rad or mm.
    fn at(&self, q: f64, side: i8) -> f64 {
        let joints = self.model.chain.len();
        // Other joints at zero: what a table holds does not go by them.
        let pose: Vec<f64> = (0..joints).map(|joint| if joint == self.joint { q } else { 0.0 }).collect();
        let sides: Vec<i8> = (0..joints).map(|joint| if joint == self.joint { side } else { 0 }).collect();
        // Rates are of the joint's row, whose sense may be the other one.
        let sign = self.model.chain.joints.get(self.joint).map_or(1.0, |row| row.sign);
        let of_effects = self.effects.iter().map(|(effect, values)| {
            let rates = rates(self.model, effect.as_ref(), &pose, &sides);
            sign * rates.iter().zip(*values).map(|(rate, value)| rate * value).sum::<f64>()
        });
        of_effects.sum::<f64>() + self.mapped(&pose, &sides)
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
        columns
            .iter()
            .zip(weights)
            .map(|((carrier, value), weight)| self.fraction(*carrier) * value * weight)
            .sum()
    }

    /// The fraction of what a column of the map moves that is the joint's own way: of a shift its part along a lone slide.
    fn fraction(&self, carrier: MapCarrier) -> f64 {
        match (carrier, self.alone) {
            (MapCarrier::Joint(joint), _) if joint == self.joint => 1.0,
            (MapCarrier::Shift(axis), Some(along)) => along.get(axis).copied().unwrap_or(0.0),
            _ => 0.0,
        }
    }
}

/// What lines so far apart (mm) lack for a wave of a screw; nothing where they hold it, and of other effects.
fn lines_for(model: &Model, id: &EffectId, apart: f64) -> Option<String> {
    let row = model.chain.joints.get(id.joint()?).filter(|_| id.name == "screw_wave")?;
    let period = row.screw_pitch? / id.order?;
    (apart * LINES_A_WAVE > period * (1.0 + 1e-9)).then(|| {
        format!(
            "its period is {period} mm and the file's lines are {apart:.3} mm apart; {:.3} would do, and LinuxCNC takes at most {MOST_LINES} lines",
            period / LINES_A_WAVE
        )
    })
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
