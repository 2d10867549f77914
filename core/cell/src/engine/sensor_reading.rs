//! Readings of sensors for a step.

use plumb_plugin::Reading;

use super::Engine;
use super::believed::{Source, asked_from, check_own_reading, picture_not_before};
use super::step_error::StepError;

impl Engine {
    /// Reads a sensor: with `trigger` that one first, and then what the sensor made of what it sent. Nothing that was measured before the last motion
    /// had ended is taken; of a sensor that takes nothing in from other devices, nothing that was measured before it was asked.
    pub(crate) fn take_reading(&mut self, sensor: &str, trigger: Option<&str>) -> Result<Reading, StepError> {
        self.look_for_interrupt()?;
        let rest_ns = self.rest_ns;
        if let Some(trigger) = trigger {
            let after_ns = self.read_sensor(trigger, 0, picture_not_before(rest_ns))?.time_ns;
            return self.read_sensor(sensor, after_ns, after_ns);
        }
        if self.takes_in(sensor) {
            return self.read_sensor(sensor, rest_ns, rest_ns);
        }
        let asked_from_ns = asked_from(self.links.clock_ns().unwrap_or_default());
        let reading = self.read_sensor(sensor, rest_ns.max(asked_from_ns), rest_ns)?;
        let asked = self.sensor(sensor)?;
        let source = Source { device: sensor, plugin: &asked.plugin };
        check_own_reading(source, asked.link.description(), &reading, asked_from_ns)
            .map_err(StepError::Error)?;
        Ok(reading)
    }

    /// Whether a device takes in what others send: it knows of no moment that they have not reported.
    fn takes_in(&self, device: &str) -> bool {
        self.cell.devices.iter().any(|setting| setting.name == device && !setting.inputs.is_empty())
    }
}
