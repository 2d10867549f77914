//! What errors of an arm's shape share: one number of one joint's row is other than the model says, in every pose alike.

use plumb_kinematics::DhParameter;

use super::kind::Setting;
use super::{Contribution, Dof, Effect, EffectNameError, LooksAt, Parameter, Sample};

/// A constant error of one number of a joint's row.
#[derive(Debug)]
pub(super) struct RowError {
    dof: Dof,
    parameters: [Parameter; 1],
}

impl RowError {
    /// An error of this number of the row of the joint that an effect acts on.
    ///
    /// # Errors
    /// The effect has no joint to act on.
    pub(super) fn new(
        setting: &Setting<'_>,
        number: DhParameter,
        parameter: Parameter,
    ) -> Result<Self, EffectNameError> {
        Ok(Self { dof: Dof::Joint(setting.joint()?, number), parameters: [parameter] })
    }
}

impl Effect for RowError {
    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn looks_at(&self) -> LooksAt {
        LooksAt::Nothing
    }

    fn contribute(&self, _: &Sample<'_>, contributions: &mut Vec<Contribution>) {
        // One of the five numbers of a row moves as itself, in mm or rad.
        contributions.push(Contribution { parameter: 0, dof: self.dof, rate: 1.0 });
    }
}
