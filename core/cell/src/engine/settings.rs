//! Settings that `configure` steps gave sensors in this run.

use serde_json::Value;

use super::Engine;
use super::step_error::StepError;

impl Engine {
    /// Keeps what a sensor was configured with, for its process to be configured again when it is started anew.
    pub(crate) fn remember_settings(&mut self, sensor: &str, settings: &Value) {
        if let Some(settings) = settings.as_object() {
            self.settings.entry(sensor.to_owned()).or_default().extend(settings.clone());
        }
    }

    /// Configures a sensor whose process has just started as this run configured the one before.
    pub(crate) fn give_settings(&mut self, sensor: &str) -> Result<(), StepError> {
        let Some(settings) = self.settings.get(sensor).cloned() else { return Ok(()) };
        let configured = self.sensor(sensor)?.link.configure(&Value::Object(settings));
        configured.map_err(|error| self.device_error(error))
    }
}
