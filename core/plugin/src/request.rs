//! What the orchestrator asks of a device and what comes back, and how both lie in bytes.

use bytemuck::Pod;
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::{
    DeviceState, DigitalInputs, JogState, JointState, JointVector, Motion, PluginError, Reading,
    RobotDescription, SensorDescription, Value,
};
use plumb_abi::Status;

/// What the orchestrator asks of a device.
#[derive(Clone, Debug, PartialEq)]
pub enum Request {
    /// Joints, lines, values: [`Reply::Described`].
    Describe,
    /// The device's state: [`Reply::State`].
    State,
    /// Make ready; for a robot: may move from now on. Clears a stop. [`Reply::State`].
    Activate,
    /// Bring to rest. [`Reply::State`].
    Deactivate,
    /// [`Reply::Joints`].
    ReadJoints,
    /// [`Reply::Joints`], where the robot came to rest.
    MoveJoints(Motion),
    /// [`Reply::Inputs`].
    ReadInputs,
    /// [`Reply::Done`].
    WriteOutputs(u64),
    /// [`Reply::Jog`].
    Jog {
        /// Hand over to the pendant, or take back.
        on: bool,
    },
    /// [`Reply::Done`].
    SetZero(JointVector),
    /// [`Reply::Done`].
    Configure(Value),
    /// [`Reply::Done`].
    Arm,
    /// [`Reply::Reading`].
    Read {
        /// The inputs must have been seen up to here: ns of the cell's clock; 0 for whatever is there.
        after_ns: u64,
    },
}

/// What comes back from a device.
#[derive(Clone, Debug, PartialEq)]
pub enum Reply {
    /// Done; there is nothing to tell.
    Done,
    /// What the device says about itself.
    Described(Box<Description>),
    /// The state it is in now.
    State(DeviceState),
    /// Where the joints are.
    Joints(JointState),
    /// The levels of the input lines.
    Inputs(DigitalInputs),
    /// Where the robot is while the operator drives it.
    Jog(JogState),
    /// What the sensor has seen.
    Reading(Reading),
}

/// What a device says about itself.
#[derive(Clone, Debug, PartialEq, Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Description {
    /// A robot.
    Robot(RobotDescription),
    /// A sensor.
    Sensor(SensorDescription),
}

/// The bytes of a request or reply cannot be understood: sender and receiver are of different versions, or one is faulty.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum WireError {
    /// The code of the operation is not known.
    #[error("operation {0} is not known; the two programs are of different versions")]
    Operation(u32),
    /// The body has the wrong length or content.
    #[error("the body of {operation} cannot be read: {cause}")]
    Body {
        /// Which request or reply.
        operation: &'static str,
        /// What is wrong.
        cause: String,
    },
}

impl Request {
    /// Its name in log lines and errors.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Describe => "describe",
            Self::State => "state",
            Self::Activate => "activate",
            Self::Deactivate => "deactivate",
            Self::ReadJoints => "read joints",
            Self::MoveJoints(_) => "move joints",
            Self::ReadInputs => "read inputs",
            Self::WriteOutputs(_) => "write outputs",
            Self::Jog { .. } => "jog",
            Self::SetZero(_) => "set zero",
            Self::Configure(_) => "configure",
            Self::Arm => "arm",
            Self::Read { .. } => "read",
        }
    }

    /// Whether the robot may move because of it.
    pub fn is_motion(&self) -> bool {
        matches!(self, Self::MoveJoints(_) | Self::Jog { .. })
    }

    /// The operation's code, and the body.
    pub fn encode(&self) -> (u32, Vec<u8>) {
        match self {
            Self::Describe => (1, Vec::new()),
            Self::State => (2, Vec::new()),
            Self::Activate => (3, Vec::new()),
            Self::Deactivate => (4, Vec::new()),
            Self::ReadJoints => (5, Vec::new()),
            Self::MoveJoints(motion) => (6, plain(motion)),
            Self::ReadInputs => (7, Vec::new()),
            Self::WriteOutputs(levels) => (8, plain(levels)),
            Self::Jog { on } => (9, plain(&u32::from(*on))),
            Self::SetZero(joints) => (10, plain(joints)),
            Self::Configure(settings) => (11, settings.to_string().into_bytes()),
            Self::Arm => (12, Vec::new()),
            Self::Read { after_ns } => (13, plain(after_ns)),
        }
    }

    /// The request of a code and a body.
    ///
    /// # Errors
    /// [`WireError`] for a code or a body that no request has.
    pub fn decode(operation: u32, body: &[u8]) -> Result<Self, WireError> {
        Ok(match operation {
            1 => Self::Describe,
            2 => Self::State,
            3 => Self::Activate,
            4 => Self::Deactivate,
            5 => Self::ReadJoints,
            6 => Self::MoveJoints(read_plain("move joints", body)?),
            7 => Self::ReadInputs,
            8 => Self::WriteOutputs(read_plain("write outputs", body)?),
            9 => Self::Jog { on: read_plain::<u32>("jog", body)? != 0 },
            10 => Self::SetZero(read_plain("set zero", body)?),
            11 => Self::Configure(read_json("configure", body)?),
            12 => Self::Arm,
            13 => Self::Read { after_ns: read_plain("read", body)? },
            other => return Err(WireError::Operation(other)),
        })
    }
}

/// The code of a reply that is an error: the body is its text.
const ERROR: u32 = 100;

impl Reply {
    /// Its name in errors.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Done => "done",
            Self::Described(_) => "a description",
            Self::State(_) => "a state",
            Self::Joints(_) => "a joint state",
            Self::Inputs(_) => "input levels",
            Self::Jog(_) => "a jog state",
            Self::Reading(_) => "a reading",
        }
    }

    /// The reply's code, its status, and the body.
    pub fn encode(result: &Result<Self, PluginError>) -> (u32, Status, Vec<u8>) {
        let (code, body) = match result {
            Ok(Self::Done) => (101, Vec::new()),
            Ok(Self::Described(description)) => (102, json(description)),
            Ok(Self::State(state)) => (103, plain(&state.code())),
            Ok(Self::Joints(state)) => (104, plain(state)),
            Ok(Self::Inputs(inputs)) => (105, plain(inputs)),
            Ok(Self::Jog(state)) => (106, plain(state)),
            Ok(Self::Reading(reading)) => (107, json(reading)),
            Err(error) => return (ERROR, error.status(), error.text().as_bytes().to_vec()),
        };
        (code, Status::OK, body)
    }

    /// The reply of a code, a status and a body: the inner result is what the device answered.
    ///
    /// # Errors
    /// [`WireError`] for a code or a body that no reply has.
    pub fn decode(code: u32, status: Status, body: &[u8]) -> Result<Result<Self, PluginError>, WireError> {
        Ok(Ok(match code {
            ERROR => {
                let text = String::from_utf8_lossy(body).into_owned();
                return Ok(Err(PluginError::from_status(status, text)));
            }
            101 => Self::Done,
            102 => Self::Described(Box::new(read_json("a description", body)?)),
            103 => {
                let state: u32 = read_plain("a state", body)?;
                let cause = || format!("{state} is no state");
                Self::State(
                    DeviceState::from_code(state)
                        .ok_or_else(|| WireError::Body { operation: "a state", cause: cause() })?,
                )
            }
            104 => Self::Joints(read_plain("a joint state", body)?),
            105 => Self::Inputs(read_plain("input levels", body)?),
            106 => Self::Jog(read_plain("a jog state", body)?),
            107 => Self::Reading(read_json("a reading", body)?),
            other => return Err(WireError::Operation(other)),
        }))
    }
}

fn plain<T: Pod>(value: &T) -> Vec<u8> {
    bytemuck::bytes_of(value).to_vec()
}

fn read_plain<T: Pod>(operation: &'static str, body: &[u8]) -> Result<T, WireError> {
    bytemuck::try_pod_read_unaligned(body).map_err(|_| WireError::Body {
        operation,
        cause: format!("it has {} bytes instead of {}", body.len(), size_of::<T>()),
    })
}

/// JSON of a type of this crate, none of which can fail to be written: a value that somehow does is written as null and refused by the reader.
fn json<T: Serialize>(value: &T) -> Vec<u8> {
    serde_json::to_vec(value).unwrap_or_else(|_| b"null".to_vec())
}

fn read_json<T: DeserializeOwned>(operation: &'static str, body: &[u8]) -> Result<T, WireError> {
    serde_json::from_slice(body).map_err(|error| WireError::Body { operation, cause: error.to_string() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ProximityEdge;

    fn vector() -> JointVector {
        JointVector::from_slice(&[0.1, -1.0 / 3.0, 1e-13]).unwrap()
    }

    #[test]
    fn every_request_survives_its_bytes() {
        for request in [
            Request::Describe,
            Request::State,
            Request::Activate,
            Request::Deactivate,
            Request::ReadJoints,
            Request::MoveJoints(Motion::relative(vector(), 0.25)),
            Request::ReadInputs,
            Request::WriteOutputs(u64::MAX),
            Request::Jog { on: true },
            Request::SetZero(vector()),
            Request::Configure(serde_json::json!({"threshold": 0.1})),
            Request::Arm,
            Request::Read { after_ns: 7 },
        ] {
            let (operation, body) = request.encode();
            assert_eq!(Request::decode(operation, &body), Ok(request));
        }
    }

    #[test]
    fn every_reply_survives_its_bytes_to_the_last_digit() {
        let edge =
            ProximityEdge { joints: vector(), joints_half_width: vector(), fired: 1, ..Default::default() };
        let reading =
            Reading { time_ns: u64::MAX, fired: Some(true), edges: vec![edge], quantities: Vec::new() };
        for reply in [
            Ok(Reply::Done),
            Ok(Reply::State(DeviceState::Active)),
            Ok(Reply::Joints(JointState::new(3, vector(), true))),
            Ok(Reply::Inputs(DigitalInputs { levels: 5, joints: vector(), ..Default::default() })),
            Ok(Reply::Jog(JogState { key: 7, ..Default::default() })),
            Ok(Reply::Reading(reading)),
            Err(PluginError::OutOfRange("waist would turn to 95 deg; it goes to 90 deg".to_owned())),
        ] {
            let (code, status, body) = Reply::encode(&reply);
            assert_eq!(Reply::decode(code, status, &body), Ok(reply));
        }
    }

    #[test]
    fn a_body_cut_short_is_named() {
        let (operation, body) = Request::MoveJoints(Motion::default()).encode();
        let error = Request::decode(operation, &body[1..]).unwrap_err();
        assert_eq!(
            error.to_string(),
            "the body of move joints cannot be read: it has 87 bytes instead of 88"
        );
    }

    #[test]
    fn an_unknown_operation_is_named() {
        assert_eq!(Request::decode(999, &[]), Err(WireError::Operation(999)));
    }
}
