//! Connecting the cell's devices, and connecting lost ones again.

use super::arm::Arm;
use super::step_error::StepError;
use super::{Engine, Sensor};
use crate::device::Link;
use crate::event::DeviceState;
use crate::workcell::DeviceSetting;

impl Engine {
    /// Starts every device of the cell. Nothing moves.
    pub(super) fn connect_all(&mut self) -> Result<(), StepError> {
        let cell = std::sync::Arc::clone(&self.cell);
        // A device that takes in another's stream finds it there.
        let (first, second): (Vec<_>, Vec<_>) =
            cell.devices.iter().partition(|device| device.inputs.is_empty());
        for device in first.into_iter().chain(second) {
            self.connect(device)?;
        }
        Ok(())
    }

    /// Starts one device, in place of what was there under its name.
    fn connect(&mut self, device: &DeviceSetting) -> Result<(), StepError> {
        self.journal.device(&device.name, &device.plugin, DeviceState::Unconfigured, None);
        let link = self.links.connect(device)?;
        self.lost.retain(|lost| *lost != device.name);
        match (link, self.cell.robot(&device.name).cloned()) {
            (Link::Robot(link), Some(setting)) => {
                self.stops.set(&device.name, link.stop_action());
                let mut arm = Arm::new(link, &device.plugin, &setting, &self.cell.keep_out)?;
                arm.show_movement(self.journal.events());
                self.arms.retain(|known| known.name != device.name);
                self.arms.push(arm);
                self.take_over_zeros(&device.name)?;
                self.journal.device(&device.name, &device.plugin, DeviceState::Inactive, None);
            }
            (Link::Sensor(link), None) => {
                let mut sensor = Sensor { name: device.name.clone(), plugin: device.plugin.clone(), link };
                let activated = sensor.link.activate();
                self.sensors.retain(|known| known.name != device.name);
                self.sensors.push(sensor);
                activated.map_err(|error| self.device_error(error))?;
                self.journal.device(&device.name, &device.plugin, DeviceState::Active, None);
            }
            (Link::Robot(_), None) => {
                let message = format!(
                    "`{}` is a robot, and the cell file says nothing about it: name it under `robots:` with its joints",
                    device.name
                );
                return Err(StepError::error(message));
            }
            (Link::Sensor(_), Some(_)) => {
                let message =
                    format!("`{}` is a sensor, but the cell file names it under `robots:`", device.name);
                return Err(StepError::error(message));
            }
        }
        Ok(())
    }

    /// Starts the lost devices again. A robot stays where it stands until it is told to move.
    pub(super) fn reconnect_lost(&mut self) -> Result<(), StepError> {
        let cell = std::sync::Arc::clone(&self.cell);
        for name in self.lost.clone() {
            if let Some(device) = cell.devices.iter().find(|device| device.name == name) {
                self.connect(device)?;
            }
        }
        self.activate_robots()?;
        self.read_and_note_poses()
    }

    /// Notes that a device's process is gone and stops every robot.
    pub(super) fn note_lost(
        &mut self,
        device: &str,
        step: &crate::event::StepPath,
        message: &str,
    ) -> Result<(), StepError> {
        self.stops.fire();
        if !self.lost.iter().any(|lost| lost == device) {
            self.lost.push(device.to_owned());
        }
        self.journal.interruption(plumb_record::Interruption::DeviceLost, Some(step), message)?;
        let plugin = self
            .cell
            .devices
            .iter()
            .find(|known| known.name == device)
            .map_or("", |known| known.plugin.as_str());
        self.journal.device(device, plugin, DeviceState::Lost, Some(message.to_owned()));
        self.show_robots(DeviceState::Inactive);
        Ok(())
    }
}
