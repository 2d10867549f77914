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
        let device = error.device().to_owned();
        match error.is_loss() {
            true if error.is_silence() => {
                Self::Lost { message: format!("{device} is lost: {error}"), device }
            }
            true => Self::Lost { message: error.to_string(), device },
            false => Self::Error(error.to_string()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use plumb_plugin::PluginError;

    #[test]
    fn only_a_device_that_must_be_started_again_is_lost() {
        let refused = |source| StepError::from(DeviceError::refused("arm", "move joints", source));
        let out_of_range = refused(PluginError::OutOfRange("too far".to_owned()));
        assert!(matches!(out_of_range, StepError::Error(message) if message == "arm: too far"));
        let panicked = refused(PluginError::Panicked("it panicked".to_owned()));
        assert!(
            matches!(panicked, StepError::Lost { device, message } if device == "arm" && message == "arm: it panicked")
        );
        let limit = std::time::Duration::from_secs(5);
        let silent = DeviceError::TimedOut { device: "arm".to_owned(), operation: "jog", limit };
        let message = "arm is lost: arm did not answer 'jog' within 5s";
        assert!(
            matches!(StepError::from(silent), StepError::Lost { message: found, .. } if found == message)
        );
    }
}
