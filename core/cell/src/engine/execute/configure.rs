//! `configure`

use serde_json::{Value, json};

use crate::engine::Engine;
use crate::engine::step_context::Done;
use crate::engine::step_error::StepError;
use crate::step::ConfigureStep;

impl Engine {
    pub(super) fn execute_configure(&mut self, step: &ConfigureStep) -> Result<Done, StepError> {
        let configured = self.sensor(&step.sensor)?.link.configure(&step.settings);
        configured.map_err(|error| self.device_error(error))?;
        self.remember_settings(step);
        let message = format!("{} works with {}", step.sensor, step.settings);
        Ok(Done { result: json!({"configured": true}), values: Vec::new(), message })
    }

    /// Keeps what a sensor was told, for its process to be told again when it is started anew.
    pub(in crate::engine) fn remember_settings(&mut self, step: &ConfigureStep) {
        if let Some(settings) = step.settings.as_object() {
            self.settings.entry(step.sensor.clone()).or_default().extend(settings.clone());
        }
    }

    /// Tells a sensor whose process has just started what this run told the one before.
    pub(in crate::engine) fn give_settings(&mut self, sensor: &str) -> Result<(), StepError> {
        let Some(settings) = self.settings.get(sensor).cloned() else { return Ok(()) };
        let configured = self.sensor(sensor)?.link.configure(&Value::Object(settings));
        configured.map_err(|error| self.device_error(error))
    }
}
