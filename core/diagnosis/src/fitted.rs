//! A machine with its fit, and refits of it with more effects in.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::cross_validation::pose_groups;
use crate::laboratory::{Laboratory, LaboratoryError, point_squares};
use crate::score_test::{Probe, Score};
use crate::thresholds::INLIER_QUANTILE;
use plumb_calibration::arm_model::AddedEffect;
use plumb_calibration::fit::{Distances, Fit, FitOptions, ResidualModel, State};
use plumb_estimation::{Progress, chi_squared_quantile, huber_corner};

/// A machine with its fit.
pub(crate) struct Fitted<'a> {
    pub(crate) machine: ResidualModel<'a>,
    pub(crate) fit: Fit,
}

impl Fitted<'_> {
    /// Huber's loss over the fitted rows, squared sigmas, for a scatter of `scale` sigmas.
    pub(crate) fn loss(&self, scale: f64) -> f64 {
        let distances = Distances::of(&self.machine, &self.fit.residuals);
        let fitted = self.fit.rows.iter().filter_map(|row| distances.rows.get(*row));
        let losses = fitted.map(|(norm, equations)| {
            let edge = scale * huber_corner(*equations);
            // Huber's function (Huber 1964; of a regression, Huber 1981, section 7.3), here of a row's whole length: a square inside, its tangent outside.
            if *norm <= edge { norm * norm } else { 2.0 * edge * norm - edge * edge }
        });
        losses.sum()
    }

    /// Squared errors of the fitted rows, in sigmas.
    pub(crate) fn row_squares(&self) -> Vec<f64> {
        let (observations, residuals) = (self.machine.observations, &self.fit.residuals);
        let squares = self.fit.rows.iter().map(|row| {
            let own = residuals.get(observations.range(*row)).unwrap_or(&[]);
            let equations = own.iter().zip(observations.of_row(*row));
            equations.map(|(residual, equation)| (residual / equation.sigma).powi(2)).sum()
        });
        squares.collect()
    }

    /// Fitted rows that are not wild.
    pub(crate) fn tame(&self) -> Vec<usize> {
        let distances = Distances::of(&self.machine, &self.fit.residuals);
        // A quantile costs more than a row, and rows have few different numbers of equations.
        let mut edges: BTreeMap<usize, f64> = BTreeMap::new();
        let mut tame = self.fit.rows.clone();
        tame.retain(|row| {
            distances.rows.get(*row).is_some_and(|(norm, equations)| {
                let edge = edges.entry(*equations).or_insert_with(|| {
                    chi_squared_quantile(INLIER_QUANTILE, (*equations).max(1) as f64).sqrt()
                });
                // A fit through every row leaves no scatter, and rows without any error.
                *norm <= self.fit.scale * *edge || *norm == 0.0
            })
        });
        tame
    }
}

/// By how much the squared errors of rows that were not fitted fall from one fit to another of the same table, summed over the rows of each pose, mm2. Replicates
/// share what a model does wrong at their pose, so that poses, not rows, are independent.
pub(crate) fn falls_by_pose((before, after): (&Fitted<'_>, &Fitted<'_>), rows: &[usize]) -> Vec<f64> {
    let [old, new] = [before, after].map(|fitted| {
        let residuals = fitted.machine.residuals_apart(&fitted.fit.state, rows, &fitted.fit.rows);
        let all = 0..fitted.machine.table.len();
        let squares = all.map(|row| point_squares(&fitted.machine, &residuals, row).into_iter().sum());
        squares.collect::<Vec<f64>>()
    });
    let poses = pose_groups(before.machine.table, rows);
    let falls = poses.iter().map(|rows| rows.iter().map(|row| old[*row] - new[*row]).sum());
    falls.collect()
}

/// An earlier fit's state for another machine: effects both share keep their values, the others start where they were
/// put.
fn start_near(machine: &ResidualModel<'_>, near: &Fitted<'_>) -> State {
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
fn beside(machine: &ResidualModel<'_>, start: &State, beside: &[f64]) -> State {
    let known = beside.len().min(machine.slots().len());
    let moved = start.stepped(machine.slots().get(..known).unwrap_or(&[]), beside);
    // Derivatives at a fold of the arm can promise a step to nowhere.
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
    ) -> Result<(ResidualModel<'a>, State), LaboratoryError> {
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

    /// Fits the model with `more` effects and a probe, robustly, to all rows that are not held out.
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
