//! How far a model may be trusted where nothing was measured: whole regions, or the last part of the time, left out.

use serde::Serialize;

use super::fitted::Fitted;
use crate::cross_validation::left_out;
use crate::laboratory::{ErrorSummary, Laboratory, LaboratoryError};
use crate::split::{Holdout, Split};
use plumb_calibration::measurement::ReadingUnit;
use plumb_estimation::Progress;

/// RMS where nothing was fitted, with what was added and without it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Extrapolation {
    /// What was left out: `regions`, `time:0.3`, or a third of a joint's range.
    pub left_out: String,
    /// The unit of the two errors: that of the table's readings.
    pub unit: ReadingUnit,
    /// With everything that was added.
    pub rms_mm: f64,
    /// Without it.
    pub without_mm: f64,
}

impl Extrapolation {
    /// Whether what was added does harm there.
    pub fn harmful(&self) -> bool {
        self.rms_mm > self.without_mm
    }
}

/// RMS over some fitted rows, each predicted by a fit without all of them, in the unit of the table's readings.
fn rms_without(fitted: &Fitted<'_>, block: &[usize]) -> Option<f64> {
    if block.is_empty() || block.len() >= fitted.fit.rows.len() {
        return None;
    }
    // Leaving out asks for two blocks at least; an empty one is skipped.
    let all = left_out(&fitted.problem, &fitted.fit, &[block.to_vec(), Vec::new()])?;
    let rows = block.iter().filter_map(|row| all.get(*row).and_then(Option::as_ref));
    ErrorSummary::of(rows.flat_map(|row| row.squares.iter().copied())).map(|errors| errors.rms)
}

impl Laboratory {
    /// How the model does where nothing was fitted, against `before`.
    pub(super) fn extrapolation(
        &self,
        new: &Fitted<'_>,
        before: &Self,
        progress: &Progress,
    ) -> Result<Vec<Extrapolation>, LaboratoryError> {
        progress.report(0.95, "trying what was not measured")?;
        let old = before.fit_with(&[], None, progress)?;
        let unit = self.observations().unit();
        let known = self.unmeasured_ways().into_iter().filter_map(|(left_out, rows)| {
            let (rms_mm, without_mm) = (rms_without(new, &rows)?, rms_without(&old, &rows)?);
            Some(Extrapolation { left_out, unit, rms_mm, without_mm })
        });
        Ok(known.collect())
    }

    /// Rows to leave out together, to see how a model does where nothing was measured, with what they are called: some may be empty.
    fn unmeasured_ways(&self) -> Vec<(String, Vec<usize>)> {
        let mut ways: Vec<(String, Vec<usize>)> = Vec::new();
        for holdout in [Holdout::Regions, Holdout::Time { fraction: 0.3 }] {
            if let Ok(split) = Split::new(self.table(), holdout) {
                // What is locked away for the final check stays so here.
                let mut rows = split.check_rows();
                rows.retain(|row| self.split().fit.get(*row) == Some(&true));
                ways.push((holdout.to_string(), rows));
            }
        }
        // The first three joints carry the hand through its volume; the wrist hardly moves the point.
        for (index, joint) in self.model().chain.joints.iter().enumerate().take(3) {
            let mut rows: Vec<usize> = self.measured_rows();
            rows.sort_by(|left, right| {
                let [left, right] = [left, right].map(|row| self.table().q_of(*row).get(index));
                left.unwrap_or(&0.0).total_cmp(right.unwrap_or(&0.0))
            });
            let upper = rows.split_off(rows.len() * 2 / 3);
            rows.truncate(upper.len());
            ways.push((format!("lower third of {}", joint.name), rows));
            ways.push((format!("upper third of {}", joint.name), upper));
        }
        ways
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::two_links;

    #[test]
    fn a_gain_that_is_added_helps_most_where_the_joint_was_not_measured() {
        let lab = two_links(90, "joint_zero(*)", 0.05, 81, |q| [0.0, 0.01 * q[1]]);
        let added = lab.model().clone();
        let grown = Laboratory::new(
            plumb_calibration::arm_model::Model {
                free: [added.free.clone(), vec!["joint_gain(elbow)".to_owned()]].concat(),
                ..added
            },
            lab.table().clone(),
            lab.options().clone(),
        )
        .unwrap();
        let new = grown.fit_with(&[], None, &Progress::unwatched()).unwrap();
        let tested = grown.extrapolation(&new, &lab, &Progress::unwatched()).unwrap();
        let ways: Vec<&str> = tested.iter().map(|one| one.left_out.as_str()).collect();
        let thirds = [
            "lower third of shoulder",
            "upper third of shoulder",
            "lower third of elbow",
            "upper third of elbow",
        ];
        assert!(ways.ends_with(&thirds), "{ways:?}");
        let elbow = tested.last().unwrap();
        assert!(elbow.rms_mm < 0.15 && elbow.without_mm > 1.5 && !elbow.harmful(), "{elbow:?}");
        assert!(Extrapolation { rms_mm: 0.2, without_mm: 0.1, ..elbow.clone() }.harmful());
        assert!(!Extrapolation { rms_mm: 0.1, without_mm: 0.1, ..elbow.clone() }.harmful());
        // A third of the rows at either end.
        let mut rows: Vec<usize> = (0..90).collect();
        rows.sort_by(|one, other| grown.table().q_of(*one)[1].total_cmp(&grown.table().q_of(*other)[1]));
        assert_eq!(rms_without(&new, &rows[60..]), Some(elbow.rms_mm));
        assert_eq!(rms_without(&new, &rows[..30]), Some(tested[tested.len() - 2].rms_mm));
        assert!(rms_without(&new, &[]).is_none() && rms_without(&new, &rows).is_none());
    }
}
