//! The `simulated` robot: a driver that knows of its arm what a real controller would report, and asks the world for it.

use std::path::PathBuf;

use plumb_plugin::{
    DigitalInputs, Host, JogState, JointDescription, JointState, JointUnit, JointVector, LineDescription,
    Motion, PluginError, Robot, RobotCapabilities, RobotDescription, Value,
};
use serde::Deserialize;

use crate::client::{ClientError, WorldClient};
use crate::joint_values::JointValues;
use crate::protocol::{self, Change, PendantKey, Reading, Response, WorldCommand};

/// The stream of joint states.
const JOINTS: &str = "joints";
/// The stream of input levels.
const INPUTS: &str = "inputs";

/// The slowest a stop takes effect: a look at the stop, the world's slice, and a half-step, or the brakes of an arm that has any.
const STOP_TIME_MS: u32 = 50;

/// What the cell file gives.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Config {
    /// Which arm of the world.
    arm: String,
    /// The world's socket; the cell gives it.
    world: PathBuf,
}

/// A simulated arm.
#[derive(Debug)]
pub struct SimulatedRobot {
    host: Host,
    config: Config,
    world: WorldClient,
    description: RobotDescription,
}

impl Robot for SimulatedRobot {
    fn create(config: &Value, host: Host) -> Result<Self, PluginError> {
        let config: Config = Config::deserialize(config).map_err(|error| {
            PluginError::Refused(format!(
                "{error}; a simulated robot takes the name of its world's arm, as {{arm: teachmover}}, {{arm: puma560}} or what an arm file says, and, from the cell, the socket of its world"
            ))
        })?;
        let world = WorldClient::connect(&config.world, "simulated")?;
        let there = &world.welcome().arm;
        if *there != config.arm {
            return Err(PluginError::Refused(format!(
                "there is no arm `{}` in the world `{}`; write `arm: {there}`",
                config.arm,
                world.welcome().world
            )));
        }
        let description = description(&world);
        Ok(Self { host, config, world, description })
    }

    fn describe(&self) -> RobotDescription {
        self.description.clone()
    }

    fn activate(&mut self) -> Result<(), PluginError> {
        self.ask(WorldCommand::Read {}).map(drop)
    }

    fn deactivate(&mut self) -> Result<(), PluginError> {
        self.ask(WorldCommand::Stop {}).map(drop)
    }

    fn read_joints(&mut self) -> Result<JointState, PluginError> {
        self.ask(WorldCommand::Read {}).map(|reading| joint_state(&reading))
    }

    fn move_joints(&mut self, motion: &Motion) -> Result<JointState, PluginError> {
        let joints = self.values_of("a target of ", &motion.target)?;
        let joints =
            joints.iter().enumerate().map(|(axis, value)| motion.moves(axis).then_some(*value)).collect();
        let command =
            WorldCommand::Move { joints, relative: motion.relative != 0, speed: motion.speed_fraction };
        if self.host.should_stop() {
            return Err(PluginError::stopped());
        }
        let reading = self.ask(command)?;
        if reading.stopped { Err(PluginError::stopped()) } else { Ok(joint_state(&reading)) }
    }

    fn stop(&mut self) -> Result<(), PluginError> {
        self.ask(WorldCommand::Stop {}).map(drop)
    }

    fn read_inputs(&mut self) -> Result<DigitalInputs, PluginError> {
        self.ask(WorldCommand::Read {}).map(|reading| levels(&reading))
    }

    fn write_outputs(&mut self, levels: u64) -> Result<(), PluginError> {
        let lines = self.world.welcome().output_lines;
        if levels.checked_shr(lines).unwrap_or(0) != 0 {
            let there = match lines.checked_sub(1) {
                Some(last) => format!("has the lines 0 to {last}"),
                None => "has none".to_owned(),
            };
            return Err(PluginError::Refused(format!(
                "output levels {levels:#b} set a line past the last; the arm {there}"
            )));
        }
        self.ask(WorldCommand::Outputs { bits: levels }).map(drop)
    }

    fn jog(&mut self, on: bool) -> Result<JogState, PluginError> {
        let reading = self.ask(WorldCommand::Pendant { on })?;
        Ok(JogState {
            state: joint_state(&reading),
            key: reading.key,
            finished: u32::from(reading.key == PendantKey::Stop as u32),
        })
    }

    fn set_zero(&mut self, joints: &JointVector) -> Result<(), PluginError> {
        let joints = self.values_of("", joints)?;
        self.ask(WorldCommand::SetZero { joints }).map(drop)
    }
}

impl SimulatedRobot {
    /// One value for each joint of the arm, or a refusal that says how many were given.
    fn values_of(&self, what: &str, joints: &JointVector) -> Result<JointValues, PluginError> {
        let count = self.description.joints.len();
        JointValues::from_slice(joints.as_slice()).filter(|values| values.len() == count).ok_or_else(|| {
            PluginError::Refused(format!("{what}{} joint values for an arm of {count} joints", joints.len()))
        })
    }

    /// Makes a call and emits all that happens meanwhile; at its end the joints and, last, the input levels, so that anyone who has
    /// seen these has seen everything before them.
    fn ask(&mut self, command: WorldCommand) -> Result<Reading, PluginError> {
        let Self { host, world, .. } = self;
        let mut unsent = Ok(());
        let on_the_way = |say: &Response| {
            let sent = match say {
                Response::Joints(reading) => host.emit(JOINTS, &joint_state(reading)),
                Response::Change(change) => host.emit(INPUTS, &changed(change)),
                _ => Ok(()),
            };
            if unsent.is_ok() {
                unsent = sent;
            }
        };
        let moves = matches!(command, WorldCommand::Move { .. });
        let end = world.call(command, || moves && host.should_stop(), on_the_way);
        let reading = match end {
            Ok(Response::Reading(reading)) => reading,
            Ok(other) => return Err(PluginError::Failed(format!("the world answered {other:?}"))),
            Err(error) => return Err(self.broken(error)),
        };
        unsent?;
        self.host.emit(JOINTS, &joint_state(&reading))?;
        self.host.emit(INPUTS, &levels(&reading))?;
        Ok(reading)
    }

    /// The error of a call. A connection that broke is made anew, so that the next call may go through.
    fn broken(&mut self, error: ClientError) -> PluginError {
        if !matches!(error, ClientError::Refused(_))
            && let Ok(world) = WorldClient::connect(&self.config.world, "simulated")
        {
            self.world = world;
        }
        PluginError::from(error)
    }
}

fn joint_state(reading: &Reading) -> JointState {
    JointState::new(reading.time_ns, vector(&reading.joints), reading.moving)
}

fn levels(reading: &Reading) -> DigitalInputs {
    DigitalInputs {
        time_ns: reading.time_ns,
        levels: reading.inputs,
        joints: vector(&reading.joints),
        joints_half_width: JointVector::zeros(reading.joints.len()),
        ..Default::default()
    }
}

fn changed(change: &Change) -> DigitalInputs {
    DigitalInputs {
        time_ns: change.time_ns,
        sequence: 0,
        levels: change.levels,
        changed: change.changed,
        joints: vector(&change.joints),
        joints_half_width: vector(&change.half_width),
    }
}

fn vector(values: &JointValues) -> JointVector {
    let mut vector = JointVector::zeros(values.len());
    vector.as_mut_slice().copy_from_slice(values);
    vector
}

fn description(world: &WorldClient) -> RobotDescription {
    let there = world.welcome();
    let joints = there.joints.iter().map(|facts| JointDescription {
        name: facts.name.clone(),
        unit: match facts.unit {
            protocol::JointUnit::Rad => JointUnit::Radian,
            protocol::JointUnit::Mm => JointUnit::Millimetre,
        },
        lower: facts.lower,
        upper: facts.upper,
        resolution: facts.resolution,
        max_speed: facts.top_speed,
        home: facts.home,
    });
    let lines = |what: &str, count: u32| {
        (0..count).map(|bit| LineDescription { name: format!("{what} {}", bit + 1), bit }).collect()
    };
    RobotDescription {
        model: format!("{} (simulated: {})", there.model, there.world),
        joints: joints.collect(),
        inputs: lines("input", there.input_lines),
        outputs: lines("output", there.output_lines),
        capabilities: RobotCapabilities {
            interruptible: true,
            stop_time_ms: STOP_TIME_MS + there.braking_ms,
            jog: true,
            only_pendant_ends_jog: false,
            set_zero: true,
        },
    }
}
