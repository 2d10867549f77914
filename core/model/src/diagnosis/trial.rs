//! A candidate refitted for real, jointly with everything else, and judged on rows it has not seen.

use crate::effect::EffectId;
use crate::file::AddedEffect;
use crate::fit::{Distances, Fit, Machine, corner};
use crate::laboratory::{Laboratory, LaboratoryError};
use crate::progress::Progress;
use crate::validation::{LeftOut, joint_blocks, left_out, pose_groups, region_blocks, session_blocks};

/// A machine with its fit.
pub(crate) struct Fitted<'a> {
    pub(crate) machine: Machine<'a>,
    pub(crate) fit: Fit,
}

/// Gain of cross-validation over one way of leaving blocks out.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Gain {
    /// Fall of the loss, in squared sigmas.
    pub(crate) total: f64,
    /// One standard error of it.
    pub(crate) error: f64,
}

impl Gain {
    /// Above one standard error.
    pub(crate) fn counts(&self) -> bool {
        self.total > self.error
    }
}

/// Huber's loss of a row, squared sigmas, for a scatter of `scale` sigmas.
fn loss((norm, equations): (f64, usize), scale: f64) -> f64 {
    let edge = scale * corner(equations);
    if norm <= edge { norm * norm } else { 2.0 * edge * norm - edge * edge }
}

/// Loss of a fit over its rows.
pub(crate) fn total_loss(fitted: &Fitted<'_>, scale: f64) -> f64 {
    let distances = Distances::of(&fitted.machine, &fitted.fit.residuals);
    fitted.fit.rows.iter().filter_map(|row| distances.rows.get(*row)).map(|row| loss(*row, scale)).sum()
}

/// Schwarz's criterion from a loss: equations, parameters, and what was paid for searching.
pub(crate) fn bic(loss: f64, equations: f64, parameters: f64, search_cost: f64) -> f64 {
    equations * (loss.max(1e-300) / equations).ln() + parameters * equations.ln() + search_cost
}

impl Laboratory {
    /// Fits the model with `more` effects, starting from an earlier fit's state where there is one.
    pub(crate) fn fit_with<'a>(
        &'a self,
        more: &[AddedEffect],
        near: Option<&Fitted<'_>>,
        progress: &Progress,
    ) -> Result<Fitted<'a>, LaboratoryError> {
        let machine = self.machine(more)?;
        let fit = match near {
            None => self.fit(&machine, progress)?,
            Some(near) => {
                let mut start = near.fit.state.clone();
                start.effects = machine.start().effects;
                // Effects both share keep their values; the others start where they were put.
                for (index, part) in machine.parts.iter().enumerate() {
                    let same = near.machine.parts.iter().position(|other| other.id == part.id);
                    let known = same.and_then(|same| near.fit.state.effects.get(same));
                    if let (Some(slot), Some(known)) = (start.effects.get_mut(index), known) {
                        slot.clone_from(known);
                    }
                }
                machine.refit(&start, &near.fit.rows, &near.fit.weights, self.options().fit, progress)?
            }
        };
        Ok(Fitted { machine, fit })
    }
}

/// How much better `after` predicts left-out blocks than `before`, for every way of leaving out that applies to the
/// effect: regions, ranges of its joint, sessions.
pub(crate) fn gains(before: &Fitted<'_>, after: &Fitted<'_>, id: &EffectId, scale: f64) -> Vec<Gain> {
    let mut ways = vec![region_blocks(&before.machine, &before.fit)];
    ways.extend(id.joint().map(|joint| joint_blocks(&before.machine, &before.fit, joint)));
    ways.extend(session_blocks(&before.machine, &before.fit));
    let poses = pose_groups(&before.machine, &before.fit);
    ways.iter().filter_map(|blocks| gain(before, after, blocks, &poses, scale)).collect()
}

fn gain(
    before: &Fitted<'_>,
    after: &Fitted<'_>,
    blocks: &[Vec<usize>],
    poses: &[Vec<usize>],
    scale: f64,
) -> Option<Gain> {
    let old = left_out(&before.machine, &before.fit, blocks)?;
    let new = left_out(&after.machine, &after.fit, blocks)?;
    let of = |rows: &[Option<LeftOut>], row: usize| {
        rows.get(row).copied().flatten().map(|row| loss(row.distance, scale))
    };
    // Returns to one pose share what the model does wrong there: they count as one.
    let differences: Vec<f64> = poses
        .iter()
        .map(|rows| rows.iter().filter_map(|row| Some(of(&old, *row)? - of(&new, *row)?)).sum())
        .collect();
    let count = differences.len() as f64;
    if count < 3.0 {
        return None;
    }
    let total: f64 = differences.iter().sum();
    let mean = total / count;
    let variance =
        differences.iter().map(|difference| (difference - mean).powi(2)).sum::<f64>() / (count - 1.0);
    Some(Gain { total, error: (variance * count).sqrt() })
}
