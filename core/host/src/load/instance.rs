//! The device of a loaded plugin, with its C functions made safe to call.

use std::ffi::c_void;
use std::ptr;

use bytemuck::Pod;
use plumb_abi::{Bytes, Instance, RobotFunctions, SensorFunctions, Sink, Status};
use plumb_plugin::{
    Description, DigitalInputs, JogState, JointState, JointVector, Motion, PluginError, Reading,
    RobotDescription, SensorDescription, Value,
};
use serde::de::DeserializeOwned;

use super::Loaded;
use super::functions::Functions;
use super::table::host_functions;
use crate::child::Context;
use crate::flood::LONGEST_ANSWER;

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
        let Some(create) = self.entry.create else { return Err(missing("create")) };
        // SAFETY: the entry was checked; the configuration outlives the call and the table the process.
        let status = unsafe { create(host_functions(context), Bytes::of_text(&config), &raw mut instance) };
        told(context, status)?;
        if instance.is_null() {
            return Err(PluginError::Failed(
                "the plugin's create said all is well and gave no device".to_owned(),
            ));
        }
        Ok(Device { loaded: self, functions, instance, context })
    }
}

/// The error of a status, with the text the plugin gave.
fn told(context: &Context, status: Status) -> Result<(), PluginError> {
    let text = context.take_failure();
    match status {
        Status::OK => Ok(()),
        other => Err(PluginError::from_status(
            other,
            text.unwrap_or_else(|| "the plugin does not say why".to_owned()),
        )),
    }
}

fn missing(what: &str) -> PluginError {
    PluginError::unsupported(what)
}

impl Device {
    /// What the device says about itself.
    pub(crate) fn describe(&self) -> Result<Description, PluginError> {
        match &self.functions {
            Functions::Robot(functions) => {
                let describe = functions.describe.ok_or_else(|| missing("describe itself"))?;
                // SAFETY: as in `call`.
                let answer: RobotDescription =
                    self.answered("description", |sink| unsafe { describe(self.instance, sink) })?;
                Ok(Description::Robot(answer))
            }
            Functions::Sensor(functions) => {
                let describe = functions.describe.ok_or_else(|| missing("describe itself"))?;
                // SAFETY: as in `call`.
                let answer: SensorDescription =
                    self.answered("description", |sink| unsafe { describe(self.instance, sink) })?;
                Ok(Description::Sensor(answer))
            }
        }
    }

    pub(crate) fn activate(&mut self) -> Result<(), PluginError> {
        self.if_robot(|functions| functions.activate)
    }

    pub(crate) fn deactivate(&mut self) -> Result<(), PluginError> {
        self.if_robot(|functions| functions.deactivate)
    }

    /// Brings a robot to rest; a sensor always is.
    pub(crate) fn stop(&mut self) -> Result<(), PluginError> {
        self.if_robot(|functions| functions.stop)
    }

    pub(crate) fn read_joints(&mut self) -> Result<JointState, PluginError> {
        let read = self.robot()?.read_joints.ok_or_else(|| missing("read its joints"))?;
        // SAFETY: as in `call`.
        self.filled(|state| unsafe { read(self.instance, state) })
    }

    pub(crate) fn move_joints(&mut self, motion: &Motion) -> Result<JointState, PluginError> {
        let move_joints = self.robot()?.move_joints.ok_or_else(|| missing("move"))?;
        // SAFETY: as in `call`; the motion outlives it.
        self.filled(|state| unsafe { move_joints(self.instance, ptr::from_ref(motion).cast(), state) })
    }

    pub(crate) fn read_inputs(&mut self) -> Result<DigitalInputs, PluginError> {
        let read = self.robot()?.read_inputs.ok_or_else(|| missing("read input lines"))?;
        // SAFETY: as in `call`.
        self.filled(|inputs| unsafe { read(self.instance, inputs) })
    }

    pub(crate) fn write_outputs(&mut self, levels: u64) -> Result<(), PluginError> {
        let write = self.robot()?.write_outputs.ok_or_else(|| missing("set output lines"))?;
        // SAFETY: as in `call`.
        self.call(|| unsafe { write(self.instance, levels) })
    }

    pub(crate) fn jog(&mut self, on: bool) -> Result<JogState, PluginError> {
        let jog = self.robot()?.jog.ok_or_else(|| missing("be jogged from a pendant"))?;
        // SAFETY: as in `call`.
        self.filled(|state| unsafe { jog(self.instance, u32::from(on), state) })
    }

    pub(crate) fn set_zero(&mut self, joints: &JointVector) -> Result<(), PluginError> {
        let set_zero = self.robot()?.set_zero.ok_or_else(|| missing("set its zero"))?;
        // SAFETY: as in `call`; the joints outlive it.
        self.call(|| unsafe { set_zero(self.instance, ptr::from_ref(joints).cast()) })
    }

    pub(crate) fn configure(&mut self, settings: &Value) -> Result<(), PluginError> {
        let configure = self.sensor()?.configure.ok_or_else(|| missing("be configured while it runs"))?;
        let settings = settings.to_string();
        // SAFETY: as in `call`; the settings outlive it.
        self.call(|| unsafe { configure(self.instance, Bytes::of_text(&settings)) })
    }

    pub(crate) fn arm(&mut self) -> Result<(), PluginError> {
        // SAFETY: as in `call`.
        self.sensor()?.arm.map_or(Ok(()), |arm| self.call(|| unsafe { arm(self.instance) }))
    }

    /// Lets a sensor take in what has come; a robot takes nothing in.
    pub(crate) fn poll(&mut self) -> Result<(), PluginError> {
        let Functions::Sensor(functions) = &self.functions else { return Ok(()) };
        // SAFETY: as in `call`.
        functions.poll.map_or(Ok(()), |poll| self.call(|| unsafe { poll(self.instance) }))
    }

    /// A reading; `None` when the inputs have not been seen up to `after_ns`.
    pub(crate) fn read(&mut self, after_ns: u64) -> Result<Option<Reading>, PluginError> {
        let read = self.sensor()?.read.ok_or_else(|| missing("be read"))?;
        let mut far_enough = true;
        let answer = self.written(|sink| {
            // SAFETY: as in `call`.
            let status = unsafe { read(self.instance, after_ns, sink) };
            far_enough = status != Status::EMPTY;
            if far_enough { status } else { Status::OK }
        })?;
        if far_enough { parsed("reading", &answer).map(Some) } else { Ok(None) }
    }

    /// Ends the device.
    pub(crate) fn destroy(self) -> Result<(), PluginError> {
        if let Some(destroy) = self.loaded.entry.destroy {
            // SAFETY: the instance is the plugin's own, and is not used again.
            unsafe { destroy(self.instance) };
        }
        self.context.take_failure().map_or(Ok(()), |text| Err(PluginError::Failed(text)))
    }

    fn robot(&self) -> Result<&RobotFunctions, PluginError> {
        match &self.functions {
            Functions::Robot(functions) => Ok(functions),
            Functions::Sensor(_) => {
                Err(PluginError::Unsupported("this device is a sensor, not a robot".to_owned()))
            }
        }
    }

    fn sensor(&self) -> Result<&SensorFunctions, PluginError> {
        match &self.functions {
            Functions::Sensor(functions) => Ok(functions),
            Functions::Robot(_) => {
                Err(PluginError::Unsupported("this device is a robot, not a sensor".to_owned()))
            }
        }
    }

    /// Calls a robot's function that takes nothing and may be missing; a sensor has nothing to do.
    fn if_robot(
        &self,
        function: impl Fn(&RobotFunctions) -> Option<unsafe extern "C" fn(*mut Instance) -> Status>,
    ) -> Result<(), PluginError> {
        let Functions::Robot(functions) = &self.functions else { return Ok(()) };
        // SAFETY: as in `call`.
        function(functions).map_or(Ok(()), |function| self.call(|| unsafe { function(self.instance) }))
    }

    /// One call of the plugin. What every caller relies on: the instance is the plugin's own, this is the thread that created it, and no other
    /// call is under way.
    fn call(&self, function: impl FnOnce() -> Status) -> Result<(), PluginError> {
        told(self.context, function())
    }

    /// One call that fills in a message.
    fn filled<M: Pod>(&self, function: impl FnOnce(*mut c_void) -> Status) -> Result<M, PluginError> {
        let mut message = M::zeroed();
        self.call(|| function(ptr::from_mut(&mut message).cast()))?;
        Ok(message)
    }

    /// One call that writes an answer.
    fn written(&self, function: impl FnOnce(*const Sink) -> Status) -> Result<Vec<u8>, PluginError> {
        let mut answer = Answer { bytes: Vec::new(), length: 0 };
        let sink = Sink { context: ptr::from_mut(&mut answer).cast(), write: Some(append) };
        self.call(|| function(&raw const sink))?;
        if answer.length > LONGEST_ANSWER {
            return Err(PluginError::Failed(format!(
                "the plugin's answer has {} bytes; it may have {LONGEST_ANSWER}",
                answer.length
            )));
        }
        Ok(answer.bytes)
    }

    fn answered<T: DeserializeOwned>(
        &self,
        what: &str,
        function: impl FnOnce(*const Sink) -> Status,
    ) -> Result<T, PluginError> {
        parsed(what, &self.written(function)?)
    }
}

fn parsed<T: DeserializeOwned>(what: &str, answer: &[u8]) -> Result<T, PluginError> {
    serde_json::from_slice(answer)
        .map_err(|error| PluginError::Failed(format!("the plugin's {what} cannot be understood: {error}")))
}

/// An answer as it is written piece by piece: no more of it is kept than an answer may have.
struct Answer {
    bytes: Vec<u8>,
    length: usize,
}

/// Appends a piece to an answer.
unsafe extern "C" fn append(context: *mut c_void, piece: Bytes) {
    // SAFETY: the context is the answer of the call under way, which nothing else uses meanwhile; the piece is lent for this call.
    unsafe {
        if let Some(answer) = context.cast::<Answer>().as_mut() {
            let piece = piece.as_slice();
            answer.length = answer.length.saturating_add(piece.len());
            if answer.length <= LONGEST_ANSWER {
                answer.bytes.extend_from_slice(piece);
            }
        }
    }
}
