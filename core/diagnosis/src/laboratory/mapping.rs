//! The residual map of a model: fitted last, judged on the held-out rows, and left out of every question about mechanisms.

use serde::Serialize;

use super::{Errors, Laboratory, LaboratoryError, MapNote, Rms};
use crate::cross_validation::pose_groups;
use crate::explainable::{FittedMap, residual_map};
use crate::fitted::reductions_by_pose;
use crate::predictive_gain::Gain;
use plumb_calibration::arm_model::{MeasuredRegion, Model};
use plumb_calibration::measurement::ReadingUnit;
use plumb_estimation::Progress;

/// What a residual map does; it explains nothing.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MapStep {
    /// The unit of the errors: that of the table's readings.
    pub unit: ReadingUnit,
    /// Root mean square error of a point on rows left out in turn, without it and with it.
    pub left_out_mm: [f64; 2],
    /// The error of the model with it.
    pub rms_mm: Rms,
    /// Fraction of the variance that the model left and that it takes away.
    pub not_understood: f64,
    /// What it goes by.
    pub goes_by: Vec<String>,
    /// Locked rows inside the region that was measured, and all of them.
    pub locked_inside: [usize; 2],
    /// Too few poses to leave any out: nothing shows how it does between them.
    pub between_unknown: bool,
}

impl MapStep {
    fn of(fitted: &FittedMap, (rms_mm, unit): (Rms, ReadingUnit), locked_inside: [usize; 2]) -> Self {
        Self {
            unit,
            left_out_mm: [fitted.without_mm, fitted.with_mm],
            rms_mm,
            not_understood: fitted.map.not_understood,
            goes_by: fitted.goes_by.clone(),
            locked_inside,
            between_unknown: fitted.between_unknown,
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
    /// agree (see [`speak_for_map`]); where nothing is held out, only returns to a few poses can say.
    pub(crate) fn with_map(&self, progress: &Progress) -> Result<Option<Mapped>, LaboratoryError> {
        if self.model.residual_map.is_some() {
            return Ok(None);
        }
        let before = self.fit_with(&[], None, progress)?;
        let Some(found) = residual_map(&before.problem, &before.fit, progress)? else { return Ok(None) };
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
        let [inside_by_pose, all_by_pose] =
            [&inside, &locked].map(|rows| reductions_by_pose((&before, &after), rows));
        if !speak_for_map(&inside_by_pose, &all_by_pose) {
            return Ok(None);
        }
        let comparison = mapped.comparison(&after.problem, &after.fit, progress)?;
        let step = MapStep::of(&found, (comparison.rms_mm, comparison.unit), [inside.len(), locked.len()]);
        Ok(Some(Mapped { model: mapped.adopted(&after), step, error_mm: comparison.error_mm }))
    }
}

/// Whether held-out rows speak for a map, by how much their squared errors fall with it, pose by pose, mm2: those inside the region that was measured fall by more than one
/// standard error, and all together do not grow. Outside the region the map is left out, but what is fitted beside it has moved, and rows there may be predicted worse.
fn speak_for_map(inside: &[f64], all: &[f64]) -> bool {
    let better_inside = match Gain::over(inside) {
        Some(gain) => gain.counts(),
        // Of a pose or two there is no standard error: it is enough that they do not speak against the map.
        None => inside.iter().sum::<f64>() >= 0.0,
    };
    better_inside && all.iter().sum::<f64>() >= 0.0
}

/// Takes the residual map out of a model, and the region with it where no correction needs it.
pub(crate) fn drop_map(model: &mut Model) {
    model.residual_map = None;
    if model.corrections.is_empty() {
        model.measured_region = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fitted::Fitted;
    use crate::testing::two_links;
    use plumb_calibration::arm_model::{AddedEffect, ResidualMap};
    use plumb_calibration::effect::{EffectId, Site};

    const RMS: Rms = Rms { fit: 0.1, cv: None, check: None };

    #[test]
    fn held_out_rows_speak_for_a_map_that_helps_inside_the_region_and_does_no_harm_outside() {
        let clear = [0.9, 1.0, 1.1, 1.0];
        assert!(
            speak_for_map(&clear, &[0.9, 1.0, 1.1, 1.0, -3.9]),
            "outside it does less harm than good inside"
        );
        assert!(!speak_for_map(&clear, &[0.9, 1.0, 1.1, 1.0, -4.1]), "outside it does more harm");
        assert!(!speak_for_map(&[3.0, -2.0, 1.0, -1.5], &[3.0, -2.0, 1.0, -1.5]), "inside it is chance");
        assert!(
            speak_for_map(&[], &[]) && speak_for_map(&[0.0], &[0.0]),
            "of no row or one, nothing speaks against it"
        );
        assert!(
            !speak_for_map(&[-0.1], &[-0.1]) && !speak_for_map(&[], &[-0.1]),
            "what there is speaks against it"
        );
    }

    #[test]
    fn rows_outside_the_region_that_was_measured_are_counted() {
        let mut lab = two_links(30, "", 0.05, 61, |_| [0.0; 2]);
        assert_eq!(lab.rows_outside(), 0, "without a region nothing is outside");
        let mut region = lab.measured_region().unwrap();
        lab.model.measured_region = Some(region.clone());
        assert_eq!(lab.rows_outside(), 0);
        let beyond = (0..30).filter(|row| lab.table.q_of(*row)[1] > 0.5).count();
        region.joints[1].high = 0.5;
        lab.model.measured_region = Some(region);
        assert!(beyond > 3 && lab.rows_outside() == beyond, "{beyond}");
        assert!(lab.map_note().is_none(), "a region is no map");
        lab.model.residual_map = Some(ResidualMap { not_understood: 0.4, ..ResidualMap::default() });
        let note = lab.map_note().unwrap();
        assert_eq!((note.rows_inside, note.rows, note.not_understood), (30 - beyond, 30, 0.4));
    }

    #[test]
    fn a_region_stays_where_a_correction_needs_it() {
        let lab = two_links(30, "", 0.05, 62, |_| [0.0; 2]);
        let mut model = lab.model.clone();
        model.measured_region = lab.measured_region();
        drop_map(&mut model);
        assert!(model.measured_region.is_none() && model.residual_map.is_none());
    }

    #[test]
    fn the_better_of_two_fits_predicts_better_and_of_no_rows_neither_is_worse() {
        let lab = two_links(40, "", 0.05, 63, |q| [0.0, 0.01 * q[1]]);
        let added = AddedEffect { id: EffectId::at("joint_gain", Site::Joint(1)), values: vec![0.0] };
        let without = lab.fit_with(&[], None, &Progress::unwatched()).unwrap();
        let with = lab.fit_with(&[added], None, &Progress::unwatched()).unwrap();
        let rows: Vec<usize> = (0..40).collect();
        let predicts_better = |fits: (&Fitted<'_>, &Fitted<'_>), rows: &[usize]| {
            let by_pose = reductions_by_pose(fits, rows);
            speak_for_map(&by_pose, &by_pose)
        };
        assert!(predicts_better((&without, &with), &rows) && !predicts_better((&with, &without), &rows));
        assert!(predicts_better((&without, &with), &[]));
        // One row, far from the middle, has no standard error: its sign decides.
        let far = rows.iter().copied().find(|row| lab.table.q_of(*row)[1] > 1.2).unwrap();
        assert!(predicts_better((&without, &with), &[far]) && !predicts_better((&with, &without), &[far]));
    }

    #[test]
    fn a_step_keeps_what_a_map_does_on_rows_left_out_and_what_nothing_checks() {
        let fitted = FittedMap {
            map: ResidualMap { not_understood: 0.62, ..ResidualMap::default() },
            region: MeasuredRegion { joints: Vec::new(), poses: Vec::new(), reach: 0.1 },
            without_mm: 0.2,
            with_mm: 0.1234,
            goes_by: vec!["pose".to_owned(), "side of approach".to_owned()],
            between_unknown: true,
        };
        let step = MapStep::of(&fitted, (RMS, ReadingUnit::Mm), [3, 4]);
        assert_eq!((step.left_out_mm, step.locked_inside), ([0.2, 0.1234], [3, 4]));
        assert!(step.between_unknown && step.not_understood == 0.62 && step.goes_by == fitted.goes_by);
    }
}
