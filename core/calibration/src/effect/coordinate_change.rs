//! Effects that change one joint's coordinate by one number times what a row shows of the joint.

use super::kind::Setting;
use super::{Contribution, Effect, EffectNameError, Parameter, Sample};

/// A change of a joint's coordinate, in proportion to a rate that the row gives.
#[derive(Debug)]
struct CoordinateChange {
    joint: usize,
    parameters: [Parameter; 1],
    rate: fn(&Sample<'_>, usize) -> f64,
}

/// An effect that adds its one parameter, times `rate` of the row and its joint, to that joint's coordinate (rad or mm).
///
/// # Errors
/// It has no joint to act on.
pub(super) fn coordinate_change(
    setting: &Setting<'_>,
    parameter: Parameter,
    rate: fn(&Sample<'_>, usize) -> f64,
) -> Result<Box<dyn Effect>, EffectNameError> {
    Ok(Box::new(CoordinateChange { joint: setting.joint()?, parameters: [parameter], rate }))
}

impl Effect for CoordinateChange {
    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn contribute(&self, sample: &Sample<'_>, contributions: &mut Vec<Contribution>) {
        contributions.push(sample.contribute_to_joint(self.joint, 0, (self.rate)(sample, self.joint)));
    }

    fn changes_coordinate(&self) -> Option<usize> {
        Some(self.joint)
    }
}
