//! `measure`

use plumb_plugin::Reading;
use serde_json::{Map, Value, json};

use crate::engine::Engine;
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
            let key =
                if unit.is_empty() { quantity.name.clone() } else { format!("{}_{unit}", quantity.name) };
            result.insert(key, json!(quantity.value));
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

    /// Reads a sensor: with `trigger` that one first, and then what the sensor made of what it sent.
    pub(super) fn take_reading(&mut self, sensor: &str, trigger: Option<&str>) -> Result<Reading, StepError> {
        self.look_for_interrupt()?;
        let after_ns = match trigger {
            None => 0,
            Some(trigger) => {
                let taken = self.sensor(trigger)?.link.read(0);
                taken.map_err(|error| self.device_error(error))?.time_ns
            }
        };
        let read = self.sensor(sensor)?.link.read(after_ns);
        read.map_err(|error| self.device_error(error))
    }

    fn unit_of_quantity(&mut self, sensor: &str, name: &str) -> Result<String, StepError> {
        let quantities = &self.sensor(sensor)?.link.description().quantities;
        let found = quantities.iter().find(|known| known.name == name);
        Ok(found.map(|known| known.unit.replace('%', "percent")).unwrap_or_default())
    }
}
