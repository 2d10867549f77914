//! RTDE as a server speaks it: packages of a length (uint16, big-endian, itself included), a kind (uint8) and what the kind has. The link is in the
//! documentation of the parent module.

use super::controller::Controller;
use super::states::{AXES, CYCLE_S, REGISTERS, RuntimeState, SafetyMode};

/// Bytes of the header of a package.
const HEADER: usize = 3;

/// A value that can be subscribed to.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Output {
    Timestamp,
    TargetQ,
    TargetQd,
    ActualQ,
    ActualQd,
    RobotMode,
    JointMode,
    SafetyMode,
    RuntimeState,
    RobotStatusBits,
    SafetyStatusBits,
    SpeedScaling,
    Register(usize),
    Input(usize),
    /// What an arm of a world does not have: zeros, of this many numbers.
    NotSimulated(usize),
}

/// Every joint holds its position or moves: `JOINT_MODE_RUNNING`.
const JOINT_RUNNING: i32 = 253;

impl Output {
    fn named(name: &str) -> Option<Self> {
        let register = |prefix: &str| {
            let number: usize = name.strip_prefix(prefix)?.parse().ok()?;
            (number < REGISTERS).then_some(number)
        };
        Some(match name {
            "timestamp" => Self::Timestamp,
            "target_q" => Self::TargetQ,
            "target_qd" => Self::TargetQd,
            "actual_q" => Self::ActualQ,
            "actual_qd" => Self::ActualQd,
            "robot_mode" => Self::RobotMode,
            "joint_mode" => Self::JointMode,
            "safety_mode" | "safety_status" => Self::SafetyMode,
            "runtime_state" => Self::RuntimeState,
            "robot_status_bits" => Self::RobotStatusBits,
            "safety_status_bits" => Self::SafetyStatusBits,
            "speed_scaling" | "target_speed_fraction" => Self::SpeedScaling,
            "target_qdd" | "actual_current" | "target_current" | "target_moment" => Self::NotSimulated(AXES),
            "actual_execution_time" | "actual_momentum" | "actual_main_voltage" => Self::NotSimulated(1),
            _ => match register("output_int_register_") {
                Some(number) => Self::Register(number),
                None => Self::Input(register("input_int_register_")?),
            },
        })
    }

    fn type_name(self) -> &'static str {
        match self {
            Self::TargetQ | Self::TargetQd | Self::ActualQ | Self::ActualQd | Self::NotSimulated(AXES) => {
                "VECTOR6D"
            }
            Self::JointMode => "VECTOR6INT32",
            Self::Timestamp | Self::SpeedScaling | Self::NotSimulated(_) => "DOUBLE",
            Self::RuntimeState | Self::RobotStatusBits | Self::SafetyStatusBits => "UINT32",
            Self::RobotMode | Self::SafetyMode | Self::Register(_) | Self::Input(_) => "INT32",
        }
    }

    fn write(self, controller: &Controller, bytes: &mut Vec<u8>) {
        let mut numbers = |numbers: &[f64]| numbers.iter().for_each(|one| bytes.extend(one.to_be_bytes()));
        match self {
            Self::Timestamp => numbers(&[controller.time_s()]),
            Self::TargetQ => numbers(&controller.target),
            Self::TargetQd => numbers(&controller.target_speed),
            Self::ActualQ => numbers(&controller.actual),
            Self::ActualQd => numbers(&controller.actual_speed),
            Self::SpeedScaling => numbers(&[1.0]),
            Self::NotSimulated(count) => numbers(&vec![0.0; count]),
            Self::RobotMode => bytes.extend((controller.robot_mode as i32).to_be_bytes()),
            Self::SafetyMode => bytes.extend((controller.safety_mode as i32).to_be_bytes()),
            Self::RuntimeState => bytes.extend((controller.runtime as u32).to_be_bytes()),
            Self::JointMode => (0..AXES).for_each(|_| bytes.extend(JOINT_RUNNING.to_be_bytes())),
            Self::RobotStatusBits => {
                let running = u32::from(controller.runtime == RuntimeState::Playing);
                bytes.extend((1 | running << 1).to_be_bytes());
            }
            Self::SafetyStatusBits => {
                let bits: u32 = match controller.safety_mode {
                    SafetyMode::Normal => 1,
                    SafetyMode::ProtectiveStop => 1 << 2 | 1 << 10,
                    SafetyMode::RobotEmergencyStop => 1 << 6 | 1 << 7 | 1 << 10,
                    SafetyMode::Fault => 1 << 9 | 1 << 10,
                };
                bytes.extend(bits.to_be_bytes());
            }
            Self::Register(number) => {
                bytes.extend(controller.output_registers.get(number).unwrap_or(&0).to_be_bytes());
            }
            Self::Input(number) => {
                bytes.extend(controller.input_registers.get(number).unwrap_or(&0).to_be_bytes());
            }
        }
    }
}

/// What one client has agreed with the controller.
#[derive(Debug)]
pub(super) struct RtdeSession {
    /// The highest version this controller speaks.
    most_version: u16,
    version: u16,
    heard: Vec<u8>,
    outputs: Vec<Output>,
    outputs_known: bool,
    every_s: f64,
    due_s: f64,
    /// Input recipes, by their number from 1: the registers in their order.
    inputs: Vec<Vec<usize>>,
    started: bool,
}

impl RtdeSession {
    pub(super) fn new(most_version: u16) -> Self {
        Self {
            most_version,
            version: 1,
            heard: Vec::new(),
            outputs: Vec::new(),
            outputs_known: false,
            every_s: 0.0,
            due_s: 0.0,
            inputs: Vec::new(),
            started: false,
        }
    }

    /// The registers this client writes.
    pub(super) fn claimed(&self) -> impl Iterator<Item = usize> + '_ {
        self.inputs.iter().flatten().copied()
    }

    /// Takes what was heard, and gives the answers; none for what is no package, after which the connection ends.
    pub(super) fn hear(
        &mut self,
        bytes: &[u8],
        controller: &mut Controller,
        claimed_by_others: &[usize],
    ) -> Option<Vec<u8>> {
        self.heard.extend(bytes);
        let mut message = Vec::new();
        while let Some(length) =
            self.heard.first_chunk().map(|length| usize::from(u16::from_be_bytes(*length)))
        {
            if length < HEADER {
                return None;
            }
            if self.heard.len() < length {
                break;
            }
            let whole: Vec<u8> = self.heard.drain(..length).collect();
            let (kind, body) = (*whole.get(2)?, whole.get(HEADER..)?);
            message.extend(self.answer(kind, body, controller, claimed_by_others)?);
        }
        Some(message)
    }

    fn answer(
        &mut self,
        kind: u8,
        body: &[u8],
        controller: &mut Controller,
        claimed_by_others: &[usize],
    ) -> Option<Vec<u8>> {
        let accepted = |yes: bool| Some(package(kind, &[u8::from(yes)]));
        match kind {
            b'V' => {
                let requested = u16::from_be_bytes(*body.first_chunk()?);
                let known = (1..=self.most_version).contains(&requested);
                if known {
                    self.version = requested;
                }
                accepted(known)
            }
            b'v' => {
                let version = controller.series.version();
                let numbers: Vec<u8> = version.iter().flat_map(|number| number.to_be_bytes()).collect();
                Some(package(kind, &numbers))
            }
            b'O' => self.set_up_outputs(body, controller),
            b'I' => Some(self.set_up_inputs(body, claimed_by_others)),
            b'S' => {
                self.started = self.outputs_known;
                accepted(self.started)
            }
            b'P' => {
                self.started = false;
                accepted(true)
            }
            b'U' => {
                if self.started {
                    self.take_inputs(body, controller)?;
                }
                Some(Vec::new())
            }
            // A text of the client's is for the log of the pendant.
            b'M' => Some(Vec::new()),
            _ => None,
        }
    }

    fn set_up_outputs(&mut self, body: &[u8], controller: &Controller) -> Option<Vec<u8>> {
        let (hz, names) = match self.version {
            1 => (125.0, body),
            _ => (f64::from_be_bytes(*body.first_chunk()?), body.get(8..)?),
        };
        let names = String::from_utf8_lossy(names).into_owned();
        let found: Vec<Option<Output>> = names.split(',').map(Output::named).collect();
        let types: Vec<&str> =
            found.iter().map(|found| found.map_or("NOT_FOUND", Output::type_name)).collect();
        self.outputs_known =
            found.iter().all(Option::is_some) && (1.0..=controller.series.most_hz()).contains(&hz);
        self.outputs = found.into_iter().flatten().collect();
        self.every_s = if hz > 0.0 { 1.0 / hz } else { 1.0 };
        let mut message = if self.version == 1 { Vec::new() } else { vec![u8::from(self.outputs_known)] };
        message.extend(types.join(",").bytes());
        Some(package(b'O', &message))
    }

    fn set_up_inputs(&mut self, body: &[u8], claimed_by_others: &[usize]) -> Vec<u8> {
        let names = String::from_utf8_lossy(body).into_owned();
        let register = |name: &str| {
            let number: usize = name.strip_prefix("input_int_register_")?.parse().ok()?;
            (number < REGISTERS).then_some(number)
        };
        let found: Vec<Option<usize>> = names.split(',').map(register).collect();
        let type_of = |found: &Option<usize>| match found {
            Some(register) if claimed_by_others.contains(register) => "IN_USE",
            Some(_) => "INT32",
            None => "NOT_FOUND",
        };
        let types: Vec<&str> = found.iter().map(type_of).collect();
        let mut number = 0;
        if types.iter().all(|one| *one == "INT32") {
            self.inputs.push(found.into_iter().flatten().collect());
            number = u8::try_from(self.inputs.len()).unwrap_or(u8::MAX);
        }
        let mut message = vec![number];
        message.extend(types.join(",").bytes());
        package(b'I', &message)
    }

    fn take_inputs(&self, body: &[u8], controller: &mut Controller) -> Option<()> {
        let (number, values) = body.split_first()?;
        let registers = self.inputs.get(usize::from(*number).checked_sub(1)?)?;
        if values.len() != registers.len() * 4 {
            return None;
        }
        for (register, value) in registers.iter().zip(values.chunks_exact(4)) {
            controller.write_input(*register, i32::from_be_bytes(*value.first_chunk()?));
        }
        Some(())
    }

    /// The state of the robot, if it is time for one.
    pub(super) fn state(&mut self, controller: &Controller) -> Option<Vec<u8>> {
        let now = controller.time_s();
        if !self.started || now + CYCLE_S / 2.0 < self.due_s {
            return None;
        }
        // What was not sent in time is left out, not made up for.
        self.due_s = (self.due_s + self.every_s).max(now);
        let mut body = if self.version == 1 { Vec::new() } else { vec![1] };
        self.outputs.iter().for_each(|output| output.write(controller, &mut body));
        Some(package(b'U', &body))
    }
}

fn package(kind: u8, body: &[u8]) -> Vec<u8> {
    let [.., high, low] = (HEADER + body.len()).to_be_bytes();
    [&[high, low, kind], body].concat()
}
