//! The residual map of a model: fitted last, judged on the held-out rows, and left out of every question about mechanisms.

use serde::Serialize;

use super::{Errors, Laboratory, LaboratoryError, MapNote, Rms};
use crate::cross_validation::pose_groups;
use crate::explainable::{FittedMap, residual_map};
use crate::fitted::{Fitted, falls_by_pose};
use crate::predictive_gain::Gain;
use plumb_calibration::arm_model::{MeasuredRegion, Model};
use plumb_estimation::Progress;

/// What a residual map does; it explains nothing.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MapStep {
    /// Root mean square error of a point on rows left out in turn, without it and with it, mm.
    pub left_out_mm: [f64; 2],
    /// The error of the model with it.
    pub rms_mm: Rms,
    /// Share of the variance that the model left and that it takes away.
    pub not_understood: f64,
    /// What it goes by.
    pub goes_by: Vec<String>,
    /// Locked rows inside the region that was measured, and all of them.
    pub locked_inside: [usize; 2],
    /// Too few poses to leave any out: nothing shows how it does between them.
    pub between_unknown: bool,
    /// One plain sentence.
    pub sentence: String,
}

impl MapStep {
    fn of(fitted: &FittedMap, rms_mm: Rms, locked_inside: [usize; 2]) -> Self {
        let mut sentence = format!(
            "A residual map of {} takes {:.0} % of the variance that is left ({:.3} -> {:.3} mm on rows left out): not understood, and good only where was measured.",
            fitted.goes_by.join(" and "),
            100.0 * fitted.map.not_understood,
            fitted.without_mm,
            fitted.with_mm
        );
        if fitted.between_unknown {
            sentence.push_str(" With so few poses it was judged on returns to them; between them it interpolates, which nothing here checks.");
        }
        Self {
            left_out_mm: [fitted.without_mm, fitted.with_mm],
            rms_mm,
            not_understood: fitted.map.not_understood,
            goes_by: fitted.goes_by.clone(),
            locked_inside,
            between_unknown: fitted.between_unknown,
            sentence,
        }
    }
}

/// A model with a residual map.
pub(crate) struct Mapped {
    pub(crate) model: Model,
    pub(crate) step: MapStep,
    /// The errors of the model with it.
    pub(crate) error_mm: Errors,
}

impl Laboratory {
    /// The same without the model's residual map; nothing where it has none.
    pub(crate) fn without_map(&self) -> Option<Self> {
        self.model.residual_map.as_ref()?;
        let mut model = self.model.clone();
        drop_map(&mut model);
        Some(self.with_model(model))
    }

    /// What there is to say of the model's residual map; nothing where it has none.
    pub(crate) fn map_note(&self) -> Option<MapNote> {
        let map = self.model.residual_map.as_ref()?;
        let rows = self.table.len();
        Some(MapNote { not_understood: map.not_understood, rows_inside: rows - self.rows_outside(), rows })
    }

    /// Rows outside the region in which the model's corrections hold.
    pub(crate) fn rows_outside(&self) -> usize {
        let Some(region) = &self.model.measured_region else { return 0 };
        (0..self.table.len()).filter(|row| region.check(self.table.q_of(*row)).is_err()).count()
    }

    /// The region of pose space in which the fitted rows lie.
    pub(crate) fn measured_region(&self) -> Option<MeasuredRegion> {
        let rows = self.measured_rows();
        let poses: Vec<Vec<f64>> = pose_groups(&self.table, &rows)
            .iter()
            .filter_map(|rows| rows.first())
            .map(|row| self.table.q_of(*row).to_vec())
            .collect();
        MeasuredRegion::of(&self.model.chain, &poses)
    }

    /// The model with a residual map of what it leaves; nothing where rows that were not seen are not predicted better with one. Rows held out have to
    /// agree, where any lie inside the region that was measured; where nothing is held out, only returns to a few poses can say.
    pub(crate) fn with_map(&self, progress: &Progress) -> Result<Option<Mapped>, LaboratoryError> {
        if self.model.residual_map.is_some() {
            return Ok(None);
        }
        let before = self.fit_with(&[], None, progress)?;
        let Some(found) = residual_map(&before.machine, &before.fit, progress)? else { return Ok(None) };
        let locked = self.split.check_rows();
        // A map follows whatever it is given: nothing but rows it has never seen, not even for its variances, can speak for it.
        if locked.is_empty() && !found.between_unknown {
            return Ok(None);
        }
        let mut model = self.adopted(&before);
        model.measured_region = Some(found.region.clone());
        model.residual_map = Some(found.map.clone());
        let mapped = self.with_model(model);
        let after = mapped.fit_with(&[], None, progress)?;
        let inside: Vec<usize> =
            locked.iter().copied().filter(|row| found.region.check(self.table.q_of(*row)).is_ok()).collect();
        if !predicts_better((&before, &after), &inside) {
            return Ok(None);
        }
        let comparison = mapped.comparison(&after.machine, &after.fit, progress)?;
        let step = MapStep::of(&found, comparison.rms_mm, [inside.len(), locked.len()]);
        Ok(Some(Mapped { model: mapped.adopted(&after), step, error_mm: comparison.error_mm }))
    }
}

/// Whether a second fit predicts some rows better than the first, by more than one standard error over poses; true of no rows.
fn predicts_better(fits: (&Fitted<'_>, &Fitted<'_>), rows: &[usize]) -> bool {
    let falls = falls_by_pose(fits, rows);
    match Gain::over(&falls) {
        Some(gain) => gain.counts(),
        // Of a pose or two there is no standard error: it is enough that they do not speak against the map.
        None => falls.iter().sum::<f64>() >= 0.0,
    }
}

/// Takes the residual map out of a model, and the region with it where no correction needs it.
pub(crate) fn drop_map(model: &mut Model) {
    model.residual_map = None;
    if model.corrections.is_empty() {
        model.measured_region = None;
    }
}
