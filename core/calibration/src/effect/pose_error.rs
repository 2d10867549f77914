//! Each of a few poses has an error of its own, whatever its reason. It is never a candidate and never kept: it is beside what is asked about conditions where poses are
//! few and were measured often, so that what goes with the pose alone is not held against them.

use super::{Contribution, Dof, Effect, Parameter, Sample, Unit};
use crate::arm_model::Model;

/// How it is called inside.
pub const POSE_ERROR: &str = "pose_error";

/// Greatest plausible shift of a pose, mm.
const GREATEST: f64 = 1000.0;

#[derive(Debug)]
pub(super) struct PoseError {
    /// rad or mm.
    poses: Vec<Vec<f64>>,
    parameters: Vec<Parameter>,
}

impl PoseError {
    pub(super) fn new(model: &Model) -> Self {
        let names = (1..=model.pose_errors.len())
            .flat_map(|pose| ["x", "y", "z"].map(|axis| format!("pose_{pose}_{axis}_mm")));
        let parameters = names.map(|name| Parameter::new(&name, Unit::MM, (-GREATEST, GREATEST))).collect();
        Self { poses: model.pose_errors.clone(), parameters }
    }
}

impl Effect for PoseError {
    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn contribute(&self, sample: &Sample<'_>, contributions: &mut Vec<Contribution>) {
        // Returns to one pose differ by the scatter of what was read: the nearest pose is the one that was meant.
        let apart = self
            .poses
            .iter()
            .map(|pose| pose.iter().zip(sample.q).map(|(pose, q)| (pose - q).powi(2)).sum::<f64>());
        let nearest = apart.enumerate().min_by(|one, other| one.1.total_cmp(&other.1));
        let Some((pose, _)) = nearest else { return };
        // A shift of the whole: what else is wrong in one pose cannot be distinguished from it there.
        contributions.extend((0..3).map(|axis| Contribution {
            parameter: 3 * pose + axis,
            dof: Dof::BaseShift(axis),
            rate: 1.0,
        }));
    }
}
