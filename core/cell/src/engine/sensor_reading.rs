//! Readings of sensors for a step.

use plumb_plugin::Reading;

use super::Engine;
use super::believed::picture_not_before;
use super::step_error::StepError;

impl Engine {
    /// Reads a sensor: with `trigger` that one first, and then what the sensor made of what it sent. Nothing that was measured before the last motion
    /// had ended is taken.
    pub(crate) fn take_reading(&mut self, sensor: &str, trigger: Option<&str>) -> Result<Reading, StepError> {
        self.look_for_interrupt()?;
        let rest_ns = self.rest_ns;
        let after_ns = match trigger {
            None => rest_ns,
            Some(trigger) => self.read_sensor(trigger, 0, picture_not_before(rest_ns))?.time_ns,
        };
        self.read_sensor(sensor, after_ns, after_ns)
    }
}
