//! What errors of an arm's shape share: one number of one joint's row is other than the model says, in every pose alike.

use plumb_kinematics::DhParameter;

use super::kind::Setting;
use super::{Drive, Effect, EffectNameError, Handle, Parameter, Situation};

/// A constant error of one number of a joint's row.
#[derive(Debug)]
pub(super) struct RowError {
    handle: Handle,
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
        Ok(Self { handle: Handle::Joint(setting.joint()?, number), parameters: [parameter] })
    }
}

impl Effect for RowError {
    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn drive(&self, _: &Situation<'_>, drives: &mut Vec<Drive>) {
        // One of the five numbers of a row moves as itself, in mm or rad.
        drives.push(Drive { parameter: 0, handle: self.handle, rate: 1.0 });
    }
}
