//! `configure`

use serde_json::json;

use crate::engine::Engine;
use crate::engine::step_context::Done;
use crate::engine::step_error::StepError;
use crate::step::ConfigureStep;

impl Engine {
    pub(super) fn execute_configure(&mut self, step: &ConfigureStep) -> Result<Done, StepError> {
        let configured = self.sensor(&step.sensor)?.link.configure(&step.settings);
        configured.map_err(|error| self.device_error(error))?;
        let message = format!("{} works with {}", step.sensor, step.settings);
        Ok(Done { result: json!({"configured": true}), values: Vec::new(), message })
    }
}
