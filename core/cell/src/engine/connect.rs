//! Connecting the cell's devices, and connecting lost ones again.

use std::sync::Arc;

use serde_json::Value;

use super::arm::{Arm, zero_in_force};
use super::step_error::StepError;
use super::zero_trust::Stage;
use super::{Engine, Sensor};
use crate::deg_or_mm::DegOrMm;
use crate::device::Link;
use crate::event::DeviceState;
use crate::workcell::{DeviceSetting, KeepOut};

impl Engine {
    /// Starts every device of the cell. Nothing moves.
    pub(crate) fn connect_all(&mut self) -> Result<(), StepError> {
        let cell = Arc::clone(&self.cell);
        // Their hosts start at once: the first makes a stream, the other finds it there.
        let mut requested = Vec::new();
        for device in &cell.devices {
            requested.push((device, self.guard_of(&device.name)?));
        }
        self.links.prepare(&requested);
        let (first, second): (Vec<_>, Vec<_>) =
            cell.devices.iter().partition(|device| device.inputs.is_empty());
        for device in first.into_iter().chain(second) {
            self.connect(device)?;
        }
        Ok(())
    }

    /// What a robot's host makes its check of moves from; null while nobody knows its zeros.
    fn guard_of(&mut self, device: &str) -> Result<Value, StepError> {
        let keep_out = self.keep_out_of(device)?;
        let trusted = keep_out.filter(|_| self.trusts_zeros(device));
        Ok(trusted.as_ref().map_or(Value::Null, KeepOut::to_value))
    }

    /// Starts one device, in place of what was there under its name.
    fn connect(&mut self, device: &DeviceSetting) -> Result<(), StepError> {
        self.journal.device(&device.name, &device.plugin, DeviceState::Unconfigured, None);
        self.pose_cache.forget();
        let keep_out = self.keep_out_of(&device.name)?;
        let guard = self.guard_of(&device.name)?;
        let link = self.links.connect(device, guard)?;
        self.lost.retain(|lost| *lost != device.name);
        match (link, self.cell.robot(&device.name).cloned()) {
            (Link::Robot(link), Some(setting)) => {
                self.stops.set(&device.name, link.stop_action());
                let mut arm = Arm::new(link, &device.plugin, &setting, keep_out.as_ref())?;
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
                self.give_corrections(&device.name)?;
                self.give_settings(&device.name)?;
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

    /// The check of a robot's keep-out planes by the zeros in force; none without planes, or while its zeros are not known.
    fn keep_out_of(&mut self, robot: &str) -> Result<Option<KeepOut>, StepError> {
        let cell = Arc::clone(&self.cell);
        let Some(setting) = cell.robot(robot) else { return Ok(None) };
        let corrections = self.zeros_in_force(robot)?;
        let zero_of = |joint: &str| {
            let unit = setting.unit(joint).unwrap_or(DegOrMm::Deg);
            zero_in_force(&corrections, joint).map_or(0.0, |value| unit.to_internal(value))
        };
        Ok(KeepOut::for_robot(setting, &cell.keep_out).map(|check| check.with_zeros(zero_of)))
    }

    /// Whether the zeros in force say where a robot is: they are all known, and this run is not to find them anew.
    pub(crate) fn trusts_zeros(&self, robot: &str) -> bool {
        let Some(setting) = self.cell.robot(robot) else { return false };
        let corrections = self.zeros_in_force(robot).unwrap_or_default();
        let known = setting.initialize.iter().all(|joint| zero_in_force(&corrections, joint).is_some());
        known && !self.finds_zeros.iter().any(|name| name == robot)
    }

    /// Starts the lost devices again. A robot stays where it is until it is commanded to move.
    pub(crate) fn reconnect_lost(&mut self) -> Result<(), StepError> {
        let cell = Arc::clone(&self.cell);
        for name in self.lost.clone() {
            if let Some(device) = cell.devices.iter().find(|device| device.name == name) {
                self.connect(device)?;
                self.check_zeros_of(&name, Stage::InMidRun)?;
            }
        }
        self.activate_robots()?;
        self.read_and_note_poses()
    }

    /// Notes that a device's process is gone and stops every robot.
    pub(crate) fn note_lost(
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
