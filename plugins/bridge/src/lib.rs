#![doc = include_str!("../README.md")]

mod answers;
mod driver;
mod line;
mod reader;

use std::path::PathBuf;

use plumb_plugin::{
    DigitalInputs, Host, JogState, JointState, JointVector, Manifest, Motion, MotorState, PluginError,
    Reading, Robot, RobotCapabilities, RobotDescription, Sensor, SensorDescription, Value,
};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::json;

use driver::Driver;

/// What the host sends the bridge in place of a configuration.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Order {
    manifest: Manifest,
    /// Where the driver's files lie.
    folder: PathBuf,
    config: Value,
}

/// A device whose driver is a process of its own.
pub struct Bridge {
    driver: Driver,
    description: Value,
}

plumb_plugin::export_entry!(plumb_plugin::export::either_entry::<Bridge>(include_str!("../bridge.yaml")));

fn created(order: &Value, host: Host) -> Result<Bridge, PluginError> {
    let order: Order = serde_json::from_value(order.clone())
        .map_err(|error| PluginError::Refused(format!("the bridge runs drivers for plumb alone: {error}")))?;
    let mut driver = Driver::start(&order.manifest, &order.folder, host)?;
    let description = driver.create(&order.config)?;
    let is_robot = order.manifest.kind == plumb_plugin::DeviceKind::Robot;
    let checked = match is_robot {
        true => understood::<RobotDescription>("describe", description.clone()).map(drop),
        false => understood::<SensorDescription>("describe", description.clone()).map(drop),
    };
    checked?;
    Ok(Bridge { driver, description })
}

/// What a driver answered, as the type it has to be.
fn understood<T: DeserializeOwned>(call: &str, answer: Value) -> Result<T, PluginError> {
    let short: String = answer.to_string().chars().take(200).collect();
    serde_json::from_value(answer).map_err(|error| {
        PluginError::Failed(format!("what the driver answered to '{call}' cannot be used: {error}: {short}"))
    })
}

impl Bridge {
    /// Asks the driver, and makes what the host expects of its answer.
    fn asked<T>(
        &mut self,
        call: &str,
        arguments: Value,
        made: impl FnOnce(Value) -> Result<T, String>,
    ) -> Result<T, PluginError> {
        let answer = self.driver.call(call, arguments)?;
        made(answer).map_err(|why| {
            PluginError::Failed(format!("what the driver answered to '{call}' cannot be used: {why}"))
        })
    }

    fn state(&mut self, call: &str, arguments: Value) -> Result<JointState, PluginError> {
        self.asked(call, arguments, |answer| answers::joint_state(&answer))
    }

    fn done(&mut self, call: &str, arguments: Value) -> Result<(), PluginError> {
        self.driver.call(call, arguments).map(drop)
    }
}

impl Robot for Bridge {
    fn create(order: &Value, host: Host) -> Result<Self, PluginError> {
        created(order, host)
    }

    fn describe(&self) -> RobotDescription {
        // It was understood when the device was made; a sensor is never asked for this.
        understood("describe", self.description.clone()).unwrap_or_else(|_| RobotDescription {
            model: String::new(),
            joints: Vec::new(),
            inputs: Vec::new(),
            outputs: Vec::new(),
            capabilities: RobotCapabilities::default(),
        })
    }

    fn activate(&mut self) -> Result<(), PluginError> {
        self.done("activate", json!([]))
    }

    fn deactivate(&mut self) -> Result<(), PluginError> {
        self.done("deactivate", json!([]))
    }

    fn read_joints(&mut self) -> Result<JointState, PluginError> {
        self.state("read_joints", json!([]))
    }

    fn move_joints(&mut self, motion: &Motion) -> Result<JointState, PluginError> {
        self.state("move_joints", json!([motion]))
    }

    fn stop(&mut self) -> Result<(), PluginError> {
        self.done("stop", json!([]))
    }

    fn read_inputs(&mut self) -> Result<DigitalInputs, PluginError> {
        let inputs =
            self.asked("read_inputs", json!([]), |answer| answers::message_of(&answer, "digital-inputs/1"))?;
        understood("read_inputs", inputs)
    }

    fn write_outputs(&mut self, levels: u64) -> Result<(), PluginError> {
        self.done("write_outputs", json!([levels]))
    }

    fn jog(&mut self, on: bool) -> Result<JogState, PluginError> {
        self.asked("jog", json!([on]), answers::jog_state)
    }

    fn set_zero(&mut self, joints: &JointVector) -> Result<(), PluginError> {
        self.done("set_zero", json!([joints]))
    }

    fn read_motors(&mut self) -> Result<MotorState, PluginError> {
        let joints = Robot::describe(self).joints.len();
        self.asked("read_motors", json!([]), |answer| answers::motor_state(answer, joints))
    }
}

impl Sensor for Bridge {
    fn create(order: &Value, host: Host) -> Result<Self, PluginError> {
        created(order, host)
    }

    fn describe(&self) -> SensorDescription {
        // As for a robot.
        understood("describe", self.description.clone()).unwrap_or_else(|_| SensorDescription {
            model: String::new(),
            switches: false,
            quantities: Vec::new(),
        })
    }

    fn configure(&mut self, settings: &Value) -> Result<(), PluginError> {
        self.done("configure", json!([settings]))
    }

    fn arm(&mut self) -> Result<(), PluginError> {
        self.done("arm", json!([]))
    }

    fn poll(&mut self) -> Result<(), PluginError> {
        self.done("poll", json!([]))
    }

    fn read(&mut self, after_ns: u64) -> Result<Option<Reading>, PluginError> {
        understood("read", self.driver.call("read", json!([after_ns]))?)
    }
}
