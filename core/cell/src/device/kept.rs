//! Devices that outlive a run, so that the next run in the same cell need not start them again.

use std::collections::BTreeSet;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use plumb_plugin::Value;

use super::{Act, DeviceError, DeviceLinks, DeviceLog, HostedDevices, Link, LostDevice, StreamLink};
use crate::workcell::DeviceSetting;

/// The devices of a cell for one run of many.
pub struct KeptDevices {
    devices: Arc<Mutex<HostedDevices>>,
    /// Those that were connected in this run: one that is connected again is to be started anew.
    connected: BTreeSet<String>,
}

impl KeptDevices {
    /// For a run that begins. The devices are ended by whoever keeps them.
    pub fn new(devices: &Arc<Mutex<HostedDevices>>) -> Self {
        Self { devices: Arc::clone(devices), connected: BTreeSet::new() }
    }

    fn devices(&self) -> MutexGuard<'_, HostedDevices> {
        self.devices.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl DeviceLinks for KeptDevices {
    fn connect(&mut self, device: &DeviceSetting, guard: Value) -> Result<Link, DeviceError> {
        match self.connected.insert(device.name.clone()) {
            true => self.devices().connect_kept(device, guard),
            false => self.devices().connect(device, guard),
        }
    }

    fn log_lines(&mut self) -> Vec<DeviceLog> {
        self.devices().log_lines()
    }

    fn lost(&mut self) -> Option<LostDevice> {
        self.devices().lost()
    }

    fn listen(&mut self, device: &str, stream: &str) -> Result<Box<dyn StreamLink>, DeviceError> {
        self.devices().listen(device, stream)
    }

    fn simulate(&mut self, act: &Act) -> Result<Option<f64>, String> {
        self.devices().simulate(act)
    }

    fn is_new_world(&self) -> bool {
        // Whoever keeps the devices runs one procedure after the other and puts the world back between them.
        true
    }

    fn clock_ns(&self) -> Option<u64> {
        self.devices().clock_ns()
    }

    fn world_socket(&self) -> Option<String> {
        self.devices().world_socket()
    }

    fn shut_down(&mut self, _keep_world: bool) {}
}
