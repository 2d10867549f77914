//! What a robot or a sensor says about itself.

use serde::{Deserialize, Serialize};

use crate::Message;
use crate::reading::PICTURE_QUANTITIES;

/// What a robot says about itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RobotDescription {
    /// Maker and model, as an operator would say it.
    pub model: String,
    /// The joints, in the order of every joint vector.
    pub joints: Vec<JointDescription>,
    /// The digital input lines.
    #[serde(default)]
    pub inputs: Vec<LineDescription>,
    /// The digital output lines.
    #[serde(default)]
    pub outputs: Vec<LineDescription>,
    /// What else it can do, and how it stops.
    pub capabilities: RobotCapabilities,
}

/// One joint of a robot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JointDescription {
    /// Such as `waist`.
    pub name: String,
    /// The unit of its numbers.
    pub unit: JointUnit,
    /// The lowest it may go.
    pub lower: f64,
    /// The highest it may go.
    pub upper: f64,
    /// The smallest step the drive makes; 0 for one that is continuous.
    pub resolution: f64,
    /// The fastest it may go, per second.
    pub max_speed: f64,
    /// Where it is after the robot's own start-up.
    pub home: f64,
}

/// The unit of a joint's numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum JointUnit {
    /// A turning joint.
    #[serde(rename = "rad")]
    Radian,
    /// A sliding joint, or the opening of a gripper.
    #[serde(rename = "mm")]
    Millimetre,
}

impl JointUnit {
    /// `rad` or `mm`.
    pub fn symbol(self) -> &'static str {
        match self {
            Self::Radian => "rad",
            Self::Millimetre => "mm",
        }
    }
}

/// One digital line.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LineDescription {
    /// What the device's manual calls it.
    pub name: String,
    /// Its bit in the levels, from 0.
    pub bit: u32,
}

/// What a robot can do besides moving its joints, and how it stops.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RobotCapabilities {
    /// Whether a move under way can be ended early. Without it a stop waits for the end of the move, and the pendant is the only stop.
    pub interruptible: bool,
    /// How long the robot takes from a stop to rest, at most: ms.
    pub stop_time_ms: u32,
    /// Whether an operator can jog it from a pendant through [`Robot::jog`](crate::Robot::jog).
    #[serde(default)]
    pub jog: bool,
    /// Whether nothing but its pendant ends a jog: until then no stop reaches the robot, and it is handed over only when an operator asks for it.
    #[serde(default)]
    pub only_pendant_ends_jog: bool,
    /// Whether its zero can be set through [`Robot::set_zero`](crate::Robot::set_zero).
    #[serde(default)]
    pub set_zero: bool,
}

/// What a sensor says about itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SensorDescription {
    /// Maker and model, as an operator would say it.
    pub model: String,
    /// Whether its readings say if it has fired, with the edges.
    #[serde(default)]
    pub switches: bool,
    /// The values its readings carry.
    #[serde(default)]
    pub quantities: Vec<QuantityDescription>,
}

impl SensorDescription {
    /// Of a camera, whose readings are [`Reading::of_picture`](crate::Reading::of_picture).
    pub fn of_camera(model: String) -> Self {
        let quantity = |name: &str| QuantityDescription { name: name.to_owned(), unit: String::new() };
        Self { model, switches: false, quantities: PICTURE_QUANTITIES.map(quantity).to_vec() }
    }
}

/// One value a sensor measures.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct QuantityDescription {
    /// Such as `distance`.
    pub name: String,
    /// Such as `mm`.
    pub unit: String,
}

/// A stream a device emits, as its manifest declares it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StreamDescription {
    /// Its name on the device, such as `inputs` of `arm/inputs`.
    pub name: String,
    /// The layout of its messages, such as `digital-inputs/1`.
    pub message: String,
    /// The longest message in bytes; needed only where the layout has no fixed length.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max_bytes: Option<usize>,
    /// How many messages wait for a slow receiver before the oldest is lost. Left out: enough for a second of a fast robot's states, or
    /// two of a message with `max_bytes`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub depth: Option<usize>,
    /// The numbers of a layout of the plugin's own, which follow `time_ns` and `sequence`: with them every message has the same length, and procedures,
    /// `plumb streams` and programs in Python know them by name. Left out: only the plugins that emit and receive it know what is in it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub fields: Vec<FieldDescription>,
}

/// A number in the messages of a stream, as a manifest declares it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FieldDescription {
    /// Its name, such as `weight`.
    pub name: String,
    /// Its type: `f64`, `f32`, `u64` or `u32`.
    #[serde(rename = "type")]
    pub of: NumberType,
    /// Its unit, such as `g`; left out for a number without.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub unit: String,
}

/// The type of a number in a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum NumberType {
    /// A number of 8 bytes, `double` in C.
    F64,
    /// A number of 4 bytes, `float` in C.
    F32,
    /// A whole number of 8 bytes, `uint64_t` in C.
    U64,
    /// A whole number of 4 bytes, `uint32_t` in C.
    U32,
}

impl StreamDescription {
    /// A stream of one of this crate's messages.
    pub fn of<M: Message>(name: &str) -> Self {
        Self {
            name: name.to_owned(),
            message: M::TYPE_NAME.to_owned(),
            max_bytes: None,
            depth: None,
            fields: Vec::new(),
        }
    }
}

/// An input that a cell file wires to another device's stream, as a manifest declares it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InputDescription {
    /// Its name, such as `line`.
    pub name: String,
    /// The layout of the messages it takes.
    pub message: String,
    /// Whether the device works without it.
    #[serde(default)]
    pub optional: bool,
}

/// What a device says about itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Description {
    /// A robot.
    Robot(RobotDescription),
    /// A sensor.
    Sensor(SensorDescription),
}
