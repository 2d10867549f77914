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
    /// For a run that begins. The devices are ended by what keeps them.
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
        // Anyone who keeps the devices runs one procedure after the other and puts the world back between them.
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

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::super::hosted::tests::{devices_in_world, devices_without_world};
    use super::*;

    #[test]
    fn what_a_run_asks_for_comes_from_the_devices_that_are_kept() {
        let (_directory, devices, _) = devices_in_world();
        let shared = Arc::new(Mutex::new(devices));
        let mut kept = KeptDevices::new(&shared);
        let act = Act { name: "read_level".into(), ..Act::default() };
        assert_eq!(kept.simulate(&act), Ok(Some(0.25)));
        assert!(kept.is_new_world(), "the world is put back between the runs");
        assert_eq!(kept.world_socket().as_deref(), Some("/run/world.sock"));
        assert_eq!(kept.clock_ns(), None, "the world keeps the clock");
        assert!(kept.listen("arm", "joints").is_err(), "nothing is connected");
        shared.lock().unwrap().lose("arm", "arm is lost");
        assert_eq!(kept.lost().map(|lost| lost.device), Some("arm".to_owned()));
        assert_eq!(kept.lost(), None, "it is reported once");
        shared.lock().unwrap().log("eye", "hello");
        let lines: Vec<String> = kept.log_lines().into_iter().map(|line| line.message).collect();
        assert_eq!(lines, ["hello"]);
        kept.shut_down(false);
        assert!(kept.world_socket().is_some(), "anyone who keeps the devices ends them");
        shared.lock().unwrap().shut_down(false);
        assert_eq!(kept.world_socket(), None);
        let (_directory, devices) = devices_without_world();
        let kept = KeptDevices::new(&Arc::new(Mutex::new(devices)));
        assert_eq!((kept.world_socket(), kept.clock_ns().is_some()), (None, true));
    }
}
