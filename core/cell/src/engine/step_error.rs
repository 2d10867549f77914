//! Why a step did not come to its end.

use plumb_record::RecordError;

use super::inbox::Interrupt;
use crate::device::DeviceError;
use crate::expression::ExpressionError;

/// Why a step did not come to its end.
#[derive(Debug)]
pub(crate) enum StepError {
    /// A person interrupted it.
    Interrupted { interrupt: Interrupt, reason: String },
    /// What had to hold does not.
    Failed(String),
    /// Something went wrong.
    Error(String),
    /// A device was lost.
    Lost { device: String, message: String },
    /// It needs an answer nobody is there to give.
    NeedsOperator(String),
    /// What happened cannot be written down: nothing may happen any more.
    Record(RecordError),
}

impl StepError {
    pub(crate) fn error(message: impl Into<String>) -> Self {
        Self::Error(message.into())
    }
}

impl From<RecordError> for StepError {
    fn from(error: RecordError) -> Self {
        Self::Record(error)
    }
}

impl From<ExpressionError> for StepError {
    fn from(error: ExpressionError) -> Self {
        Self::Error(error.to_string())
    }
}

impl From<DeviceError> for StepError {
    fn from(error: DeviceError) -> Self {
        match &error {
            DeviceError::Lost { device, .. } | DeviceError::Start { device, .. } => {
                Self::Lost { device: device.clone(), message: error.to_string() }
            }
            DeviceError::Refused { device, .. } if error.is_loss() => {
                Self::Lost { device: device.clone(), message: error.to_string() }
            }
            DeviceError::Refused { .. } => Self::Error(error.to_string()),
        }
    }
}
