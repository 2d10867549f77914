//! What a change-point search looks at: residuals of a fit, derivatives by what is fitted, and derivatives by each number that
//! may have been re-set, row by row in the order of time.

use std::ops::Range;

use nalgebra::DMatrix;

use crate::fitted::Fitted;
use crate::laboratory::{Laboratory, LaboratoryError};
use plumb_calibration::arm_model::{AddedEffect, Epochs};
use plumb_calibration::effect::{self, CandidateContext, Effect, EffectId, Family, Site};
use plumb_calibration::fit::ResidualModel;
use plumb_estimation::Progress;

/// Residuals and derivatives of some rows, in units of each equation's sigma, times the root of the row's weight.
pub(super) struct Columns {
    /// The rows looked at, in the order of time.
    pub(super) rows: Vec<usize>,
    /// Where each of them is among all rows of the table, in the order of time: between rows that are looked at others may be held out.
    pub(super) positions: Vec<f64>,
    /// Where each row's equations are.
    pub(super) ranges: Vec<Range<usize>>,
    /// Measured less predicted.
    pub(super) residuals: Vec<f64>,
    /// By what is fitted: numbers by equations.
    pub(super) fitted: DMatrix<f64>,
    /// By what may have been re-set, as if it had been in every row: numbers by equations.
    pub(super) steps: DMatrix<f64>,
    /// The effect each of those is a number of.
    pub(super) ids: Vec<EffectId>,
}

impl Columns {
    /// Of the fitted rows of a laboratory, for every number that an effect by epoch may change.
    ///
    /// # Errors
    /// The fit is cancelled, or an effect cannot act.
    pub(super) fn of(
        lab: &Laboratory,
        fitted: &Fitted<'_>,
        progress: &Progress,
    ) -> Result<Self, LaboratoryError> {
        progress.check()?;
        let order = lab.table().order();
        let is_fitted = mask(&fitted.fit.rows, lab.table().len());
        let fitted_rows = order
            .into_iter()
            .enumerate()
            .filter(|(_, row)| is_fitted.get(*row).copied().unwrap_or(false))
            .map(|(position, row)| (position as f64, row));
        let (positions, rows): (Vec<f64>, Vec<usize>) = fitted_rows.unzip();
        // All rows lie in a second epoch: what differs between epochs then acts in each of them.
        let mut model = lab.model().clone();
        model.epochs = Some(Epochs::Rows(vec![1]));
        let context = CandidateContext { model: &model, summary: lab.summary() };
        let (mut effects, mut ids): (Vec<Box<dyn Effect>>, Vec<EffectId>) = (Vec::new(), Vec::new());
        let joints = (0..model.chain.len()).map(|joint| EffectId::at("joint_zero_reset", Site::Joint(joint)));
        let mut asked: Vec<EffectId> = joints.collect();
        for kind in effect::kinds().iter().filter(|kind| kind.family == Family::Epoch) {
            asked.extend((kind.candidates)(&context));
        }
        for id in asked {
            let built = effect::build(&id, &model)?;
            ids.extend(vec![id; built.parameters().len()]);
            effects.push(built);
        }
        // What differs between epochs in the fit is left out of the residuals: it is looked for anew. What else was added to the model stays in.
        let own = lab.fitted_effects()?.len();
        let is_event = |id: &EffectId| effect::kind(&id.name).is_some_and(|kind| kind.is_event);
        let fitted_parts = fitted.problem.parts.iter().zip(&fitted.fit.state.effects).enumerate();
        let parts: Vec<AddedEffect> = fitted_parts
            .filter(|(index, (part, _))| *index < own || !is_event(&part.id))
            .map(|(_, (part, values))| AddedEffect { id: part.id.clone(), values: values.clone() })
            .collect();
        let problem = ResidualModel::new(&model, lab.table(), lab.observations(), &parts)?;
        let probes: Vec<&dyn Effect> = effects.iter().map(AsRef::as_ref).collect();
        let mut state = fitted.fit.state.clone();
        state.effects = parts.into_iter().map(|part| part.values).collect();
        let block = problem.block(&state, &rows, &fitted.fit.weights, &probes);
        let known = problem.free_parameters().len();
        let mut first = 0;
        let ranges = rows.iter().map(|row| {
            let start = first;
            first += lab.observations().range(*row).len();
            start..first
        });
        Ok(Self {
            positions,
            ranges: ranges.collect(),
            residuals: block.residuals,
            fitted: block.jacobian.rows(0, known).into_owned(),
            steps: block.jacobian.rows(known, block.jacobian.nrows() - known).into_owned(),
            rows,
            ids,
        })
    }
}

/// Which rows of a table are among some.
pub(super) fn mask(rows: &[usize], count: usize) -> Vec<bool> {
    let mut mask = vec![false; count];
    for row in rows {
        if let Some(entry) = mask.get_mut(*row) {
            *entry = true;
        }
    }
    mask
}
