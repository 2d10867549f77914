//! RTDE, byte by byte. Packages are a length (uint16, big-endian, the header included), a kind (uint8), and what the kind has.
//!
//! <https://docs.universal-robots.com/tutorials/communication-protocol-tutorials/rtde-guide.html>

use crate::modes::{RobotMode, RuntimeState, SafetyMode};

/// Joints of these arms.
pub const AXES: usize = 6;

/// The version of the protocol that this driver speaks; software from 3.4 and 5.0 on does.
pub const VERSION: u16 = 2;

/// Bytes of the header of a package.
const HEADER: usize = 3;

/// What a package is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Kind {
    /// Which version of the protocol is spoken.
    RequestVersion = b'V',
    /// The version of the controller's software.
    ControllerVersion = b'v',
    /// A text of the controller's.
    Text = b'M',
    /// A state, or inputs.
    Data = b'U',
    /// Which values a state has.
    SetUpOutputs = b'O',
    /// Which values inputs have.
    SetUpInputs = b'I',
    /// States begin.
    Start = b'S',
    /// States pause.
    Pause = b'P',
}

/// Why what came is not RTDE, or not what was agreed.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RtdeError {
    /// A length that no package has.
    #[error("a package claims to be {0} bytes long, less than its own header: what answers is not RTDE")]
    Length(usize),
    /// A kind of package there is not.
    #[error("a package of the unknown kind {0}: what answers is not RTDE")]
    Kind(u8),
    /// A package that ends too early or too late.
    #[error("a package of kind {kind} has {found} bytes where {requested} were agreed")]
    Size {
        /// As its letter.
        kind: char,
        /// How many there are.
        found: usize,
        /// How many there should be.
        requested: usize,
    },
    /// A value that cannot be.
    #[error("a state holds {0}, which is no number")]
    NotFinite(&'static str),
}

/// Packages out of what has come so far, in pieces of any size.
#[derive(Debug, Default)]
pub struct Packages {
    bytes: Vec<u8>,
}

impl Packages {
    /// Adds what has come.
    pub fn push(&mut self, bytes: &[u8]) {
        self.bytes.extend_from_slice(bytes);
    }

    /// The next whole package.
    ///
    /// # Errors
    /// [`RtdeError::Length`], [`RtdeError::Kind`]; nothing after it can be trusted.
    pub fn take(&mut self) -> Result<Option<(Kind, Vec<u8>)>, RtdeError> {
        let Some(length) = self.bytes.first_chunk().map(|two| usize::from(u16::from_be_bytes(*two))) else {
            return Ok(None);
        };
        if length < HEADER {
            return Err(RtdeError::Length(length));
        }
        if self.bytes.len() < length {
            return Ok(None);
        }
        let body = self.bytes.get(HEADER..length).map(<[u8]>::to_vec).unwrap_or_default();
        let kind = self.bytes.get(2).copied().unwrap_or(0);
        self.bytes.drain(..length);
        Ok(Some((kind_of(kind)?, body)))
    }
}

fn kind_of(letter: u8) -> Result<Kind, RtdeError> {
    const KINDS: [Kind; 8] = [
        Kind::RequestVersion,
        Kind::ControllerVersion,
        Kind::Text,
        Kind::Data,
        Kind::SetUpOutputs,
        Kind::SetUpInputs,
        Kind::Start,
        Kind::Pause,
    ];
    KINDS.into_iter().find(|kind| *kind as u8 == letter).ok_or(RtdeError::Kind(letter))
}

/// A package; a body of 65,532 bytes is the longest.
pub fn package(kind: Kind, body: &[u8]) -> Vec<u8> {
    let length = u16::try_from(body.len() + HEADER).unwrap_or(u16::MAX);
    let mut bytes = length.to_be_bytes().to_vec();
    bytes.push(kind as u8);
    bytes.extend_from_slice(body);
    bytes
}

/// Asks for [`VERSION`] of the protocol.
pub fn request_version() -> Vec<u8> {
    package(Kind::RequestVersion, &VERSION.to_be_bytes())
}

/// Asks for states with these values, so many a second.
pub fn set_up_outputs(hz: f64, names: &[String]) -> Vec<u8> {
    let mut body = hz.to_be_bytes().to_vec();
    body.extend_from_slice(names.join(",").as_bytes());
    package(Kind::SetUpOutputs, &body)
}

/// Says which inputs will be written.
pub fn set_up_inputs(names: &[String]) -> Vec<u8> {
    package(Kind::SetUpInputs, names.join(",").as_bytes())
}

/// One integer input, by the number of its recipe.
pub fn integer_input(recipe: u8, value: i32) -> Vec<u8> {
    let mut body = vec![recipe];
    body.extend_from_slice(&value.to_be_bytes());
    package(Kind::Data, &body)
}

/// Whether the controller took what was asked.
///
/// # Errors
/// [`RtdeError::Size`].
pub fn accepted(kind: Kind, body: &[u8]) -> Result<bool, RtdeError> {
    match body {
        [answer] => Ok(*answer != 0),
        other => Err(RtdeError::Size { kind: char::from(kind as u8), found: other.len(), requested: 1 }),
    }
}

/// Major, minor, bugfix, build.
///
/// # Errors
/// [`RtdeError::Size`].
pub fn controller_version(body: &[u8]) -> Result<[u32; 4], RtdeError> {
    let wrong = || RtdeError::Size { kind: 'v', found: body.len(), requested: 16 };
    let mut version = [0; 4];
    if body.len() != 16 {
        return Err(wrong());
    }
    for (number, bytes) in version.iter_mut().zip(body.chunks_exact(4)) {
        *number = u32::from_be_bytes(*bytes.first_chunk().ok_or_else(wrong)?);
    }
    Ok(version)
}

/// The number of a recipe, and the type of each of its values.
///
/// # Errors
/// [`RtdeError::Size`] for an answer without a number.
pub fn recipe(kind: Kind, body: &[u8]) -> Result<(u8, Vec<String>), RtdeError> {
    let (number, types) =
        body.split_first().ok_or(RtdeError::Size { kind: char::from(kind as u8), found: 0, requested: 1 })?;
    Ok((*number, String::from_utf8_lossy(types).split(',').map(str::to_owned).collect()))
}

/// The words of a text of the controller's, which says who it is from and how severe it is, too.
pub fn text(body: &[u8]) -> String {
    let message = body.split_first().and_then(|(length, rest)| rest.get(..usize::from(*length)));
    String::from_utf8_lossy(message.unwrap_or(body)).into_owned()
}

/// What is asked of every state, with its type.
pub fn outputs(first_register: u8) -> [(String, &'static str); 8] {
    let register = |number: u8| format!("output_int_register_{number}");
    [
        ("timestamp".to_owned(), "DOUBLE"),
        ("actual_q".to_owned(), "VECTOR6D"),
        ("actual_qd".to_owned(), "VECTOR6D"),
        ("robot_mode".to_owned(), "INT32"),
        ("safety_mode".to_owned(), "INT32"),
        ("runtime_state".to_owned(), "UINT32"),
        (register(first_register), "INT32"),
        (register(first_register + 1), "INT32"),
    ]
}

/// How the robot is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State {
    /// Since the controller was started, s.
    pub timestamp: f64,
    /// rad.
    pub joints: [f64; AXES],
    /// rad/s.
    pub speeds: [f64; AXES],
    /// What the arm is powered for.
    pub robot_mode: RobotMode,
    /// What the safety system allows.
    pub safety_mode: SafetyMode,
    /// What the program does.
    pub runtime: RuntimeState,
    /// The number of the program that began last.
    pub begun: i32,
    /// The number of the program that ended last.
    pub ended: i32,
}

/// Bytes of a state: its recipe's number, a time, two vectors, five numbers.
pub const STATE_BYTES: usize = 1 + 8 + 2 * 8 * AXES + 5 * 4;

impl State {
    /// Reads a state of a recipe.
    ///
    /// # Errors
    /// [`RtdeError::Size`] for one that is not as agreed, [`RtdeError::NotFinite`].
    pub fn read(recipe: u8, body: &[u8]) -> Result<Self, RtdeError> {
        let wrong = || RtdeError::Size { kind: 'U', found: body.len(), requested: STATE_BYTES };
        if body.len() != STATE_BYTES || body.first() != Some(&recipe) {
            return Err(wrong());
        }
        let mut rest = body.get(1..).unwrap_or_default();
        let mut double = || {
            let (bytes, left) = rest.split_first_chunk::<8>()?;
            rest = left;
            Some(f64::from_be_bytes(*bytes))
        };
        let timestamp = double().ok_or_else(wrong)?;
        let (mut joints, mut speeds) = ([0.0; AXES], [0.0; AXES]);
        for value in joints.iter_mut().chain(&mut speeds) {
            *value = double().ok_or_else(wrong)?;
        }
        let mut integer = || {
            let (bytes, left) = rest.split_first_chunk::<4>()?;
            rest = left;
            Some(i32::from_be_bytes(*bytes))
        };
        let mut numbers = [0; 5];
        for number in &mut numbers {
            *number = integer().ok_or_else(wrong)?;
        }
        let [robot_mode, safety_mode, runtime, begun, ended] = numbers;
        if !timestamp.is_finite() {
            return Err(RtdeError::NotFinite("a time"));
        }
        if joints.iter().chain(&speeds).any(|value| !value.is_finite()) {
            return Err(RtdeError::NotFinite("a joint"));
        }
        Ok(Self {
            timestamp,
            joints,
            speeds,
            robot_mode: RobotMode(robot_mode),
            safety_mode: SafetyMode(safety_mode),
            runtime: RuntimeState(runtime),
            begun,
            ended,
        })
    }

    /// The fastest joint, rad/s.
    pub fn fastest(&self) -> f64 {
        self.speeds.iter().fold(0.0, |fastest, speed| speed.abs().max(fastest))
    }
}
