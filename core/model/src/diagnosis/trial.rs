//! A candidate refitted for real, jointly with everything else, and judged on rows it has not seen.

use std::sync::Arc;

use super::score::{Probe, Score};
use crate::effect::EffectId;
use crate::file::AddedEffect;
use crate::fit::{Distances, Fit, FitOptions, Machine, State, corner, for_each};
use crate::laboratory::{Laboratory, LaboratoryError};
use crate::progress::Progress;
use crate::statistics::chi_squared_quantile;
use crate::validation::{Derivatives, LeftOut, joint_blocks, pose_groups, region_blocks, session_blocks};

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
    /// From the fall of the loss at every pose; nothing of fewer than three.
    pub(crate) fn over(falls: &[f64]) -> Option<Self> {
        let count = falls.len() as f64;
        if count < 3.0 {
            return None;
        }
        let total: f64 = falls.iter().sum();
        let mean = total / count;
        let variance = falls.iter().map(|fall| (fall - mean).powi(2)).sum::<f64>() / (count - 1.0);
        Some(Self { total, error: (variance * count).sqrt() })
    }

    /// Above one standard error.
    pub(crate) fn counts(&self) -> bool {
        self.total > self.error
    }
}

/// Share of rows that lie nearer than a wild one when nothing is wild.
const TAME: f64 = 0.9995;

impl Fitted<'_> {
    /// Huber's loss over the fitted rows, squared sigmas, for a scatter of `scale` sigmas.
    pub(crate) fn loss(&self, scale: f64) -> f64 {
        let distances = Distances::of(&self.machine, &self.fit.residuals);
        let loss = |(norm, equations): &(f64, usize)| {
            let edge = scale * corner(*equations);
            if *norm <= edge { norm * norm } else { 2.0 * edge * norm - edge * edge }
        };
        self.fit.rows.iter().filter_map(|row| distances.rows.get(*row)).map(loss).sum()
    }

    /// Fitted rows that are not wild.
    pub(crate) fn tame(&self) -> Vec<usize> {
        let distances = Distances::of(&self.machine, &self.fit.residuals);
        let mut edges: Vec<Option<f64>> = Vec::new();
        let mut edge = |equations: usize| {
            edges.resize(edges.len().max(equations + 1), None);
            *edges[equations]
                .get_or_insert_with(|| chi_squared_quantile(TAME, equations.max(1) as f64).sqrt())
        };
        let scale = self.fit.scale;
        let near = |row: &usize| {
            distances
                .rows
                .get(*row)
                .is_some_and(|(norm, count)| *norm <= scale * edge(*count) || *norm == 0.0)
        };
        self.fit.rows.iter().copied().filter(near).collect()
    }
}

/// Schwarz's criterion from a loss: equations, parameters, and what was paid for searching.
pub(crate) fn bic(loss: f64, equations: f64, parameters: f64, search_cost: f64) -> f64 {
    equations * (loss.max(1e-300) / equations).ln() + parameters * equations.ln() + search_cost
}

/// An earlier fit's state for another machine: effects both share keep their values, the others start where they were
/// put.
fn start_near(machine: &Machine<'_>, near: &Fitted<'_>) -> State {
    let mut start = near.fit.state.clone();
    start.effects = machine.start().effects;
    for (index, part) in machine.parts.iter().enumerate() {
        let same = near.machine.parts.iter().position(|other| other.id == part.id);
        let known = same.and_then(|same| near.fit.state.effects.get(same));
        if let (Some(slot), Some(known)) = (start.effects.get_mut(index), known) {
            slot.clone_from(known);
        }
    }
    start
}

/// A start moved to where a score expects the fitted parameters beside the last effect: what the two machines share comes
/// first in both.
fn beside(machine: &Machine<'_>, start: &State, beside: &[f64]) -> State {
    let known = beside.len().min(machine.slots().len());
    let moved = start.stepped(machine.slots().get(..known).unwrap_or(&[]), beside);
    if moved.is_finite() { moved } else { start.clone() }
}

impl Laboratory {
    /// The model with more effects than an earlier fit has, and the state that is expected there: the effects at the values they
    /// are put in with, and what was fitted earlier moved so far.
    pub(crate) fn expected<'a>(
        &'a self,
        more: &[AddedEffect],
        near: &Fitted<'_>,
        moved: &[f64],
    ) -> Result<(Machine<'a>, State), LaboratoryError> {
        let machine = self.machine(more)?;
        let start = beside(&machine, &start_near(&machine, near), moved);
        Ok((machine, start))
    }

    /// Fits the model with more effects than an earlier fit has, from where everything is [`expected`](Self::expected), to the
    /// same rows with the same weights.
    pub(crate) fn fit_beside<'a>(
        &'a self,
        more: &[AddedEffect],
        near: &Fitted<'_>,
        moved: &[f64],
        options: FitOptions,
        progress: &Progress,
    ) -> Result<Fitted<'a>, LaboratoryError> {
        let (machine, start) = self.expected(more, near, moved)?;
        let fit = machine.refit(&start, &near.fit.rows, &near.fit.weights, options, progress)?;
        Ok(Fitted { machine, fit })
    }

    /// Fits the model with `more` effects to some rows with these weights, starting from an earlier fit's state.
    pub(crate) fn fit_near<'a>(
        &'a self,
        more: &[AddedEffect],
        near: &Fitted<'_>,
        (rows, weights): (&[usize], &[f64]),
        options: FitOptions,
        progress: &Progress,
    ) -> Result<Fitted<'a>, LaboratoryError> {
        let machine = self.machine(more)?;
        let start = start_near(&machine, near);
        let fit = machine.refit(&start, rows, weights, options, progress)?;
        Ok(Fitted { machine, fit })
    }

    /// Fits the model with `more` effects and a probe, robustly, to all rows that are not locked away.
    pub(crate) fn fit_probe<'a>(
        &'a self,
        more: &[AddedEffect],
        (probe, score): (&Probe, &Score),
        near: &Fitted<'_>,
        progress: &Progress,
    ) -> Result<Fitted<'a>, LaboratoryError> {
        let mut machine = self.machine(more)?;
        machine.admit(probe.id.clone(), Arc::clone(&probe.effect), score.values.clone());
        let start = beside(&machine, &start_near(&machine, near), &score.beside);
        let ones = vec![1.0; self.table().len()];
        let fit = machine.refit(&start, &self.measured_rows(), &ones, self.options().fit, progress)?;
        Ok(Fitted { machine, fit })
    }

    /// Fits the model with `more` effects, starting from an earlier fit's state where there is one.
    pub(crate) fn fit_with<'a>(
        &'a self,
        more: &[AddedEffect],
        near: Option<&Fitted<'_>>,
        progress: &Progress,
    ) -> Result<Fitted<'a>, LaboratoryError> {
        match near {
            // Rows that an earlier stage left out come back: what is wild is judged anew.
            Some(near) => {
                let ones = vec![1.0; self.table().len()];
                self.fit_near(more, near, (&self.measured_rows(), &ones), self.options().fit, progress)
            }
            None => {
                let machine = self.machine(more)?;
                let fit = self.fit(&machine, progress)?;
                Ok(Fitted { machine, fit })
            }
        }
    }
}

/// How one fit predicts rows that are left out, for every way of leaving blocks out that applies to effects: regions, ranges of
/// joints, sessions. Each way is worked out once.
pub(crate) struct Judge {
    regions: Way,
    joints: Vec<Way>,
    sessions: Option<Way>,
    poses: Vec<Vec<usize>>,
}

/// A way of leaving blocks out, and how rows are predicted so; nothing if too little is left to fit.
struct Way {
    blocks: Vec<Vec<usize>>,
    rows: Option<Vec<Option<LeftOut>>>,
}

impl Judge {
    /// Looks at what is fitted before any of the effects in `ids` is in.
    pub(crate) fn of<'i>(before: &Fitted<'_>, ids: impl Iterator<Item = &'i EffectId>) -> Self {
        let (machine, fit) = (&before.machine, &before.fit);
        let (table, rows) = (machine.table, &fit.rows);
        let derivatives = Derivatives::of(machine, fit);
        let mut asked: Vec<usize> = ids.filter_map(EffectId::joint).collect();
        asked.sort_unstable();
        asked.dedup();
        let mut ways = vec![region_blocks(table, rows)];
        ways.extend((0..machine.model.chain.len()).map(|joint| match asked.contains(&joint) {
            true => joint_blocks(table, rows, joint),
            false => Vec::new(),
        }));
        ways.extend(session_blocks(table, rows));
        let told = for_each(&ways, |blocks| derivatives.left_out(fit, blocks));
        let mut ways = ways.into_iter().zip(told).map(|(blocks, rows)| Way { blocks, rows });
        let regions = ways.next().unwrap_or_else(|| Way { blocks: Vec::new(), rows: None });
        let joints = ways.by_ref().take(machine.model.chain.len()).collect();
        let (sessions, poses) = (ways.next(), pose_groups(table, rows));
        Self { regions, joints, sessions, poses }
    }

    /// How much better `after` predicts left-out blocks, for every way that applies to the effect.
    pub(crate) fn gains(&self, after: &Fitted<'_>, id: &EffectId) -> Vec<Gain> {
        let derivatives = Derivatives::of(&after.machine, &after.fit);
        let joint = id.joint().and_then(|joint| self.joints.get(joint));
        let ways = [Some(&self.regions), joint, self.sessions.as_ref()];
        ways.into_iter().flatten().filter_map(|way| self.gain(way, &derivatives, &after.fit)).collect()
    }

    fn gain(&self, way: &Way, after: &Derivatives<'_>, fit: &Fit) -> Option<Gain> {
        let (old, new) = (way.rows.as_ref()?, after.left_out(fit, &way.blocks)?);
        let of = |rows: &[Option<LeftOut>], row: usize| {
            rows.get(row).copied().flatten().map(|row| row.distance.0.powi(2))
        };
        // Returns to one pose share what the model does wrong there: they count as one.
        let fall = |rows: &Vec<usize>| {
            rows.iter().filter_map(|row| Some(of(old, *row)? - of(&new, *row)?)).sum::<f64>()
        };
        Gain::over(&self.poses.iter().map(fall).collect::<Vec<f64>>())
    }
}
