//! `measure`

use plumb_plugin::Reading;
use serde_json::{Map, Value, json};

use crate::engine::Engine;
use crate::engine::believed::picture_not_before;
use crate::engine::step_context::{Done, StepContext};
use crate::engine::step_error::StepError;
use crate::event::NamedValue;
use crate::step::MeasureStep;

impl Engine {
    pub(super) fn execute_measure(
        &mut self,
        step: &MeasureStep,
        at: &StepContext,
    ) -> Result<Done, StepError> {
        let trigger = step.trigger.as_ref().map(|(name, _)| name.as_str());
        let reading = self.take_reading(&step.sensor, trigger)?;
        let mut result = Map::new();
        let mut values = Vec::new();
        for quantity in &reading.quantities {
            let unit = self.unit_of_quantity(&step.sensor, &quantity.name)?;
            result.insert(result_name(&quantity.name, &unit), json!(quantity.value));
            values.push(NamedValue {
                name: quantity.name.clone(),
                value: quantity.value,
                unit,
                uncertainty: Some(quantity.standard_uncertainty).filter(|sigma| *sigma > 0.0),
            });
        }
        self.journal.noted(&at.path, &step.sensor, &values)?;
        let shown = values.iter().map(|value| format!("{} {:.3} {}", value.name, value.value, value.unit));
        let message = shown.map(|text| text.trim_end().to_owned()).collect::<Vec<_>>().join(", ");
        Ok(Done { result: Value::Object(result), values, message })
    }

    /// Reads a sensor: with `trigger` that one first, and then what the sensor made of what it sent. Nothing that was measured before the last motion
    /// had ended is taken.
    pub(super) fn take_reading(&mut self, sensor: &str, trigger: Option<&str>) -> Result<Reading, StepError> {
        self.look_for_interrupt()?;
        let rest_ns = self.rest_ns;
        let after_ns = match trigger {
            None => rest_ns,
            Some(trigger) => self.read_sensor(trigger, 0, picture_not_before(rest_ns))?.time_ns,
        };
        self.read_sensor(sensor, after_ns, after_ns)
    }

    fn unit_of_quantity(&mut self, sensor: &str, name: &str) -> Result<String, StepError> {
        let quantities = &self.sensor(sensor)?.link.description().quantities;
        let found = quantities.iter().find(|known| known.name == name);
        Ok(found.map(|known| known.unit.clone()).unwrap_or_default())
    }
}

/// The name by which expressions call a measured quantity: with its unit, spelled so that it is a name.
pub(crate) fn result_name(quantity: &str, unit: &str) -> String {
    match unit {
        "" => quantity.to_owned(),
        unit => format!("{quantity}_{}", unit.replace('%', "percent").replace('/', "_per_")),
    }
}
