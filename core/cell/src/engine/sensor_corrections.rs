//! Corrections of sensors' parameters.

use plumb_record::{AppliedCorrection, NewCorrection, SENSOR_PARAMETER};
use serde_json::{Map, Value, json};

use super::Engine;
use super::step_error::StepError;
use crate::event::LogLevel;
use crate::parameter_name::key_of;

/// The key of a sensor's configuration that takes corrections.
pub(crate) const CORRECTIONS: &str = "corrections";

impl Engine {
    /// Gives a sensor the corrections in force, where there are any: a device that starts knows nothing of them.
    pub(crate) fn give_corrections(&mut self, sensor: &str) -> Result<(), StepError> {
        let requested = self.corrections_with(sensor, &[])?;
        if requested.is_empty() {
            return Ok(());
        }
        let mut shown = Vec::new();
        for (key, value) in &requested {
            let value = value.as_f64().ok_or_else(|| {
                StepError::error(format!(
                    "the record's correction `{key}` of {sensor} is no number: roll it back"
                ))
            })?;
            shown.push(format!("{key} {value:.4}"));
        }
        let configured = self.sensor(sensor)?.link.configure(&json!({CORRECTIONS: requested}));
        configured.map_err(|error| self.device_error(error))?;
        let message = format!("{sensor} works with the corrections of the record: {}", shown.join(", "));
        Ok(self.journal.log(LogLevel::Info, sensor, None, &message)?)
    }

    /// All corrections of a sensor, as its configuration takes them: those in force, and `more` in their place.
    pub(crate) fn corrections_with(
        &mut self,
        sensor: &str,
        more: &[NewCorrection],
    ) -> Result<Map<String, Value>, StepError> {
        let in_force = self.journal.record.corrections_in_force(&self.cell.name, sensor)?;
        let mut requested = sensor_corrections(&in_force);
        requested.extend(more.iter().map(|one| (key_of(&one.key.site, &one.unit), json!(one.new))));
        Ok(requested)
    }
}

/// Those of the corrections in force that are a sensor's, by the names its configuration has for them.
pub fn sensor_corrections(in_force: &[AppliedCorrection]) -> Map<String, Value> {
    let mine = in_force.iter().filter(|known| known.key.quantity == SENSOR_PARAMETER);
    mine.map(|known| (key_of(&known.key.site, &known.unit), json!(known.value))).collect()
}
