//! The device of a loaded plugin.

use std::ptr;

use plumb_abi::{Bytes, Instance, RobotFunctions, SensorFunctions};
use plumb_plugin::{Description, PluginError, Value};

use super::Loaded;
use super::calls::{Calls, checked};
use super::functions::Functions;
use super::table::host_functions;
use crate::context::Context;

/// The device of a loaded plugin. Stays on the thread that created it, as the contract promises the plugin.
pub(crate) struct Device {
    loaded: Loaded,
    functions: Functions,
    instance: *mut Instance,
    context: &'static Context,
}

impl Loaded {
    /// Creates the device.
    ///
    /// # Errors
    /// What the plugin says.
    pub(crate) fn create(self, config: &Value, context: &'static Context) -> Result<Device, PluginError> {
        let functions = self.functions().map_err(PluginError::Failed)?;
        let config = config.to_string();
        let mut instance = ptr::null_mut();
        let Some(create) = self.entry.create else { return Err(PluginError::unsupported("be created")) };
        // SAFETY: the entry was checked; the configuration outlives the call and the table the process.
        let status = unsafe { create(host_functions(context), Bytes::of_text(&config), &raw mut instance) };
        checked(context, status)?;
        if instance.is_null() {
            return Err(PluginError::Failed(
                "the plugin's `create` reported success and gave no device".to_owned(),
            ));
        }
        Ok(Device { loaded: self, functions, instance, context })
    }
}

impl Device {
    /// The robot's functions.
    ///
    /// # Errors
    /// [`PluginError::Unsupported`] for a sensor.
    pub(crate) fn robot(&self) -> Result<Calls<'_, RobotFunctions>, PluginError> {
        match &self.functions {
            Functions::Robot(table) => Ok(Calls { table, instance: self.instance, context: self.context }),
            Functions::Sensor(_) => {
                Err(PluginError::Unsupported("this device is a sensor, not a robot".to_owned()))
            }
        }
    }

    /// The sensor's functions.
    ///
    /// # Errors
    /// [`PluginError::Unsupported`] for a robot.
    pub(crate) fn sensor(&self) -> Result<Calls<'_, SensorFunctions>, PluginError> {
        match &self.functions {
            Functions::Sensor(table) => Ok(Calls { table, instance: self.instance, context: self.context }),
            Functions::Robot(_) => {
                Err(PluginError::Unsupported("this device is a robot, not a sensor".to_owned()))
            }
        }
    }

    /// What the device says about itself.
    pub(crate) fn describe(&self) -> Result<Description, PluginError> {
        match &self.functions {
            Functions::Robot(_) => self.robot()?.describe().map(Description::Robot),
            Functions::Sensor(_) => self.sensor()?.describe().map(Description::Sensor),
        }
    }

    /// Makes a robot ready to move; a sensor is ready.
    pub(crate) fn activate(&mut self) -> Result<(), PluginError> {
        self.robot().map_or(Ok(()), |robot| robot.activate())
    }

    /// Brings a robot to rest so that it may be left alone; a sensor may always be.
    pub(crate) fn deactivate(&mut self) -> Result<(), PluginError> {
        self.robot().map_or(Ok(()), |robot| robot.deactivate())
    }

    /// Brings a robot to rest; a sensor is always at rest.
    pub(crate) fn stop(&mut self) -> Result<(), PluginError> {
        self.robot().map_or(Ok(()), |robot| robot.stop())
    }

    /// Lets a sensor take in what has come; a robot takes nothing in.
    pub(crate) fn poll(&mut self) -> Result<(), PluginError> {
        self.sensor().map_or(Ok(()), |sensor| sensor.poll())
    }

    /// Ends the device.
    pub(crate) fn destroy(self) -> Result<(), PluginError> {
        if let Some(destroy) = self.loaded.entry.destroy {
            // SAFETY: the instance is the plugin's own, and is not used again.
            unsafe { destroy(self.instance) };
        }
        self.context.take_failure().map_or(Ok(()), |text| Err(PluginError::Failed(text)))
    }
}
